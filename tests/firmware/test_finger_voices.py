"""A device under several fingers: whose drive plays when, through what panels do to fingers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.drives.fingers.choice import chosen_drives
from chladni.drives.fingers.silence import drives_for
from chladni.host.emulation.demodulate import Play, phasors
from chladni.host.emulation.emulator import Emulator, Recording, TouchEvent
from chladni.tables.responses import TableResponses
from chladni.tables.table import Limits, ReckonedFinger, Table
from firmware.judged_device import BRIDGES
from made_up import device_of, make_section
from plate_of_bumps import FINGER, responses_table

HZ = (160.0, 213.0, 97.0, 270.0, 131.0)
PLACES = ((-18.0, 30.0), (17.0, -25.0), (-20.0, -30.0), (20.0, 32.0), (0.0, 0.0))
LIMITS = Limits(4000, 100_000, 20_000_000)
STEADY_MS = 400.0
Place = tuple[float, float]


@pytest.fixture(scope="module")
def table() -> Table:
    return responses_table(limits=LIMITS)


def board(table: Table, *, hz: Sequence[float] = HZ, **settings: Any) -> Emulator:
    """Slot k has a frequency of its own, so that the pins tell who plays."""
    emulator = Emulator(device_of(table, **settings), table, level=1.0)
    for finger, own in enumerate(hz):
        emulator.core.set_voice(finger, round(own * 1e3), 32767)
    return emulator


def lay(emulator: Emulator, at_ms: float, fingers: dict[int, Place | None]) -> None:
    for finger, place in fingers.items():
        emulator.touch(TouchEvent(at_ms, place, finger=finger))


def voices(recording: Recording, milliseconds: float = STEADY_MS) -> NDArray[np.complex128]:
    """What each frequency's wave has on the pins at the end, shape (slots, channels)."""
    count = len(recording.duty_steps)
    play = Play(max(0, count - int(milliseconds * 1e-3 * recording.carrier_hz)), count)
    return np.array([phasors(recording, play, hz) for hz in HZ])


def heard(recording: Recording, milliseconds: float = 150.0) -> list[int]:
    """Slots that play at the end: the others' are rounding, and leaks of the window."""
    found = np.abs(voices(recording, milliseconds)).max(axis=1)
    return [slot for slot, own in enumerate(found.tolist()) if own > 0.01]


def downs(emulator: Emulator) -> list[int]:
    return [slot for slot, touch in enumerate(emulator.core.touches()) if touch[0]]


def reported(emulator: Emulator) -> dict[int, Place]:
    """Where the device has its fingers, mm: a panel rounds to its pixels."""
    return {
        slot: (x / 1e3, y / 1e3)
        for slot, (is_down, x, y, *_) in enumerate(emulator.core.touches())
        if is_down
    }


def off(found: NDArray[np.complex128], wanted: NDArray[np.complex128]) -> float:
    """Of a drive whose scale and phase are left open, over its largest."""
    scale = np.vdot(found, wanted) / np.vdot(found, found)
    return float(np.abs(scale * found - wanted).max() / np.abs(wanted).max())


@pytest.mark.parametrize("settings", [{}, BRIDGES])
@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_pins_play_every_finger_the_drive_that_leaves_the_others_still(
    table: Table, count: int, settings: dict[str, Any]
) -> None:
    """Against the reference in Python, all voices at once."""
    emulator = board(table, **settings)
    lay(emulator, 20.0, dict(enumerate(PLACES[:count])))
    found = voices(emulator.run(600.0))[:count]
    places = [(x * 1e-3, y * 1e-3) for x, y in reported(emulator).values()]
    level = FINGER.full_force_un * 1e-6
    wanted = chosen_drives(
        TableResponses.of(table),
        places,
        thresholds=[FINGER.threshold_pm * 1e-12 / 4.0] * count,
        levels=[level] * count,
        stiffness=FINGER.stiffness,
    ).found.drives
    for own, drive in zip(found, wanted, strict=True):
        # A gain is rounded to steps of 1/512 of duty, and windows leak some of the other voices.
        assert off(own, drive) < 0.012
    assert heard(emulator.run(200.0)) == list(range(count))
    assert emulator.core.faults == []


def test_a_finger_that_only_rests_is_spared_and_silent(table: Table) -> None:
    emulator = board(table)
    emulator.core.set_voice(1, 0, 0)
    lay(emulator, 20.0, {0: PLACES[0], 1: PLACES[1]})
    recording = emulator.run(600.0)
    assert heard(recording) == [0]
    plate = TableResponses.of(table)
    places = [(x * 1e-3, y * 1e-3) for x, y in reported(emulator).values()]
    among, alone = (
        drives_for(plate, own, stiffness=FINGER.stiffness).drives[0] for own in (places, places[:1])
    )
    found = voices(recording)[0]
    assert off(found, among) < 0.012
    assert off(found, alone) > 0.1
    isolation, of_loudest = emulator.core.touches()[0][3:]
    assert isolation > 1600  # 40 dB, by what the table says of the plate
    assert 100 < of_loudest < 1000


def test_unknown_forces_and_thresholds_leave_lambda_alone() -> None:
    table = responses_table(limits=LIMITS, finger=replace(FINGER, full_force_un=0))
    emulator = board(table)
    lay(emulator, 20.0, {0: PLACES[0], 1: PLACES[1]})
    found = voices(emulator.run(600.0))[:2]
    places = [(x * 1e-3, y * 1e-3) for x, y in reported(emulator).values()]
    wanted = drives_for(TableResponses.of(table), places, stiffness=FINGER.stiffness).drives
    assert max(off(*pair) for pair in zip(found, wanted, strict=True)) < 0.012


def test_fingers_come_and_leave_in_any_order(table: Table) -> None:
    """Whoever stays goes on: no voice restarts, none stops."""
    emulator = board(table)
    lay(emulator, 20.0, {7: PLACES[0]})
    assert heard(emulator.run(300.0)) == [0]
    lay(emulator, 310.0, {3: PLACES[1]})
    lay(emulator, 330.0, {9: PLACES[2]})
    assert heard(emulator.run(300.0)) == [0, 1, 2]
    lay(emulator, 610.0, {7: None})
    assert heard(emulator.run(300.0)) == [1, 2]
    # A finger that leaves while another arrives.
    lay(emulator, 910.0, {3: None, 1: PLACES[3]})
    assert heard(emulator.run(300.0)) == [0, 2]
    lay(emulator, 1210.0, {9: None, 1: None})
    assert not emulator.run(300.0).duty_steps[-2000:].any()
    assert emulator.core.state == "idle"
    assert emulator.core.faults == []


def test_who_stays_is_not_interrupted(table: Table) -> None:
    """The amplitude of one voice never drops while another comes and goes."""
    emulator = board(table)
    lay(emulator, 20.0, {0: PLACES[0]})
    emulator.run(200.0)
    lay(emulator, 210.0, {1: PLACES[1]})
    lay(emulator, 350.0, {1: None})
    recording = emulator.run(300.0)
    step = int(25e-3 * recording.carrier_hz)  # four waves of 160 Hz
    edges = range(0, len(recording.duty_steps), step)
    sizes = [np.abs(phasors(recording, Play(a, b), HZ[0])).max() for a, b in pairwise(edges)]
    # Limits lower both voices while there are two: to 0.4 of it at the least.
    assert min(sizes) > 0.3 * max(sizes)


def test_swapped_and_changed_numbers_leave_every_finger_its_voice(table: Table) -> None:
    emulator = board(table)
    a, b = PLACES[:2]
    lay(emulator, 20.0, {0: a, 1: b})
    before = voices(emulator.run(400.0))
    lay(emulator, 410.0, {0: b, 1: a})
    lay(emulator, 430.0, {0: None, 1: None, 4: a, 2: b})
    after = voices(emulator.run(500.0))
    assert off(after[0], before[0]) < 0.01
    assert off(after[1], before[1]) < 0.01


def test_a_finger_that_moves_is_followed(table: Table) -> None:
    emulator = board(table)
    lay(emulator, 20.0, {0: PLACES[0], 1: PLACES[1]})
    emulator.run(100.0)
    for step in range(1, 41):
        y = PLACES[0][1] - 1.5 * step
        lay(emulator, 100.0 + 10.0 * step, {0: (PLACES[0][0], y)})
    recording = emulator.run(1000.0)
    places = [(x * 1e-3, y * 1e-3) for x, y in reported(emulator).values()]
    assert places[0][1] == pytest.approx(-0.030, abs=1e-4)
    wanted = drives_for(TableResponses.of(table), places, stiffness=FINGER.stiffness).drives
    assert max(off(*pair) for pair in zip(voices(recording)[:2], wanted, strict=True)) < 0.012
    assert downs(emulator) == [0, 1]


def test_six_fingers_play_five(table: Table) -> None:
    emulator = board(table)
    for finger, place in enumerate(PLACES):
        lay(emulator, 20.0 + 20.0 * finger, {finger: place})
    lay(emulator, 200.0, {5: (20.0, 0.0)})
    emulator.run(400.0)
    assert reported(emulator).keys() == set(range(5))
    assert (20.0, 0.0) not in [tuple(map(round, own)) for own in reported(emulator).values()]


def test_the_oldest_five_play_wherever_a_panel_lists_the_sixth(table: Table) -> None:
    """Some panels list more than five, and a newcomer before those that were there."""
    emulator = board(table)
    for number, place in enumerate(PLACES):
        lay(emulator, 20.0 + 20.0 * number, {number + 1: place})
    emulator.run(200.0)
    before = reported(emulator)
    emulator.core.panel_faults.most_listed = 10
    lay(emulator, 210.0, {0: (20.0, 0.0)})
    assert heard(emulator.run(300.0)) == [0, 1, 2, 3, 4]
    assert reported(emulator) == before


def test_a_sixth_finger_is_kept_still_wherever_it_moves(table: Table) -> None:
    """Against the reference, for which it is a finger that plays nothing."""
    emulator = board(table)
    emulator.core.panel_faults.most_listed = 10
    for number, place in enumerate(PLACES):
        lay(emulator, 20.0 + 20.0 * number, {number: place})
    emulator.run(200.0)
    level = FINGER.full_force_un * 1e-6
    for at, x in ((210.0, 20.0), (810.0, 10.0)):
        lay(emulator, at, {5: (x, 3.0)})
        found = voices(emulator.run(600.0))
        places = [*reported(emulator).values(), (x, 3.0)]
        wanted = chosen_drives(
            TableResponses.of(table),
            [(x * 1e-3, y * 1e-3) for x, y in places],
            thresholds=[FINGER.threshold_pm * 1e-12 / 4.0] * 6,
            levels=[level] * 5 + [0.0],
            stiffness=FINGER.stiffness,
        ).found.drives[:5]
        assert max(off(*pair) for pair in zip(found, wanted, strict=True)) < 0.012
    # And forgotten once it has left, and heard where another leaves.
    lay(emulator, 1410.0, {5: None})
    lay(emulator, 1430.0, {6: (20.0, 3.0)})
    lay(emulator, 1460.0, {2: None})
    assert heard(emulator.run(300.0)) == [0, 1, 2, 3, 4]
    assert reported(emulator)[2] == pytest.approx((20.0, 3.0), abs=0.1)


def test_a_palm_silences_all_until_it_has_gone(table: Table) -> None:
    emulator = board(table)
    lay(emulator, 20.0, {0: PLACES[0], 1: PLACES[1]})
    assert heard(emulator.run(300.0)) == [0, 1]
    emulator.core.panel_faults.is_palm = True
    assert not emulator.run(150.0).duty_steps[-2000:].any()
    emulator.core.panel_faults.is_palm = False
    assert heard(emulator.run(300.0)) == [0, 1]
    assert emulator.core.faults == []


def test_a_ghost_of_one_report_plays_nothing(table: Table) -> None:
    emulator = board(table, press_reports=3)
    lay(emulator, 20.0, {0: PLACES[0]})
    emulator.run(200.0)
    for at in (210.0, 290.0, 370.0):
        lay(emulator, at, {1: PLACES[1]})
        lay(emulator, at + 15.0, {1: None})
    assert heard(emulator.run(250.0)) == [0]
    assert downs(emulator) == [0]


def test_a_gap_in_reports_is_bridged_for_each_finger(table: Table) -> None:
    emulator = board(table, lift_hold_ms=60)
    lay(emulator, 20.0, {0: PLACES[0], 1: PLACES[1]})
    emulator.run(300.0)
    lay(emulator, 310.0, {1: None})
    lay(emulator, 340.0, {1: PLACES[1]})
    assert heard(emulator.run(40.0), 30.0)
    assert heard(emulator.run(300.0)) == [0, 1]
    lay(emulator, 650.0, {1: None})
    assert heard(emulator.run(300.0)) == [0]


def test_silence_of_the_panel_ends_all(table: Table) -> None:
    emulator = board(table)
    lay(emulator, 20.0, {0: PLACES[0], 1: PLACES[1]})
    assert heard(emulator.run(300.0)) == [0, 1]
    emulator.core.panel_faults.is_silent = True
    assert not emulator.run(200.0).duty_steps[-2000:].any()
    assert [cause for cause, *_ in emulator.core.faults] == ["touch timeout"]


def test_one_finger_plays_the_tables_drive_where_it_has_one(table: Table) -> None:
    """Off its branch of optima the loudest drive is another."""
    drives = np.tile([10.0, -5.0j, 0.0, 2.0, 0.0], (table.grid.count, 1))
    both = replace(table, sections=(make_section(drives),))
    emulator = board(both)
    lay(emulator, 20.0, {0: PLACES[0]})
    found = voices(emulator.run(500.0))[0]
    assert off(found, drives[0]) < 0.01
    lay(emulator, 510.0, {1: PLACES[1]})
    recording = emulator.run(500.0)
    assert heard(recording) == [0, 1]
    assert off(voices(recording)[0], drives[0]) > 0.1
    assert emulator.core.touches()[0][3] > 0
    lay(emulator, 1010.0, {1: None})
    assert off(voices(emulator.run(500.0))[0], drives[0]) < 0.01
    assert emulator.core.touches()[0][3:] == (0, 0)  # of drives that play no more


def test_both_together_keep_the_ceiling(table: Table) -> None:
    emulator = board(table, max_duty_q15=16384)
    lay(emulator, 20.0, dict(enumerate(PLACES)))
    duty = emulator.run(600.0).duty
    assert 0.4 < duty.max() <= 0.5
    assert duty.min() >= 0.0


@pytest.mark.parametrize("count", [2, 5])
def test_envelopes_are_each_fingers_own(table: Table, count: int) -> None:
    """A second finger's attack of 120 ms does not begin the first one's again."""
    emulator = board(table, attack_ms=120)
    lay(emulator, 20.0, {0: PLACES[0]})
    emulator.run(300.0)
    lay(emulator, 310.0, {finger: PLACES[finger] for finger in range(1, count)})
    recording = emulator.run(500.0)
    step = int(40e-3 * recording.carrier_hz)

    def size(slot: int, at_ms: float) -> float:
        begin = int(at_ms * 1e-3 * recording.carrier_hz)
        return float(np.abs(phasors(recording, Play(begin, begin + step), HZ[slot])).max())

    late = [size(slot, 400.0) for slot in range(count)]
    early = [size(slot, 50.0) for slot in range(count)]
    # Limits lower all voices alike as the others rise.
    assert early[0] > late[0]
    for slot in range(1, count):
        risen = early[slot] / early[0] * late[0] / late[slot]
        assert 0.3 < risen < 0.75  # at 50 to 90 ms, 20 to 60 of them after the report


def test_a_tables_finger_is_what_presses_it() -> None:
    """Where none presses, drives are for a free plate."""
    free = responses_table(limits=LIMITS, finger=ReckonedFinger())
    emulator = board(free)
    lay(emulator, 20.0, {0: PLACES[0], 1: PLACES[1]})
    found = voices(emulator.run(600.0))[:2]
    places = [(x * 1e-3, y * 1e-3) for x, y in reported(emulator).values()]
    wanted = drives_for(TableResponses.of(free), places).drives
    assert max(off(*pair) for pair in zip(found, wanted, strict=True)) < 0.012
