"""The firmware's own reading of tables (tables/reader)."""

import numpy as np
from numpy.typing import NDArray

class FirmwareTable:
    """A table as a device with so many channels reads it from the bytes of a file."""

    def __init__(self, data: bytes, channels: int) -> None: ...
    @property
    def status(self) -> str:
        """What the device says of it: "ok", or why it refuses."""
    @property
    def frequency_mhz(self) -> int:
        """Of the drives in use."""
    def select(self, frequency_mhz: int) -> str:
        """Use another frequency's drives; "ok", or why not."""
    def region_at(self, x_um: int, y_um: int) -> int:
        """The region of a place."""
    def lookup(self, x_um: NDArray[np.int32], y_um: NDArray[np.int32]) -> NDArray[np.int16]:
        """Drives of places, shape (places, channels, 2)."""
    def regions(self) -> NDArray[np.int16]:
        """Drives of all regions, shape (regions, channels, 2)."""
