"""What a device plays: a table read and looked up by the firmware's own code."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import ChladniError
from chladni.tables._firmware import FirmwareTable
from chladni.tables.table import dequantise

ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]


class FirmwareReader:
    """A table as the firmware reads it; drives are in units of the largest gain.

    Raises
    ------
    ChladniError
        The firmware refuses the table; the message has the reason.
    """

    def __init__(self, data: bytes, channels: int) -> None:
        self._table = FirmwareTable(data, channels)
        if self._table.status != "ok":
            hint = "build it again with this version"
            raise ChladniError(f"the firmware refuses the table: {self._table.status}", hint=hint)

    def drives(self, frequency_hz: float, x_um: IntArray, y_um: IntArray) -> ComplexArray:
        """Drives of places at a frequency the table has, interpolated, shape (places, actuators).

        Raises
        ------
        ChladniError
            The firmware does not find the frequency.
        """
        return dequantise(self.integers(frequency_hz, x_um, y_um), 1.0)

    def integers(self, frequency_hz: float, x_um: IntArray, y_um: IntArray) -> NDArray[np.int16]:
        """The same as the device has them, shape (places, actuators, 2)."""
        return self._table.lookup(*self._at(frequency_hz, x_um, y_um))

    def responses(
        self, frequency_hz: float, x_um: IntArray, y_um: IntArray
    ) -> tuple[NDArray[np.complex64], NDArray[np.complex64]]:
        """Responses of places at a frequency the table has them for, and the coupling.

        Shapes (places, actuators + 1), the own compliance last, and (actuators, actuators); raises
        as `drives` does.
        """
        return self._table.responses(*self._at(frequency_hz, x_um, y_um)), self._table.coupling()

    def _at(
        self, frequency_hz: float, x_um: IntArray, y_um: IntArray
    ) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        found = self._table.select(round(frequency_hz * 1000.0))
        if found != "ok":
            hint = "`chladni table show` lists the frequencies"
            text = f"the firmware plays nothing at {frequency_hz:g} Hz: {found}"
            raise ChladniError(text, hint=hint)
        return np.ascontiguousarray(x_um, np.int32), np.ascontiguousarray(y_um, np.int32)
