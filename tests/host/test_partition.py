"""The partition's rules in Python against the firmware's, and the ROM path's planning."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from chladni.host.device import Device
from chladni.host.emulator import Emulator
from chladni.host.flash_layout import (
    ENTRY_BYTES,
    JOURNAL_OFFSET,
    PARTITION_BYTES,
    SECTOR_BYTES,
    SLOT_BYTES,
)
from chladni.host.partition import entry_bytes, slot_in_use, update, whole_table
from chladni.host.rom import TABLES, partition_of, partitions
from chladni.host.wire import EmulatorWire
from chladni.sim.errors import InputError
from chladni.tables.format import pack
from made_up import device_of, make_table

TABLES_BYTES = [pack(make_table(np.array([[g, 1.0, 2.0, 3.0, 4.0]]))) for g in (10.0, 5.0, 7.0)]


def crc(table: bytes) -> int:
    return int.from_bytes(table[-4:], "little")


def random_image(seed: int) -> bytes:
    """Slots with a table, a damaged one or nothing; a journal of right and wrong entries."""
    rng = random.Random(seed)
    data = bytearray(b"\xff" * PARTITION_BYTES)
    for slot in (0, 1):
        table = bytearray(rng.choice(TABLES_BYTES))
        if rng.random() < 0.25:
            table[rng.randrange(len(table))] ^= 1 << rng.randrange(8)
        if rng.random() < 0.85:
            data[slot * SLOT_BYTES : slot * SLOT_BYTES + len(table)] = table
    start = rng.choice([0, 1, 2**31 - 2, 2**32 - 3])
    for k in range(rng.randrange(6)):
        made = entry_bytes(start + k, rng.randrange(3), crc(rng.choice(TABLES_BYTES)))
        if rng.random() < 0.2:
            made = made[:5] + b"\xff" * 11
        at = JOURNAL_OFFSET + rng.randrange(2) * SECTOR_BYTES + k * ENTRY_BYTES
        data[at : at + ENTRY_BYTES] = made
    return bytes(data)


def started(image: bytes) -> Emulator:
    emulator = Emulator(device_of(), None, must_play=False)
    emulator.core.program(0, image)
    emulator.core.boot()
    return emulator


@given(st.integers(0, 10**6))
@example(481767)  # an older entry whose table is whole stands behind one whose is not
@settings(max_examples=100, deadline=None)
def test_python_and_firmware_choose_the_same_slot_and_table(seed: int) -> None:
    image = random_image(seed)
    slot = slot_in_use(image)
    info = Device(EmulatorWire(started(image))).info()
    assert info["slot"] == slot
    table = whole_table(image, slot)
    assert (info["table_status"] == "ok") == (table is not None)
    if table is not None:
        assert int(info["table_crc"], 16) == crc(table)


@given(st.integers(0, 10**6), st.integers(0, 3))
@settings(max_examples=60, deadline=None)
def test_an_update_by_the_loader_counts_and_a_cut_in_it_does_no_harm(seed: int, cut: int) -> None:
    """Whole sectors are erased and written; the cut comes before, between or within the writes."""
    image = bytearray(random_image(seed))
    before = whole_table(bytes(image), slot_in_use(bytes(image)))
    new = TABLES_BYTES[seed % 3]
    for k, (offset, data) in enumerate(update(bytes(image), new)):
        assert offset % SECTOR_BYTES == len(data) % SECTOR_BYTES == 0
        image[offset : offset + len(data)] = b"\xff" * len(data)
        if cut == k:
            break
        written = data if cut != k + 2 else data[:9] + b"\xff" * (len(data) - 9)
        image[offset : offset + len(data)] = written
        if cut == k + 2:
            break
    slot = slot_in_use(bytes(image))
    playing = whole_table(bytes(image), slot)
    if before is not None:
        assert playing in (before, new)
    info = Device(EmulatorWire(started(bytes(image)))).info()
    assert info["slot"] == slot


def rows(*entries: tuple[str, int, int, int, int]) -> bytes:
    made = b"".join(
        struct.pack("<2sBBII16sI", b"\xaa\x50", kind, subtype, offset, size, name.encode(), 0)
        for name, kind, subtype, offset, size in entries
    )
    return (made + b"\xeb\xeb" + b"\xff" * 30).ljust(0xC00, b"\xff")


def test_the_offset_comes_from_the_devices_own_partition_table() -> None:
    table = rows(("nvs", 1, 2, 0x9000, 0x6000), ("factory", 0, 0, 0x10000, 0x180000),
                 ("tables", TABLES, 0, 0x2A0000, 0x20000))  # fmt: skip
    assert [p.name for p in partitions(table)] == ["nvs", "factory", "tables"]
    assert partition_of(table, TABLES, "tables").offset == 0x2A0000
    with pytest.raises(InputError, match="Chladni's firmware"):
        partition_of(rows(("nvs", 1, 2, 0x9000, 0x6000)), TABLES, "tables")
    with pytest.raises(InputError, match="aa50"):
        partitions(b"\x12\x34" * 0x600)


def test_what_is_no_partition_or_too_large_is_refused() -> None:
    with pytest.raises(InputError, match="tables partition"):
        slot_in_use(b"\xff" * 100)
    with pytest.raises(InputError, match="at most"):
        update(b"\xff" * PARTITION_BYTES, bytes(SLOT_BYTES + 1))
