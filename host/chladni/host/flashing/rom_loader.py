"""A device that does not run, or runs something else: through the ROM's loader, by esptool.

esptool is under the GPL, and Chladni under the MIT licence: it is an extra, `chladni[rom]`, and is
imported here and nowhere else (docs/licences.md).

Nothing is written but to the partition that is meant, at the offset that the device's own partition
table gives.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chladni.host.device.wires.wire import WireError
from chladni.host.flashing.partition import slot_in_use, update
from chladni.host.protocol.board_config import check_chip, check_driver
from chladni.host.protocol.config import DeviceConfig, pack_config, unpack_config
from chladni.host.protocol.slot_store import PARTITION_BYTES, SECTOR_BYTES
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import ChipName
from chladni.sim.errors import ArgumentError, ChladniError, ConflictError, InputError
from chladni.sim.files import read_whole

TABLE_OFFSET = 0x8000
TABLE_BYTES = 0xC00
"""Where ESP-IDF puts the partition table, and its size."""
_ENTRY = struct.Struct("<2sBBII16sI")
_MAGIC, _CHECKSUM = b"\xaa\x50", b"\xeb\xeb"
APP, TABLES = 0x00, 0x40
CONFIG_SECTORS = 2
FLASH_BYTES = 16 * 2**20
"""The largest flash of a module; an application's partition is smaller."""
IMAGE_MAGIC = 0xE9
"""First byte of an application image."""


CHIP_ID = slice(12, 14)
"""In its header, what it was linked for."""
IMAGE_CHIPS = {0: "ESP32", 9: "ESP32-S3"}
"""By that number (ESP-IDF 5.5.3, esp_app_format.h)."""

OURS: Mapping[str, ChipName] = {"ESP32": "esp32", "ESP32-S3": "esp32s3"}
"""Chips that there is firmware for, by esptool's names."""
HOLD_BOOT = "hold the button BOOT while the chip starts"
SLOWER = "try again with --baud 115200 and a shorter cable"


class RomError(ChladniError):
    """The loader did not answer, or what was written is not there."""


@dataclass(frozen=True)
class Partition:
    """A row of the device's partition table."""

    name: str
    kind: int
    subtype: int
    offset: int
    size: int


def partitions(table: bytes) -> list[Partition]:
    """Rows of a partition table as it lies in flash.

    Raises
    ------
    InputError
        It is none.
    """
    found = []
    for row in _ENTRY.iter_unpack(table[: len(table) // _ENTRY.size * _ENTRY.size]):
        magic, kind, subtype, offset, size, name, _ = row
        if magic in (_CHECKSUM, b"\xff\xff"):
            break
        if magic != _MAGIC:
            raise InputError("partition table", magic.hex(), "rows that begin with aa50")
        text = name.rstrip(b"\0").decode("ascii", "replace")
        found.append(Partition(text, kind, subtype, offset, size))
    return found


def partition_of(table: bytes, kind: int, name: str) -> Partition:
    """The one of a kind and name.

    Raises
    ------
    InputError
        The device has none; its firmware is not Chladni's.
    """
    for partition in partitions(table):
        if (partition.kind, partition.name) == (kind, name):
            return partition
    hint = "is this Chladni's firmware?"
    raise InputError("partition", "none", f"one named {name!r}", hint=hint)


def flash_table(port: str, baud: int, table: bytes) -> dict[str, Any]:
    """Write a table to the slot that is not in use, verify it, and make it count.

    Raises
    ------
    RomError, InputError
        See there.
    """
    with loader(port, baud) as esp:
        partition = _partition(esp, TABLES, "tables")
        if partition.size < PARTITION_BYTES:
            raise InputError("tables", partition.size, f"{PARTITION_BYTES} bytes at least")
        image = _read(esp, partition.offset, PARTITION_BYTES)
        writes = update(image, table)
        slot = slot_in_use(image) if not writes else 1 - slot_in_use(image)
        for offset, data in writes:
            _write(esp, partition.offset + offset, data)
    return {"bytes": len(table), "slot": slot, "verified": True}


def change_config(
    port: str,
    baud: int,
    changes: Mapping[str, Any],
    board: Board | None = None,
    *,
    may_change_driver: bool = False,
) -> DeviceConfig:
    """Change settings of the newest whole record, or of the defaults where there is none.

    `board` is the file that they come from, if any: one of another chip is refused. So is another
    driver than a whole record has, unless it may change.
    The new record goes to the sector that does not hold the newest, so that a cut costs nothing.

    Raises
    ------
    RomError, InputError
        See there; pins that the chip cannot use so are refused.
    """
    with loader(port, baud) as esp:
        partition = _partition(esp, TABLES, "config")
        image = _read(esp, partition.offset, CONFIG_SECTORS * SECTOR_BYTES)
        found = [_record(image[k * SECTOR_BYTES :][:SECTOR_BYTES]) for k in range(CONFIG_SECTORS)]
        newest = newest_record(found)
        base, sequence = found[newest] or (DeviceConfig(), 0)
        own = OURS[esp.CHIP_NAME]
        check_chip(own, board)
        wanted = base.with_values(**changes).by_wire()
        wanted.check_pins(own)
        if found[newest] and not may_change_driver:
            check_driver(base, wanted)
        sector = 1 - newest if found[newest] else 0
        record = pack_config(wanted, (sequence + 1) & 0xFFFFFFFF)
        _write(esp, partition.offset + sector * SECTOR_BYTES, record)
    return wanted


def forget_network(port: str, baud: int) -> None:
    """Erase name, passphrase and key of a network, so that no radio starts.

    Raises
    ------
    RomError, InputError
        See there.
    """
    with loader(port, baud) as esp:
        partition = _partition(esp, TABLES, "network")
        _write(esp, partition.offset, b"\xff" * SECTOR_BYTES)


Record = tuple[DeviceConfig, int]


def _record(sector: bytes) -> Record | None:
    """Settings and sequence number of a sector; None where there is no whole record."""
    try:
        return unpack_config(sector)
    except InputError:
        return None


def newest_record(found: Sequence[Record | None]) -> int:
    """Which of two sectors counts; sequence numbers may wrap around."""
    first, second = found
    if first is None or second is None:
        return 1 if first is None and second is not None else 0
    return 1 if 0 < (second[1] - first[1]) & 0xFFFFFFFF < 0x80000000 else 0


def flash_firmware(port: str, baud: int, file: Path) -> dict[str, Any]:
    """Write an application image into the application's partition, and nowhere else.

    Raises
    ------
    RomError, InputError
        See there.
    """
    image = read_whole(file, "firmware", FLASH_BYTES, "an ESP32 application image")
    if not image or image[0] != IMAGE_MAGIC:
        raise ArgumentError("firmware", str(file), "an ESP32 application image (firmware.bin)")
    with loader(port, baud) as esp:
        made_for = IMAGE_CHIPS.get(int.from_bytes(image[CHIP_ID], "little"), "another chip")
        if made_for != esp.CHIP_NAME:
            raise ConflictError(
                "firmware", f"the {esp.CHIP_NAME} at {port}", hint=f"{file} is for {made_for}"
            )
        app = _partition(esp, APP, "factory")
        if len(image) > app.size:
            raise ArgumentError("firmware", f"{len(image)} bytes", f"at most {app.size}")
        _write(esp, app.offset, image)
    return {"bytes": len(image), "offset": app.offset, "verified": True}


@contextmanager
def loader(port: str, baud: int) -> Iterator[Any]:
    """The ROM's loader at a port; the device starts again at the end.

    Raises
    ------
    WireError, RomError
        No such port, nothing there that loads, or no esptool.
    """
    # esptool talks on standard output, which belongs to the command's own answer.
    with redirect_stdout(sys.stderr):
        yield from _loaded(port, baud)


def _esptool() -> tuple[Any, Any]:
    """esptool, and its commands.

    Raises
    ------
    RomError
        It is not installed.
    """
    try:
        import esptool  # noqa: PLC0415  (may be missing)
        from esptool import cmds  # noqa: PLC0415
    except ImportError as error:
        raise RomError("ROM flashing needs esptool", hint="pip install 'chladni[rom]'") from error
    return esptool, cmds


def _loaded(port: str, baud: int) -> Iterator[Any]:
    esptool, cmds = _esptool()
    try:
        esp = cmds.detect_chip(port, baud=115_200)
    except (OSError, esptool.FatalError) as error:
        raise WireError(f"{port}: {str(error).splitlines()[0]}", hint=HOLD_BOOT) from None
    try:
        if esp.CHIP_NAME not in OURS:
            hint = f"there is firmware for: {', '.join(OURS)}"
            raise RomError(f"{port}: a chip of the kind {esp.CHIP_NAME}", hint=hint)
        esp = cmds.run_stub(esp)
        if baud != 115_200:
            esp.change_baud(baud)
        cmds.attach_flash(esp)
        yield esp
        cmds.reset_chip(esp)
    except esptool.FatalError as error:
        raise RomError(f"{port}: {error}", hint=SLOWER) from None
    finally:
        esp._port.close()


def _partition(esp: Any, kind: int, name: str) -> Partition:
    """A partition by the device's own table."""
    return partition_of(_read(esp, TABLE_OFFSET, TABLE_BYTES), kind, name)


def _read(esp: Any, address: int, size: int) -> bytes:
    _, cmds = _esptool()
    data = cmds.read_flash(esp, address, size, no_progress=True)
    if data is None or len(data) != size:
        raise RomError(f"flash at {address:#x} could not be read", hint=SLOWER)
    return bytes(data)


def _write(esp: Any, address: int, data: bytes) -> None:
    _, cmds = _esptool()
    cmds.write_flash(esp, [(address, data)])
    if _read(esp, address, len(data)) != data:
        raise RomError(f"flash at {address:#x} does not hold what was written", hint=SLOWER)
