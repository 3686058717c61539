"""A swipe through the emulated firmware: a score for every place that the panel reports."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.drives import score_field, solved_board
from chladni.host.emulation.closed_loop import run_loop
from chladni.host.emulation.demodulate import Play, phasors
from chladni.host.emulation.emulator import (
    Recording,
    TouchEvent,
    emulate,
    emulated_config,
    reported_um,
)
from chladni.host.emulation.touches import TouchScore, played_touches
from chladni.sim.board.board import Board
from chladni.sim.fields.transfer import target_field
from chladni.sim.image.energy import compose
from chladni.tables.report import TableReport
from chladni.tables.table import Limits, Table
from conftest import CommandLine

STEPS = 12
Built = tuple[Table, TableReport]


def swipe(first_ms: float = 20.0, every_ms: float = 10.0) -> list[TouchEvent]:
    places = zip(np.linspace(-20.0, 20.0, STEPS), np.linspace(-50.0, 50.0, STEPS), strict=True)
    return [TouchEvent(first_ms + every_ms * k, place) for k, place in enumerate(places)]


def lift(events: list[TouchEvent]) -> list[TouchEvent]:
    return [*events, TouchEvent(events[-1].at_ms + 10.0, None)]


def far_off(touch: TouchScore, table: Table, board: Board) -> float:
    """The played drive against the table's for the pixel, relative, common phase aside."""
    said = table.drive_at(table.section(), *reported_um(emulated_config(board), touch.target_mm))
    turn = np.vdot(touch.drive, said)
    return float(np.abs(touch.drive * turn / abs(turn) - said).max() / np.abs(said).max())


# The panel looks every 10 ms from power-on: at once, after 3 ms and after 9.9 ms of a new place.
@pytest.mark.parametrize("first_ms", [20.0, 27.0, 20.1])
def test_every_report_of_a_swipe_is_scored(
    coarse_board: Board, coarse_table: Built, first_ms: float
) -> None:
    """Each drive is the table's, within a thousandth, though it plays for 10 ms only."""
    events = swipe(first_ms)
    _, report = run_loop(coarse_table[0], coarse_board, lift(events), 250.0)
    assert [touch.at_ms for touch in report.touches] == [event.at_ms for event in events]
    assert [touch.target_mm for touch in report.touches] == [event.place_mm for event in events]
    for touch in report.touches:
        assert touch.settled > 0.999
        assert far_off(touch, coarse_table[0], coarse_board) < 1e-3
    assert report.ssim == report.touches[-1].card.ssim
    assert report.region == report.touches[-1].region


def test_a_touch_has_the_scorecard_of_its_drive(coarse_board: Board, coarse_table: Built) -> None:
    """By the way that scores a single field, with fields found one by one."""
    _, report = run_loop(coarse_table[0], coarse_board, lift(swipe()), 250.0)
    solved = solved_board(coarse_board)
    for touch in report.touches[::5]:
        wanted = target_field(coarse_board, touch.target_mm, model=solved.model).values[0]
        field = compose(solved.fields.values, touch.drive)
        card = score_field(solved, field, wanted, touch.target_mm, drive=touch.drive)
        assert touch.card.ssim == pytest.approx(card.ssim, abs=1e-6)
        assert touch.card.second_finger_db == pytest.approx(card.second_finger_db, abs=1e-6)
        assert touch.card.focal_error_mm == card.focal_error_mm
        assert touch.card.nulls.misplaced == pytest.approx(card.nulls.misplaced, abs=1e-6)
        assert touch.card.felt is not None
        assert card.felt is not None
        assert touch.card.felt.finger_um == pytest.approx(card.felt.finger_um, rel=1e-6)


def with_ramp(table: Table, milliseconds: float) -> Table:
    limits: Limits = replace(table.limits, ramp_us=round(1e3 * milliseconds))
    return replace(table, limits=limits)


def test_a_ramp_longer_than_a_report_never_settles(
    coarse_board: Board, coarse_table: Built
) -> None:
    """In 20 ms half of the way is done in one report: it lags, and says so."""
    slow = with_ramp(coarse_table[0], 20.0)
    _, report = run_loop(slow, coarse_board, swipe(), 250.0)
    settled = [touch.settled for touch in report.touches]
    assert len(settled) == STEPS
    assert max(settled[2:-1]) < 0.95
    assert settled[-1] > 0.999  # it stays there


def test_places_that_the_panel_never_saw_are_left_out(
    coarse_board: Board, coarse_table: Built
) -> None:
    """At 4 ms a place, one to three of them lie between two reports; the last one counts."""
    events = swipe(every_ms=4.0)
    _, report = run_loop(coarse_table[0], coarse_board, events, 150.0)
    seen = [max(e.at_ms for e in events if e.at_ms <= at) for at in (20.0, 30.0, 40.0, 50.0, 60.0)]
    assert [touch.at_ms for touch in report.touches] == [*seen, events[-1].at_ms]


def test_the_first_finger_plays_until_it_lifts(coarse_board: Board, coarse_table: Built) -> None:
    events = [
        TouchEvent(20.0, (0.0, 40.0), 0),
        TouchEvent(50.0, (5.0, -40.0), 1),
        TouchEvent(80.0, (2.0, 40.0), 0),
        TouchEvent(110.0, None, 0),
    ]
    _, report = run_loop(coarse_table[0], coarse_board, events, 180.0)
    assert [touch.target_mm for touch in report.touches] == [(0.0, 40.0), (2.0, 40.0), (5.0, -40.0)]
    assert min(touch.settled for touch in report.touches) > 0.999


def test_nothing_is_scored_after_the_longest_time(coarse_board: Board, coarse_table: Built) -> None:
    table = coarse_table[0]
    short = replace(table, limits=replace(table.limits, max_on_us=100_000))
    recording = emulate(coarse_board, short, swipe(), 200.0)
    found = played_touches(recording, short, short.section(), coarse_board, swipe())
    assert [touch.at_ms for touch in found if touch.play] == [20.0 + 10.0 * k for k in range(10)]


@pytest.mark.parametrize("waves", [0.5, 0.64, 1.0, 1.7, 8.0])
def test_a_sine_is_found_in_any_stretch(waves: float) -> None:
    """Known amplitudes and phases on a bias, rounded to steps of 2^-15: within 2e-4 of them."""
    carrier_hz, frequency_hz = 78125.0, 160.0
    count = int(waves / frequency_hz * carrier_hz)
    known = np.array([0.3, 0.05 * np.exp(1.1j), 0.2 * np.exp(-2.5j)])
    # The duty of a period is that of the synthesis sample, which four periods share.
    sample = np.arange(1000, 1000 + count) // 4 * 4
    turns = 2.0 * np.pi * frequency_hz * sample / carrier_hz
    duty = 0.45 + (np.exp(1j * turns)[:, None] * known).real
    steps = np.zeros((1000 + count, 3), np.int16)
    steps[1000:] = np.rint(duty * 32768.0)
    found = phasors(Recording(steps, carrier_hz, 15), Play(1000, 1000 + count), frequency_hz)
    # Of the window's end a whole sample may be missing.
    assert np.abs(found - known).max() < (2e-3 if waves < 1.0 else 2e-4)


def test_emulate_answers_with_every_touch(
    chladni: CommandLine, table_file: Path, tmp_path: Path
) -> None:
    places = [(0.0, -10.0 + 4.0 * k) for k in range(4)]
    touches = [
        word for k, (x, y) in enumerate(places) for word in ("--touch", f"{x},{y}@{20 + 10 * k}")
    ]
    answer = chladni(
        "emulate",
        table_file,
        *touches,
        "--lift",
        "60",
        "--ms",
        "80",
        "-o",
        tmp_path / "r.npz",
        "--json",
    )
    assert answer.code == 0
    found = answer.json["touches"]
    assert [touch["at_ms"] for touch in found] == [20.0, 30.0, 40.0, 50.0]
    assert [tuple(touch["target_mm"]) for touch in found] == places
    for touch in found:
        assert touch.keys() >= {
            "ssim", "focal_error_mm", "second_finger_db", "contrast_db", "finger_um", "settled",
            "spot_mm2", "sensation_db", "baselines",
        }  # fmt: skip
    assert found[-1]["ssim"] == answer.json["ssim"]
    assert found[-1]["finger_um"] == answer.json["finger_um"]
