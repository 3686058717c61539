"""The partition's rules against a plain statement of them, and what the ROM's loader writes."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator
from chladni.host.flashing.partition import slot_in_use, update
from chladni.host.flashing.rom_loader import TABLES, partition_of, partitions
from chladni.host.protocol.slot_store import (
    ENTRY_BYTES,
    PARTITION_BYTES,
    SECTOR_BYTES,
    SLOT_BYTES,
    TRAILER_OFFSET,
)
from chladni.sim.errors import InputError
from chladni.tables._firmware import FirmwareStore
from chladni.tables.format import pack
from made_up import device_of, entry_bytes, make_table

TABLES_BYTES = [pack(make_table(np.array([[g, 1.0, 2.0, 3.0, 4.0]]))) for g in (10.0, 5.0, 7.0)]


def crc(table: bytes) -> int:
    return int.from_bytes(table[-4:], "little")


def random_image(seed: int) -> tuple[bytes, int]:
    """Slots with a table, a damaged one or nothing, right and wrong entries, and the slot to play.

    By the rule as people would say it: of the slots whose whole table was entered, the one entered
    last; else the first that holds a whole table.
    """
    rng = random.Random(seed)
    data = bytearray(b"\xff" * PARTITION_BYTES)
    start = rng.choice([0, 1, 2**31 - 2, 2**32 - 3])
    ages: dict[int, int] = {}
    whole = []
    numbers = list(range(12))
    rng.shuffle(numbers)
    for slot in (0, 1):
        table = bytearray(rng.choice(TABLES_BYTES))
        is_whole = rng.random() >= 0.25
        if not is_whole:
            table[rng.randrange(len(table))] ^= 1 << rng.randrange(8)
        if rng.random() < 0.15:
            is_whole = False
        else:
            data[slot * SLOT_BYTES : slot * SLOT_BYTES + len(table)] = table
        whole += [slot] * is_whole
        for k in range(rng.randrange(6)):
            number, meant = numbers.pop(), rng.choice(TABLES_BYTES)
            made = entry_bytes(start + number, crc(meant))
            if rng.random() < 0.2:
                made = made[:5] + b"\xff" * (ENTRY_BYTES - 5)
            elif is_whole and crc(meant) == crc(bytes(table)):
                ages[slot] = max(ages.get(slot, -1), number)
            at = slot * SLOT_BYTES + TRAILER_OFFSET + k * ENTRY_BYTES
            data[at : at + ENTRY_BYTES] = made
    if ages:
        return bytes(data), max(ages, key=lambda slot: ages[slot])
    return bytes(data), whole[0] if whole else 0


def started(image: bytes) -> Emulator:
    emulator = Emulator(device_of(), None, must_play=False)
    emulator.core.program(0, image)
    emulator.core.boot()
    return emulator


@given(st.integers(0, 10**6))
@settings(max_examples=100, deadline=None)
def test_the_table_that_was_entered_last_plays(seed: int) -> None:
    image, slot = random_image(seed)
    if playing(image) is not None:
        assert slot_in_use(image) == slot
        assert Device(EmulatorWire(started(image))).info()["slot"] == slot


def playing(image: bytes) -> int | None:
    """CRC of what a device plays."""
    info = Device(EmulatorWire(started(image))).info()
    return int(info["table_crc"], 16) if info["table_status"] == "ok" else None


@given(st.integers(0, 10**6), st.integers(0, 5))
@settings(max_examples=60, deadline=None)
def test_an_update_by_the_loader_counts_and_a_cut_in_it_does_no_harm(seed: int, cut: int) -> None:
    """Whole sectors are erased and written; the cut comes before, between or within the writes."""
    image = bytearray(random_image(seed)[0])
    before, new = playing(bytes(image)), TABLES_BYTES[seed % 3]
    writes = update(bytes(image), new)
    if not writes:
        assert before == crc(new)  # it is there already
        return
    assert writes[-1][0] % SLOT_BYTES == TRAILER_OFFSET
    for k, (offset, data) in enumerate(writes):
        assert offset % SECTOR_BYTES == len(data) % SECTOR_BYTES == 0
        image[offset : offset + len(data)] = b"\xff" * len(data)
        if cut == k:
            break
        written = data if cut != k + 3 else data[:9] + b"\xff" * (len(data) - 9)
        image[offset : offset + len(data)] = written
        if cut == k + 3:
            break
    else:
        assert playing(bytes(image)) == crc(new)
    if before is not None:
        assert playing(bytes(image)) in (before, crc(new))


def test_the_store_goes_back_and_forth() -> None:
    first, second, _ = TABLES_BYTES
    store = FirmwareStore(b"\xff" * PARTITION_BYTES)
    assert store.update(first) == "ok"
    slot = store.slot
    assert store.restore_other(5) == "none in the other slot"
    assert store.update(second) == "ok"
    assert store.slot == 1 - slot
    assert store.restore_other(5) == "ok"
    assert store.slot == slot
    assert playing(store.image) == crc(first)
    assert store.update(b"\0" * 200) != "ok"
    assert playing(store.image) == crc(first)


def rows(*entries: tuple[str, int, int, int, int]) -> bytes:
    made = b"".join(
        struct.pack("<2sBBII16sI", b"\xaa\x50", kind, subtype, offset, size, name.encode(), 0)
        for name, kind, subtype, offset, size in entries
    )
    return (made + b"\xeb\xeb" + b"\xff" * 30).ljust(0xC00, b"\xff")


def test_the_offset_comes_from_the_devices_own_partition_table() -> None:
    table = rows(
        ("nvs", 1, 2, 0x9000, 0x6000),
        ("factory", 0, 0, 0x10000, 0x180000),
        ("tables", TABLES, 0, 0x2A0000, 0x80000),
    )
    assert [p.name for p in partitions(table)] == ["nvs", "factory", "tables"]
    assert partition_of(table, TABLES, "tables").offset == 0x2A0000
    with pytest.raises(InputError, match="Chladni's firmware"):
        partition_of(rows(("nvs", 1, 2, 0x9000, 0x6000)), TABLES, "tables")
    with pytest.raises(InputError, match="aa50"):
        partitions(b"\x12\x34" * 0x600)


def test_what_is_no_partition_or_too_large_is_refused() -> None:
    with pytest.raises(InputError, match="tables partition"):
        slot_in_use(b"\xff" * 100)
    with pytest.raises(InputError, match="too large for a slot"):
        update(b"\xff" * PARTITION_BYTES, bytes(TRAILER_OFFSET + 1))
