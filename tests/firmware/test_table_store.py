"""A new table arrives whole or not at all, wherever the power fails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.link import LinkError
from chladni.host.device.upload import TableUpload
from chladni.host.device.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.link import Status
from chladni.host.protocol.table_store import (
    ENTRY_BYTES,
    PARTITION_BYTES,
    SECTOR_BYTES,
    SLOT_BYTES,
    TRAILER_OFFSET,
)
from chladni.sim.errors import InputError
from chladni.tables.format import pack
from chladni.tables.layout import HEADER_BYTES
from made_up import device_of, entry_bytes, forge, make_table, powered, random_table

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


@pytest.mark.parametrize("name", STARTS)
def test_the_newest_whole_table_plays(name: str) -> None:
    start = STARTS[name]
    emulator = with_flash(start.image)
    if start.playing is None:
        assert emulator.core.table_status == "no table"
        return
    assert emulator.core.table_status == "ok"
    assert table_crc(connected(emulator)) == crc_of(start.playing)


@pytest.mark.parametrize("name", STARTS)
def test_an_update_takes_over_and_the_previous_one_comes_back(name: str) -> None:
    start = STARTS[name]
    emulator = with_flash(start.image)
    device = connected(emulator)
    slot = device.info()["slot"] if start.playing else 0
    flashed = device.flash(NEW)
    assert flashed.verified
    assert flashed.slot == 1 - slot
    emulator.core.boot()
    device = connected(emulator)
    assert table_crc(device) == crc_of(NEW)
    if start.playing is not None:
        assert device.previous() == slot
        emulator.core.boot()
        assert table_crc(connected(emulator)) == crc_of(start.playing)


def operations(image: bytes) -> int:
    """Bytes that one update of such a partition erases and programmes: so many suffice for it."""
    low, high = 0, 10_000_000
    while low < high:
        middle = (low + high) // 2
        emulator = with_flash(image)
        emulator.core.cut_power_after(middle)
        low, high = (low, middle) if _update(emulator) else (middle + 1, high)
    return low


def interesting_cuts(total: int) -> list[int]:
    """Every byte of every programme, and erases torn at their ends and in between."""
    erased = SECTOR_BYTES
    cuts = [*range(0, erased, 97), erased - 1]
    return sorted({*cuts, *range(erased, total + 1)} if total <= 2 * erased else {
        *cuts, *range(erased, erased + len(NEW) + 1),
        *(total - k for k in range(ENTRY_BYTES + 2)),
        *range(erased + len(NEW), total - ENTRY_BYTES, 293),
    })  # fmt: skip


@pytest.mark.slow
def test_a_cut_at_any_byte_leaves_the_old_table_or_the_new() -> None:
    """From every starting state; and the update can be done again afterwards."""
    tried = 0
    for start in STARTS.values():
        total = operations(start.image)
        for cut in interesting_cuts(total):
            emulator = with_flash(start.image)
            emulator.core.cut_power_after(cut)
            said = _update(emulator)
            check_after_cut(emulator, start, said)
            tried += 1
        # What is there already is not written again.
        written = 0 if NEW in start.image else SECTOR_BYTES + len(NEW)
        assert total >= written + (0 if start.playing == NEW else ENTRY_BYTES)
    print(f"{tried} cuts")
    assert tried > 1_000


def _update(emulator: Emulator) -> bool:
    try:
        return connected(emulator).flash(NEW).verified
    except LinkError:
        return False


def check_after_cut(emulator: Emulator, start: Start, said: bool) -> None:
    emulator.core.restore_power()
    emulator.core.boot("brown-out")
    if start.playing is None and emulator.core.table_status == "no table":
        assert not said
    elif emulator.core.table_status != "ok":
        # Only where there was no table before can a torn one be all there is.
        assert start.playing is None
        assert not said
    else:
        playing = table_crc(connected(emulator))
        allowed = {crc_of(NEW)} | ({crc_of(start.playing)} if start.playing else set())
        assert playing in allowed
        if said:
            assert playing == crc_of(NEW)
    assert connected(emulator).flash(NEW).verified


@pytest.mark.parametrize("name", ["two", "full trailers"])
def test_a_cut_while_going_back_leaves_one_of_the_two(name: str) -> None:
    """At every byte of the entry, and of the erase that makes room for it."""
    for cut in [*range(ENTRY_BYTES + 1), *range(0, SECTOR_BYTES + ENTRY_BYTES + 1, 61)]:
        emulator = with_flash(STARTS[name].image)
        emulator.core.cut_power_after(cut)
        try:
            connected(emulator).previous()
            said = True
        except LinkError:
            said = False
        emulator.core.restore_power()
        emulator.core.boot("brown-out")
        playing = table_crc(connected(emulator))
        assert playing in ({crc_of(OLDER)} if said else {crc_of(OLD), crc_of(OLDER)})


@pytest.mark.slow
def test_two_cuts_at_random_places_do_no_harm_either() -> None:
    rng = np.random.default_rng(11)
    for start in STARTS.values():
        for _ in range(12):
            emulator = with_flash(start.image)
            for _ in range(2):
                emulator.core.cut_power_after(int(rng.integers(0, 3 * SECTOR_BYTES)))
                _update(emulator)
                emulator.core.restore_power()
                emulator.core.boot("brown-out")
            check_after_cut(emulator, start, said=False)


def test_flash_that_lies_is_found_and_the_old_table_stays() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    emulator.core.let_flash_lie(True)
    with pytest.raises(LinkError, match="flash failed"):
        device.flash(NEW)
    emulator.core.let_flash_lie(False)
    assert table_crc(device) == crc_of(OLD)
    emulator.core.boot()
    assert table_crc(connected(emulator)) == crc_of(OLD)


def test_a_table_that_the_device_cannot_play_is_refused_and_the_old_one_plays_on() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    three = pack(make_table(np.ones((1, 3))))
    with pytest.raises(InputError, match="expected 5, the channels"):
        device.flash(three)
    # A host that does not look at what it sends gets the device's own answer.
    with pytest.raises(LinkError, match="another number of actuators") as caught:
        TableUpload(device.link, three).run()
    assert caught.value.status == Status.REFUSED
    assert table_crc(device) == crc_of(OLD)
    assert emulator.core.state == "idle"
    assert device.flash(forge(make_table(np.ones((1, 5))), ramp_us=1_000)).verified


def test_a_refused_table_never_costs_the_one_to_go_back_to() -> None:
    """Two tables, back, one for four actuators, back again: flash is as it was all along."""
    emulator = powered(OLD)
    device = connected(emulator)
    assert device.flash(NEW).verified
    device.previous()
    before = emulator.core.flash_bytes()
    four = pack(make_table(np.ones((1, 4))))
    damaged = NEW[:HEADER_BYTES].replace(b"CHLD", b"CHLE") + NEW[HEADER_BYTES:]
    version = bytes([*NEW[:4], 9, *NEW[5:]])
    for data in (four, damaged, version, forge(make_table(np.ones((1, 5))), ramp_us=1)):
        with pytest.raises(LinkError, match="the device refuses it: "):
            TableUpload(device.link, data).run()
        assert emulator.core.flash_bytes() == before
        assert emulator.core.state == "idle"
    device.previous()
    assert table_crc(device) == crc_of(NEW)


def test_what_is_there_already_is_not_written_again() -> None:
    """In the slot that plays nothing is; in the other one only the entry that makes it count."""
    emulator = powered(OLD)
    device = connected(emulator)
    assert device.flash(NEW).verified
    erased, slot = device.info()["erases"], device.info()["slot"]
    before = emulator.core.flash_bytes()
    assert device.flash(NEW).slot == slot
    assert emulator.core.flash_bytes() == before
    assert device.flash(OLD).slot == 1 - slot
    assert table_crc(device) == crc_of(OLD)
    assert device.info()["erases"] == erased


def test_an_older_table_in_use_is_said_and_plays() -> None:
    """Bits that flip in the newest table, or in its entry; a cut while it is entered is none."""
    emulator = powered(OLD)
    device = connected(emulator)
    assert device.flash(NEW).verified
    assert device.info()["standing"] == []
    whole = emulator.core.flash_bytes()
    slot = device.info()["slot"]
    for at in (slot * SLOT_BYTES + 1, slot * SLOT_BYTES + TRAILER_OFFSET + 5):
        rotten = bytearray(whole)
        assert rotten[at]
        rotten[at] ^= rotten[at] & -rotten[at]  # a bit that flips to 0, as flash allows
        device = connected(with_flash(bytes(rotten)))
        assert device.info()["standing"] == ["older table"]
        assert device.info()["state"] == "idle"
        assert table_crc(device) == crc_of(OLD)


def test_bits_that_flip_while_it_runs_are_found_within_a_minute() -> None:
    """The other table plays then; without one, none does."""
    for older in (OLD, None):
        emulator = powered(older) if older else with_flash(b"\xff" * PARTITION_BYTES)
        device = connected(emulator)
        assert device.flash(NEW).verified
        at = device.info()["slot"] * SLOT_BYTES + len(NEW) - 12
        value = emulator.core.flash_bytes()[at]
        emulator.core.program(at, bytes([value & (value - 1)]))
        emulator.run(61_000.0)
        info = connected(emulator).info()
        if older:
            assert (info["state"], info["standing"]) == ("idle", ["older table"])
            assert table_crc(connected(emulator)) == crc_of(OLD)
        else:
            assert info["state"] == "fault"
            assert info["standing"] == ["table refused"]


def test_a_change_of_frequency_looks_at_the_table_first() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    at = device.info()["slot"] * SLOT_BYTES + len(OLD) - 12
    value = emulator.core.flash_bytes()[at]
    emulator.core.program(at, bytes([value & (value - 1)]))
    with pytest.raises(LinkError, match="table is damaged"):
        device.select_frequency(160.0)
    emulator.run(100.0)
    assert device.info()["table_status"] == "table is damaged"
    assert device.info()["state"] == "fault"


def test_an_update_that_falls_silent_is_dropped() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    device.link.request("table_begin", NEW[:HEADER_BYTES], total=len(NEW), crc=1)
    assert emulator.core.state == "updating"
    emulator.run(6_000.0)
    assert emulator.core.state == "idle"
    for name, tail, fields in (("table_commit", b"", {}), ("table_data", b"x", {"offset": 0})):
        with pytest.raises(LinkError, match="under way"):
            device.link.request(name, tail, **fields)
    assert table_crc(device) == crc_of(OLD)


def test_trailers_that_are_full_begin_again() -> None:
    """340 entries a slot; the newest always plays, and there is always a way back."""
    emulator = with_flash(image({0: OLD, 1: OLDER}, FULL_TRAILERS[: 2 * (FULL - 2)]))
    device = connected(emulator)
    for k in range(8):
        table = (NEW, OLD)[k % 2]
        assert device.flash(table).verified
        emulator.core.boot()
        device = connected(emulator)
        assert table_crc(device) == crc_of(table)
    for table in (NEW, OLD, NEW):
        device.previous()
        emulator.core.boot()
        device = connected(emulator)
        assert table_crc(device) == crc_of(table)


def test_a_table_as_large_as_a_slot_arrives_and_a_larger_one_is_refused() -> None:
    """Its last bytes touch the trailer, which stays as it is."""
    columns = (TRAILER_OFFSET - 97) // 21
    emulator = powered(OLD)
    device = connected(emulator)
    large = pack(random_table(columns // 12, 12, 5, 3))
    assert TRAILER_OFFSET - 12 * 21 < len(large) <= TRAILER_OFFSET
    assert device.flash(large).verified
    emulator.core.boot()
    assert table_crc(connected(emulator)) == crc_of(large)
    with pytest.raises(LinkError) as caught:
        device.link.request("table_begin", NEW[:HEADER_BYTES], total=TRAILER_OFFSET + 1, crc=1)
    assert caught.value.status == Status.TOO_LARGE


def test_outputs_are_off_before_anything_is_erased() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    device.touch(0.0, 0.0)
    emulator.run(50.0)
    emulator.core.take_duties()
    device.link.request("table_begin", NEW[:HEADER_BYTES], total=len(NEW), crc=1)
    assert not emulator.core.take_duties()[-3000:].any()
