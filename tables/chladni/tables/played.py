"""What a device plays: a table read and looked up by the firmware's own code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import ChladniError
from chladni.tables._firmware import FirmwareTable
from chladni.tables.table import dequantise

ComplexArray = NDArray[np.complex128]


class FirmwareReader:
    """One section of a table, as the firmware reads it; drives are in units of the largest gain.

    Attributes
    ----------
    bytes
        Size of the table.

    Raises
    ------
    ChladniError
        The firmware refuses the table; says why.
    """

    def __init__(self, data: bytes, channels: int) -> None:
        self.bytes = len(data)
        self.table = FirmwareTable(data, channels)
        if self.table.status != "ok":
            raise ChladniError(f"the firmware refuses the table: {self.table.status}")

    def drives(self, x_um: NDArray[np.int32], y_um: NDArray[np.int32]) -> ComplexArray:
        """Drives of places, interpolated, shape (places, actuators)."""
        return dequantise(self.table.lookup(x_um, y_um), 1.0)

    def regions(self) -> ComplexArray:
        """Drives of all regions, shape (regions, actuators)."""
        return dequantise(self.table.regions(), 1.0)
