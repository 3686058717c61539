"""Partitions with tables as they may be found, each with the table that plays from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.slot_store import (
    ENTRY_BYTES,
    PARTITION_BYTES,
    SECTOR_BYTES,
    SLOT_BYTES,
    TRAILER_OFFSET,
)
from chladni.tables.format import pack
from made_up import device_of, entry_bytes, make_table

OLD, NEW, OLDER = (
    pack(make_table(np.array([[gain, 1.0, 2.0, 3.0, 4.0]]))) for gain in (10.0, 5.0, 7.0)
)


def connected(emulator: Emulator) -> Device:
    return Device(EmulatorWire(emulator))


def table_crc(device: Device) -> int:
    return int(device.info()["table_crc"], 16)


def crc_of(table: bytes) -> int:
    return int.from_bytes(table[-4:], "little")


def with_flash(image: bytes) -> Emulator:
    """A device whose tables partition holds an image."""
    emulator = Emulator(device_of(), None, must_play=False)
    emulator.core.program(0, image)
    emulator.core.boot()
    return emulator


def image(slots: dict[int, bytes], entries: list[tuple[int, int, bytes]]) -> bytes:
    """A partition with tables in slots, and entries in their trailers: number, slot, table."""
    data = bytearray(b"\xff" * PARTITION_BYTES)
    for slot, table in slots.items():
        data[slot * SLOT_BYTES : slot * SLOT_BYTES + len(table)] = table
    free = [slot * SLOT_BYTES + TRAILER_OFFSET for slot in (0, 1)]
    for sequence, slot, table in entries:
        data[free[slot] : free[slot] + ENTRY_BYTES] = entry_bytes(sequence, crc_of(table))
        free[slot] += ENTRY_BYTES
    return bytes(data)


def damaged(table: bytes) -> bytes:
    return table[:90] + bytes([table[90] ^ 1]) + table[91:]


FULL = SECTOR_BYTES // ENTRY_BYTES
"""Entries that a trailer holds."""
FULL_TRAILERS = [(k + 1, 1 - k % 2, OLDER if k % 2 == 0 else OLD) for k in range(2 * FULL)]


@dataclass(frozen=True)
class Start:
    """A partition, and the table that plays from it."""

    image: bytes
    playing: bytes | None


BOTH = [(1, 0, OLDER), (2, 1, OLD)]
REVERSED = [(1, 0, OLD), (2, 1, OLDER)]
ONE = image({0: OLD}, [(1, 0, OLD)])
TORN = TRAILER_OFFSET + ENTRY_BYTES
STARTS = {
    "no table": Start(image({}, []), None),
    "one, by the ROM's loader": Start(image({0: OLD}, []), OLD),
    "one, in the second slot": Start(image({1: OLD}, [(4, 1, OLD)]), OLD),
    "two": Start(image({0: OLDER, 1: OLD}, BOTH), OLD),
    "two, gone back to the first": Start(image({0: OLD, 1: OLDER}, [*REVERSED, (3, 0, OLD)]), OLD),
    "two, the newer corrupt": Start(image({0: OLD, 1: damaged(OLDER)}, REVERSED), OLD),
    "two, the older corrupt": Start(image({0: damaged(OLDER), 1: OLD}, BOTH), OLD),
    "two, numbers about to wrap": Start(
        image({0: OLDER, 1: OLD}, [(2**32 - 2, 0, OLDER), (2**32 - 1, 1, OLD)]), OLD
    ),
    "a torn entry": Start(ONE[:TORN] + b"\x02\x00" + ONE[TORN + 2 :], OLD),
    "full trailers": Start(image({0: OLD, 1: OLDER}, FULL_TRAILERS), OLD),
    "an entry of what was written over": Start(image({0: OLD, 1: NEW}, [*REVERSED]), OLD),
}
