"""The firmware's own reading and keeping of tables (tables/native/reader)."""

import numpy as np
from numpy.typing import NDArray

class FirmwareTable:
    """A table as a device with so many channels reads it from the bytes of a file."""

    def __init__(self, data: bytes, channels: int) -> None: ...
    @property
    def status(self) -> str:
        """What the device says of it: "ok", or why it refuses."""
    def select(self, frequency_millihertz: int) -> str:
        """Use another frequency's sections; "ok", or why not."""
    def lookup(self, x_um: NDArray[np.int32], y_um: NDArray[np.int32]) -> NDArray[np.int16]:
        """Drives of places, shape (places, channels, 2); zeros without drives."""
    @property
    def has_drives(self) -> bool:
        """Whether there are drives of the frequency in use."""
    @property
    def has_responses(self) -> bool:
        """Whether there are responses of the frequency in use."""
    def responses(self, x_um: NDArray[np.int32], y_um: NDArray[np.int32]) -> NDArray[np.complex64]:
        """Of each channel and, last, the own compliance, m/N, shape (places, channels + 1)."""
    def finger(self) -> tuple[float, float, complex]:
        """N of a coil in a touch without end, m that are just felt, N/m of a pressing fingertip."""
    def coupling(self) -> NDArray[np.complex64]:
        """How one finger's push moves another, shape (channels, channels), N/m."""

class FirmwareStore:
    """The slots of a tables partition, as the device keeps them, in an image of its flash."""

    def __init__(self, image: bytes) -> None: ...
    @property
    def slot(self) -> int:
        """The slot that a start would play."""
    @property
    def image(self) -> bytes:
        """The partition as it is now."""
    def update(self, table: bytes) -> str:
        """Put a table into the other slot and make it count; "ok", or why not."""
    def restore_other(self, channels: int) -> str:
        """Make the other slot's table count; "ok", or why not."""
    def writes(self) -> list[tuple[int, bytes]]:
        """Offset and bytes of every stretch of sectors written since, in the order of writing."""
