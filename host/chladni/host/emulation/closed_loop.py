"""The closed loop: what the emulated pins did, fed back through the plate and scored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import Problem, solved_board
from chladni.drives.scoring.scorecard import Scorecard, null_models, score_on
from chladni.host.emulation.demodulate import (
    Play,
    board_lost_steps,
    edge_sfdr_db,
    first_change,
    phasors,
    sfdr_db,
)
from chladni.host.emulation.emulator import (
    LEVEL,
    Emulator,
    Recording,
    TouchEvent,
    emulate,
    emulated_config,
    reported_um,
)
from chladni.host.emulation.touches import (
    SHORTEST_WAVES,
    SILENT,
    TouchScore,
    played_touches,
    played_um,
    playing_finger,
    score_touches,
)
from chladni.host.protocol.board_config import coil_gains
from chladni.sim.board.board import Board
from chladni.sim.coil.circuit import circuit_of
from chladni.sim.errors import ArgumentError, MissingArgumentError
from chladni.sim.fields.transfer import check_target, target_field
from chladni.sim.image import metrics
from chladni.sim.image.energy import compose
from chladni.tables.table import Table

ComplexArray = NDArray[np.complex128]
REPORTED_MS = 16.0
"""At most from a touch to its drive: a panel's report, and the solver's slices."""


@dataclass(frozen=True)
class ChannelReport:
    """One channel against its table entry; None where the entry is silent or was not measured."""

    gain_error_db: float | None
    phase_error_deg: float | None
    sfdr_db: float | None
    edge_sfdr_db: float | None


@dataclass(frozen=True)
class LoopReport:
    """Emulated touches, scored.

    Attributes
    ----------
    latency_ms
        From the first touch to the first changed duty on a pin.
    reported_ms
        Of that, until the panel reports the touch: long if the panel was just powered on.
    channels
        Of the last touch, as settled as it is (`touches[-1].settled`).
    region, target_mm
        Of the last touch: the region it lies in, and its place.
    ssim
        Energy image of the PWM's field against that of a unit load at `target_mm`.
    ssim_table
        The same for the drive that the table gives for the place as the panel reports it, without
        the firmware.
    promised
        That drive, shape (actuators,).
    played
        The drive that the pins made, shape (actuators,).
    field, target_field
        Complex displacement of the PWM's drive and of the unit load, shape (nx, ny).
    touches
        Scores of all touches that the panel reported, in the order of time.
    """

    latency_ms: float
    reported_ms: float
    channels: list[ChannelReport]
    region: int
    target_mm: tuple[float, float]
    ssim: float
    ssim_table: float
    promised: ComplexArray
    played: ComplexArray
    field: ComplexArray
    target_field: ComplexArray
    touches: list[TouchScore]


def run_loop(
    table: Table,
    board: Board,
    touches: Sequence[TouchEvent],
    milliseconds: float,
    *,
    level: float = LEVEL,
    frequency_hz: float | None = None,
) -> tuple[Recording, LoopReport]:
    """Play touches on the emulated board and score what the pins make of each.

    Parameters
    ----------
    touches
        Places and lifts in any order; a swipe has a place for every report of the panel.
    milliseconds
        How long to run, from power-on.
    level
        Share of full amplitude.
    frequency_hz
        Of the table's drives; those of its first section by default.

    Raises
    ------
    InputError
        A touch off the board or after the end, or a last touch that is too short to be measured.
    """
    _check_events(board, touches, milliseconds)
    events = sorted(touches, key=lambda event: event.at_ms)
    section = table.section(frequency_hz)
    recording = emulate(board, table, events, milliseconds, level=level, frequency_hz=frequency_hz)
    first_ms, last_ms = _first_and_last(events)
    changed = first_change(recording, int(first_ms * 1e-3 * recording.carrier_hz))
    solved = solved_board(board).at_frequency(section.frequency_hz)
    played = played_touches(recording, table, section, board, events)
    scores = score_touches(recording, table, section, solved, played, level=level)
    if changed is None or not scores or scores[-1].at_ms != last_ms:
        needed = SHORTEST_WAVES / section.frequency_hz * 1e3
        expected = f"a last touch that the panel reports and that then plays {needed:.1f} ms"
        raise ArgumentError("touches, milliseconds", f"{last_ms:g}, {milliseconds:g} ms", expected)
    last = scores[-1]
    # A panel says which of its pixels was touched, and that is all a device knows.
    promised = table.drive_at(section, *reported_um(emulated_config(board), last.target_mm))
    wanted = target_field(board, last.target_mm, model=solved.model, allow_unmet=True).values[0]
    play = last.play
    lost = board_lost_steps(board)
    purity = [
        measure(recording, play, section.frequency_hz, lost_steps=lost)
        for measure in (sfdr_db, edge_sfdr_db)
    ]
    return recording, LoopReport(
        latency_ms=changed / recording.carrier_hz * 1e3 - first_ms,
        reported_ms=_reported_ms(recording, first_ms),
        channels=_channels(last.drive, promised, section.full_scale_gain, purity),
        region=last.region,
        target_mm=last.target_mm,
        ssim=last.card.ssim,
        ssim_table=metrics.ssim(np.abs(compose(solved.fields.values, promised)), np.abs(wanted)),
        promised=promised,
        played=last.drive,
        field=compose(solved.fields.values, last.drive),
        target_field=wanted,
        touches=scores,
    )


@dataclass(frozen=True)
class AloneReport:
    """The last touch of one finger by a table of responses alone, of which a device makes drives.

    Attributes
    ----------
    latency_ms
        From the first touch to the first changed duty on a pin.
    reported_ms
        Of that, until the panel reports the touch.
    target_mm
        Of the last touch.
    drive
        That the pins made, shape (actuators,), in units of a duty of 1.
    card
        Of its field.
    played_um
        As of `TouchScore`.
    """

    latency_ms: float
    reported_ms: float
    target_mm: tuple[float, float]
    drive: ComplexArray
    card: Scorecard
    played_um: float | None


def run_alone(
    table: Table,
    board: Board,
    touches: Sequence[TouchEvent],
    milliseconds: float,
    *,
    level: float = LEVEL,
) -> tuple[Recording, AloneReport]:
    """As `run_loop` for a table without drives, in which no promise stands to be compared with.

    Raises
    ------
    InputError
        As of `run_loop`.
    """
    _check_events(board, touches, milliseconds)
    emulator = Emulator(board, table, level=level)
    for touch in touches:
        emulator.touch(touch)
    recording = emulator.run(milliseconds)
    first_ms, last_ms = _first_and_last(touches)
    changed = first_change(recording, int(first_ms * 1e-3 * recording.carrier_hz))
    hz = table.responses[0].frequency_hz
    ramp_ms, wave_ms = table.limits.ramp_us / 1e3, SHORTEST_WAVES / hz * 1e3
    # A panel that was just powered on may see its first finger late.
    begun_ms = 0.0 if changed is None else changed / recording.carrier_hz * 1e3
    settled_ms = max(last_ms + REPORTED_MS, begun_ms) + ramp_ms
    if changed is None or settled_ms + wave_ms > milliseconds:
        expected = f"a last touch that then plays {REPORTED_MS + ramp_ms + wave_ms:.1f} ms"
        raise ArgumentError("touches, milliseconds", f"{last_ms:g}, {milliseconds:g} ms", expected)
    play = Play(round(settled_ms * 1e-3 * recording.carrier_hz), len(recording.duty_steps))
    drive = phasors(recording, play, hz, circuit_of(board)) / np.array(coil_gains(board))
    place_mm = [own for _, own in playing_finger(touches) if own is not None][-1]
    solved = solved_board(board).at_frequency(hz)
    wanted = target_field(board, place_mm, model=solved.model, allow_unmet=True).values[0]
    problem = Problem(solved, place_mm, wanted)
    field = compose(solved.fields.values, drive)
    card = score_on(problem, field, null_models(problem), drive=drive)
    latency_ms = changed / recording.carrier_hz * 1e3 - first_ms
    reported_ms = _reported_ms(recording, first_ms)
    drive = np.asarray(drive)
    moved_um = played_um(card, board, drive, hz)
    return recording, AloneReport(latency_ms, reported_ms, place_mm, drive, card, moved_um)


def _reported_ms(recording: Recording, first_ms: float) -> float:
    """From a touch to the panel's next report."""
    reports = np.array(recording.panel_reports) / recording.carrier_hz * 1e3
    return float(reports[reports >= first_ms][0]) - first_ms


def _check_events(board: Board, events: Sequence[TouchEvent], milliseconds: float) -> None:
    if not 0.0 < milliseconds <= 600_000.0:
        raise ArgumentError("milliseconds", milliseconds, "a time from 0 to 600000 ms")
    if all(event.place_mm is None for event in events):
        raise MissingArgumentError("touches", "at least one place and its time")
    for number, event in enumerate(events):
        name = f"touches[{number}]"
        if not 0.0 <= event.at_ms < milliseconds:
            expected = f"a time from 0 to {milliseconds:g} ms"
            raise ArgumentError(name, f"@{event.at_ms:g}", expected)
        if event.place_mm is not None:
            check_target(board, event.place_mm, name)


def _first_and_last(events: Sequence[TouchEvent]) -> tuple[float, float]:
    """When the finger that plays comes, and when it is put to its last place, ms."""
    times = [at_ms for at_ms, place in playing_finger(events) if place is not None]
    return times[0], times[-1]


def _channels(
    played: ComplexArray,
    promised: ComplexArray,
    full_scale: float,
    purity: list[list[float | None]],
) -> list[ChannelReport]:
    """Errors of each channel, the common phase taken out (it is free)."""
    common = np.angle(np.vdot(promised, played))
    reports = []
    turned = played * np.exp(-1j * common)
    for own, entry, sfdr, edge in zip(turned, promised, *purity, strict=True):
        if abs(entry) < SILENT * full_scale or own == 0.0:
            reports.append(ChannelReport(None, None, None, None))
            continue
        ratio = own / entry
        reports.append(
            ChannelReport(
                float(20.0 * np.log10(abs(ratio))), float(np.degrees(np.angle(ratio))), sfdr, edge
            )
        )
    return reports
