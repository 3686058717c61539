"""A new table arrives whole or not at all, wherever the power fails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from chladni.host.device import Device
from chladni.host.emulator import Emulator
from chladni.host.flash_layout import (
    ENTRY_BYTES,
    JOURNAL_OFFSET,
    PARTITION_BYTES,
    SECTOR_BYTES,
    SLOT_BYTES,
)  # fmt: skip
from chladni.host.link import LinkError
from chladni.host.link_protocol import Status
from chladni.host.partition import entry_bytes
from chladni.host.wire import EmulatorWire
from chladni.tables.format import pack
from made_up import device_of, forge, make_table, powered

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
    """A partition with tables in slots, and journal entries."""
    data = bytearray(b"\xff" * PARTITION_BYTES)
    for slot, table in slots.items():
        data[slot * SLOT_BYTES : slot * SLOT_BYTES + len(table)] = table
    for k, (sequence, slot, table) in enumerate(entries):
        at = JOURNAL_OFFSET + k * ENTRY_BYTES
        data[at : at + ENTRY_BYTES] = entry_bytes(sequence, slot, crc_of(table))
    return bytes(data)


def damaged(table: bytes) -> bytes:
    return table[:90] + bytes([table[90] ^ 1]) + table[91:]


FULL_JOURNAL = [(k + 1, k % 2, OLD if k % 2 == 0 else OLDER) for k in range(255)] + [(256, 0, OLD)]


@dataclass(frozen=True)
class Start:
    """A partition, and the table that plays from it."""

    image: bytes
    playing: bytes | None


BOTH = [(1, 0, OLDER), (2, 1, OLD)]
REVERSED = [(1, 0, OLD), (2, 1, OLDER)]
ONE = image({0: OLD}, [(1, 0, OLD)])
TORN = JOURNAL_OFFSET + ENTRY_BYTES
STARTS = {
    "no table": Start(image({}, []), None),
    "one, by the ROM's loader": Start(image({0: OLD}, []), OLD),
    "one, in the second slot": Start(image({1: OLD}, [(4, 1, OLD)]), OLD),
    "two": Start(image({0: OLDER, 1: OLD}, BOTH), OLD),
    "two, the newer corrupt": Start(image({0: OLD, 1: damaged(OLDER)}, REVERSED), OLD),
    "two, the older corrupt": Start(image({0: damaged(OLDER), 1: OLD}, BOTH), OLD),
    "a torn entry": Start(ONE[:TORN] + b"\x02\x00" + ONE[TORN + 2 :], OLD),
    "a full journal": Start(image({0: OLD, 1: OLDER}, FULL_JOURNAL), OLD),
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
        assert total >= SECTOR_BYTES + len(NEW) + ENTRY_BYTES
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
    for data in (three, forge(make_table(np.ones((1, 5))), ramp_us=1_000)):
        if data is not three:
            assert device.flash(data).verified
            continue
        with pytest.raises(LinkError, match="refuses") as caught:
            device.flash(data)
        assert caught.value.status == Status.REFUSED
        assert table_crc(device) == crc_of(OLD)
        assert emulator.core.state == "idle"


def test_an_update_that_falls_silent_is_dropped() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    device.link.request("table_begin", total=1000, crc=1)
    assert emulator.core.state == "updating"
    emulator.run(6_000.0)
    assert emulator.core.state == "idle"
    for name, tail, fields in (("table_commit", b"", {}), ("table_data", b"x", {"offset": 0})):
        with pytest.raises(LinkError, match="under way"):
            device.link.request(name, tail, **fields)
    assert table_crc(device) == crc_of(OLD)


def test_a_thousand_updates_wear_the_journal_evenly() -> None:
    """One sector a slot and update, one of the journal every 256; the newest always plays."""
    emulator = powered(OLD)
    device = connected(emulator)
    for k in range(600):
        table = (NEW, OLD)[k % 2]
        assert device.flash(table).verified
    emulator.core.boot()
    assert table_crc(connected(emulator)) == crc_of(OLD)


def test_outputs_are_off_before_anything_is_erased() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    device.touch(0.0, 0.0)
    emulator.run(50.0)
    emulator.core.take_duties()
    device.link.request("table_begin", total=1000, crc=1)
    assert not emulator.core.take_duties()[-3000:].any()
