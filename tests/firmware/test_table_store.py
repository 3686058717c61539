"""A new table arrives whole or not at all, wherever the power fails or flash rots."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.host.device.wires.link import LinkError
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.slot_store import (
    ENTRY_BYTES,
    PARTITION_BYTES,
    SECTOR_BYTES,
    SLOT_BYTES,
    TRAILER_OFFSET,
)
from firmware.table_partitions import (
    NEW,
    OLD,
    OLDER,
    STARTS,
    Start,
    connected,
    crc_of,
    table_crc,
    with_flash,
)
from made_up import powered


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
    return sorted(
        {*cuts, *range(erased, total + 1)}
        if total <= 2 * erased
        else {
            *cuts,
            *range(erased, erased + len(NEW) + 1),
            *(total - k for k in range(ENTRY_BYTES + 2)),
            *range(erased + len(NEW), total - ENTRY_BYTES, 293),
        }
    )


@pytest.mark.slow
def test_a_cut_at_many_bytes_leaves_the_old_table_or_the_new() -> None:
    """Of those below one in eleven, from every starting state."""
    assert cut_power_at_every(11) > 100


@pytest.mark.soak
@pytest.mark.slow
def test_a_cut_at_any_byte_leaves_the_old_table_or_the_new() -> None:
    """From every starting state; and the update can be done again afterwards."""
    assert cut_power_at_every(1) > 1_000


def cut_power_at_every(step: int) -> int:
    """Cut the power at so many of the interesting bytes of an update; how many those were."""
    tried = 0
    for start in STARTS.values():
        total = operations(start.image)
        for cut in interesting_cuts(total)[tried % step :: step]:
            emulator = with_flash(start.image)
            emulator.core.cut_power_after(cut)
            said = _update(emulator)
            check_after_cut(emulator, start, said)
            tried += 1
        # What is there already is not written again.
        written = 0 if NEW in start.image else SECTOR_BYTES + len(NEW)
        assert total >= written + (0 if start.playing == NEW else ENTRY_BYTES)
    print(f"{tried} cuts")
    return tried


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
