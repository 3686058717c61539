"""The emulated device's flash in a file: what it keeps when its power goes."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from chladni.host.emulation._emulator import SECTOR_BYTES
from chladni.host.emulation._emulator import Emulator as Core
from chladni.host.protocol.slot_store import BANK_PARTITION_BYTES, PARTITION_BYTES
from chladni.sim.errors import ArgumentError
from chladni.sim.files import open_regular, write_at

AREAS = {
    "tables": PARTITION_BYTES,
    "config": 8192,
    "network": 4096,
    "boots": 4096,
    "effects": BANK_PARTITION_BYTES,
}
"""Partitions in the order in which they lie in the file, and their bytes."""
BLANK = b"\xff"


class FlashFile:
    """A file of all partitions, one behind the other; made blank if it is not there.

    Every change is in the file within milliseconds, so a device whose process is killed finds on
    its next start what a board finds after its plug was pulled.

    Raises
    ------
    InputError
        It cannot be read or made, has another size, or another device runs on it.
    """

    def __init__(self, path: Path) -> None:
        size = sum(AREAS.values())
        is_new = not os.path.lexists(path)
        try:
            flags = os.O_RDWR | os.O_CREAT
            self._file = open_regular(path, "flash", flags, mode=0o600, follow=False)
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(self._file)
            raise ArgumentError(
                "flash", "in use", "a file that no other device runs on", file=str(path)
            ) from None
        except OSError as error:
            raise ArgumentError(
                "flash", error.strerror, "a file that can be written, or made", file=str(path)
            ) from None
        found = os.fstat(self._file).st_size
        if found == size - AREAS["effects"]:  # made before there were effect banks
            self._extend(path, found, AREAS["effects"])
            found = size
        if found == 0:
            self._make_blank(path, size, is_new=is_new)
        elif found != size:
            os.close(self._file)
            raise ArgumentError(
                "flash",
                f"{found} bytes",
                f"the {size} bytes of a flash file, or none",
                file=str(path),
            )
        self._held = {area: self._read(area) for area in AREAS}
        self._changes = 0

    def _make_blank(self, path: Path, size: int, *, is_new: bool) -> None:
        """Fill an empty file; where the disk has no room for that, leave all as it was."""
        try:
            write_at(self._file, BLANK * size, 0)
        except OSError as error:
            if is_new:
                path.unlink(missing_ok=True)
            else:
                os.ftruncate(self._file, 0)
            os.close(self._file)
            raise OSError(error.errno, error.strerror, str(path)) from None

    def _extend(self, path: Path, size: int, more: int) -> None:
        """Make room for more; where the disk has none, leave the file as it was."""
        try:
            write_at(self._file, BLANK * more, size)
        except OSError as error:
            os.ftruncate(self._file, size)
            os.close(self._file)
            raise OSError(error.errno, error.strerror, str(path)) from None

    @property
    def contents(self) -> dict[str, bytes]:
        """What lies in each partition."""
        return dict(self._held)

    def follow(self, core: Core) -> None:
        """Write what has changed in the device since the last call."""
        if core.flash_changes == self._changes:
            return
        self._changes = core.flash_changes
        for area in AREAS:
            now, before = core.flash_bytes(area), self._held[area]
            for at in range(0, len(now), SECTOR_BYTES):
                sector = now[at : at + SECTOR_BYTES]
                if sector != before[at : at + SECTOR_BYTES]:
                    write_at(self._file, sector, self._begin(area) + at)
            self._held[area] = now

    def close(self) -> None:
        """Let another device have it."""
        os.close(self._file)

    def _read(self, area: str) -> bytes:
        return os.pread(self._file, AREAS[area], self._begin(area))

    def _begin(self, area: str) -> int:
        names = list(AREAS)
        return sum(AREAS[name] for name in names[: names.index(area)])
