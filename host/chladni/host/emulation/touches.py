"""The touches of a recording: which of them the panel reported, what then played, and how well.

A panel reports every 10 ms or so, and a swipe brings another place with every report. A drive then
plays from one report to the next: for the length of the table's ramp it comes in, and what is left
is the drive as it is to be, for 6 ms or one wave of 160 Hz.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.scorecard import Scorecard, misplaced_target, null_models, score_on
from chladni.host.emulation.demodulate import Play, full_duty, made_drive
from chladni.host.emulation.emulator import Recording, TouchEvent, emulated_config, reported_um
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import NOT_WIRED
from chladni.sim.coil.full_drive import newtons_of
from chladni.sim.image.energy import compose
from chladni.tables.table import Section, Table

ComplexArray = NDArray[np.complex128]
Place = tuple[float, float]

HEARD_MS = 1.0
"""From a report to the first sample of its drive: bus, main loop and interrupt take half of it."""
SHORTEST_WAVES = 0.5
"""Below this a sine and a slope look alike."""
SILENT = 1e-4
"""A gain below this share of full scale is silence: there is no ratio to report."""


@dataclass(frozen=True)
class PlayedTouch:
    """A place that the panel reported.

    Attributes
    ----------
    at_ms, place_mm
        Of the finger, as it was asked for.
    begin_ms, end_ms
        From the report's drive to the next one, to the lift's report or to the end.
    play
        What is measured of that: what lies behind the ramp, or all if that is too short; None if
        all of it is.
    """

    at_ms: float
    place_mm: Place
    begin_ms: float
    end_ms: float
    play: Play | None


@dataclass(frozen=True)
class TouchScore:
    """What the pins made of one touch.

    Attributes
    ----------
    at_ms, target_mm
        Of the finger, as it was asked for.
    region
        In which the panel reported it.
    play
        The stretch of the recording of which this is the score.
    settled
        How far the drive has become the table's for the place: 1 less the relative difference of
        the two, scale and common phase aside. Above 0.98 it has; less while a ramp that is as long
        as a report still goes over from the drive before.
    drive
        What the pins made, complex128, shape (actuators,), in units of gain.
    card
        The scorecard of the field of that drive.
    played_um
        What the finger gets in the recording, peak, µm; None on a board without a coil. The card
        has it with the loudest coil at its limit.
    """

    at_ms: float
    target_mm: Place
    region: int
    play: Play
    settled: float
    drive: ComplexArray
    card: Scorecard
    played_um: float | None


def played_touches(
    recording: Recording, table: Table, section: Section, board: Board, events: Sequence[TouchEvent]
) -> list[PlayedTouch]:
    """Touches that the panel reported, in the order of time.

    A place that the next one replaced before the panel looked is left out, and so is what comes
    after the table's longest time.

    Parameters
    ----------
    events
        All that was played to the recording, ordered by time.
    """
    per_ms = recording.carrier_hz / 1e3
    reports_us = [int(period * 1e3 / per_ms) for period in recording.panel_reports]
    # What the panel saw last before each report is what it reports.
    seen: dict[int, tuple[float, Place | None]] = {}
    for at_ms, place in playing_finger(events):
        report = bisect_left(reports_us, round(at_ms * 1e3))
        if report < len(reports_us):
            seen[report] = (at_ms, place)
    begins = [reports_us[report] / 1e3 for report in seen]
    total_ms = recording.duty_steps.shape[0] / per_ms
    delay_ms = heard_ms(board)
    ramp_ms, needed_ms = table.limits.ramp_us / 1e3, SHORTEST_WAVES / section.frequency_hz * 1e3
    found, contact_ms = [], None
    ends = [*begins[1:], total_ms]
    for (at_ms, place), begin, end in zip(seen.values(), begins, ends, strict=True):
        if place is None:
            contact_ms = None
            continue
        contact_ms = at_ms if contact_ms is None else contact_ms
        first, last = begin + delay_ms, min(end, contact_ms + table.limits.max_on_us / 1e3)
        behind = first + ramp_ms if last - first - ramp_ms >= needed_ms else first
        play = Play(int(behind * per_ms), int(last * per_ms))
        is_long = last - behind >= needed_ms
        found.append(PlayedTouch(at_ms, place, first, last, play if is_long else None))
    return found


def heard_ms(board: Board) -> float:
    """From a panel's report to its drive; a panel without an interrupt line is asked for it."""
    config = emulated_config(board)
    return HEARD_MS + (config["report_ms"] / 4.0 if config["interrupt_pin"] == NOT_WIRED else 0.0)


def playing_finger(events: Sequence[TouchEvent]) -> Iterator[tuple[float, Place | None]]:
    """Times and places of the finger that plays, None where it lifts: the first down, until then.

    Parameters
    ----------
    events
        Ordered by time.
    """
    down: dict[int, Place] = {}
    for event in events:
        own = next(iter(down), event.finger)
        if event.place_mm is None:
            down.pop(event.finger, None)
        else:
            down[event.finger] = event.place_mm
        if own == event.finger:
            yield event.at_ms, next(iter(down.values()), None)


def score_touches(
    recording: Recording,
    table: Table,
    section: Section,
    solved: SolvedBoard,
    touches: Sequence[PlayedTouch],
    *,
    level: float,
) -> list[TouchScore]:
    """The score of every touch that can be measured and is no silence.

    Parameters
    ----------
    solved
        At the section's frequency.
    touches
        As `played_touches` found them.
    """
    board, config = solved.board, emulated_config(solved.board)
    full = level * full_duty(board, recording) / section.full_scale_gain
    kept = []
    for touch in touches:
        if touch.play is None:
            continue
        drive = made_drive(recording, touch.play, section, board, level=level)
        if np.abs(drive).max() > SILENT * section.full_scale_gain:
            kept.append((touch, touch.play, drive))
    places = [touch.place_mm for touch, _, _ in kept]
    # Both fields of every target are found some at a time, which takes a third of one by one.
    problems = solved.problems(places, with_finger=True)
    elsewhere = solved.problems([misplaced_target(board, place) for place in places])
    scores = []
    with one_blas_thread():
        for (touch, play, drive), problem, wrong in zip(kept, problems, elsewhere, strict=True):
            pixel = reported_um(config, touch.place_mm)
            nulls = null_models(problem, misplaced=wrong.wanted)
            card = score_on(problem, compose(problem.transfer, drive), nulls, drive=drive)
            scores.append(
                TouchScore(
                    at_ms=touch.at_ms,
                    target_mm=touch.place_mm,
                    region=table.grid.region_at(*pixel),
                    play=play,
                    settled=_settled(drive, table.drive_at(section, *pixel)),
                    drive=drive,
                    card=card,
                    played_um=played_um(card, board, full * drive, section.frequency_hz),
                )
            )
    return scores


def played_um(
    card: Scorecard, board: Board, duties: ComplexArray, frequency_hz: float
) -> float | None:
    """What a finger gets of a recording, peak, µm; None on a board without a coil.

    Parameters
    ----------
    duties
        Of the sine that each coil is asked for, as its current has it, (actuators,).
    """
    if board.coil is None or card.felt is None:
        return None
    duty = float(np.abs(duties).max())
    return newtons_of(board, duty, frequency_hz) * card.felt.um_per_newton


def _settled(played: ComplexArray, promised: ComplexArray) -> float:
    """1 − min |z·played − promised| / |promised| over complex z: 1 − √(1 − c²), c the cosine."""
    sizes = float(np.linalg.norm(played) * np.linalg.norm(promised))
    cosine = abs(np.vdot(played, promised)) / sizes if sizes > 0.0 else 0.0
    return float(1.0 - np.sqrt(max(0.0, 1.0 - cosine**2)))
