"""The closed loop: what the emulated pins did, fed back through the plate and scored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import solved_board
from chladni.host.emulation.demodulate import (
    Play,
    drive_phasors,
    edge_sfdr_db,
    first_change,
    sfdr_db,
)
from chladni.host.emulation.emulator import (
    LEVEL,
    Recording,
    TouchEvent,
    emulate,
    emulated_config,
    reported_um,
)
from chladni.host.protocol.config import coil_gains
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board, shipped_boards
from chladni.sim.errors import InputError, MissingError
from chladni.sim.fields.transfer import check_target, target_field
from chladni.sim.image import metrics
from chladni.sim.image.energy import compose
from chladni.tables.table import Section, Table

ComplexArray = NDArray[np.complex128]

PANEL_MS = 12.0
"""One report of the panel and one turn of the main loop."""
SETTLE_MS = 2.0
"""After a ramp, until the error feedback has forgotten it."""
LEAST_WAVES = 8
"""A phasor is measured over this many waves at least."""
SILENT = 1e-4
"""A gain below this share of full scale is silence: there is no ratio to report."""


@dataclass(frozen=True)
class ChannelReport:
    """One channel against its table entry; None where the entry is silent or was not measured."""

    gain_error_db: float | None
    phase_error_deg: float | None
    sfdr_db: float | None
    edge_sfdr_db: float | None


@dataclass(frozen=True)
class LoopReport:
    """An emulated touch, scored.

    Attributes
    ----------
    latency_ms
        From the first touch to the first changed duty on a pin.
    channels
        Of the last touch, once settled.
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
    """

    latency_ms: float
    channels: list[ChannelReport]
    region: int
    target_mm: tuple[float, float]
    ssim: float
    ssim_table: float
    promised: ComplexArray
    played: ComplexArray
    field: ComplexArray
    target_field: ComplexArray


def board_of(table: Table, board: str | None, *, file: str) -> Board:
    """The board a table was made for: the one named, or a shipped one of the table's name.

    Raises
    ------
    InputError
        No such board, or the table was made for another.
    """
    if board is None and table.board_name not in shipped_boards():
        raise MissingError("--board", f"{table.board_name!r} is not a shipped board")
    found = load_board(board or table.board_name)
    if len(found.actuators) != table.actuators:
        expected = f"{len(found.actuators)}, the actuators of board {found.name!r}"
        raise InputError("actuators", table.actuators, expected, file=file)
    if found.fingerprint() != table.board_fingerprint:
        expected = f"{found.fingerprint():#018x}, that of board {found.name!r}"
        raise InputError(
            "board_fingerprint", f"{table.board_fingerprint:#018x}", expected, file=file
        )
    return found


def run_loop(
    table: Table, board: Board, touches: Sequence[TouchEvent], milliseconds: float, *,
    level: float = LEVEL, frequency_hz: float | None = None,
) -> tuple[Recording, LoopReport]:  # fmt: skip
    """Play touches on the emulated board and score the last one.

    Raises
    ------
    InputError
        A touch off the board or after the end, or too short a run to measure anything.
    """
    events = sorted(touches, key=lambda event: event.at_ms)
    places = [event for event in events if event.place_mm is not None]
    _check_events(board, events, places, milliseconds)
    section = table.section(frequency_hz)
    recording = emulate(board, table, events, milliseconds, level=level, frequency_hz=frequency_hz)
    changed = first_change(recording, int(places[0].at_ms * 1e-3 * recording.carrier_hz))
    if changed is None:
        raise InputError("--ms", milliseconds, "a run long enough for a duty to change")
    play = _steady_play(recording, table, section, events, places[-1])
    last = places[-1].place_mm
    assert last is not None
    # A panel says which of its pixels was touched; the device knows no better.
    x_um, y_um = reported_um(emulated_config(board), last)
    promised = table.drive_at(section, x_um, y_um)
    phasors = drive_phasors(recording, play, section.frequency_hz, level=level)
    # The device makes up for polarity and trim, which the coils themselves then undo.
    played = section.full_scale_gain * phasors / np.array(coil_gains(board))
    solved = solved_board(board).at_frequency(section.frequency_hz)
    fields = solved.fields.values
    wanted = target_field(solved.board, last, model=solved.model, allow_unmet=True).values[0]
    field = compose(fields, played)
    purity = [measure(recording, play, section.frequency_hz) for measure in (sfdr_db, edge_sfdr_db)]
    return recording, LoopReport(
        latency_ms=changed / recording.carrier_hz * 1e3 - places[0].at_ms,
        channels=_channels(played, promised, section.full_scale_gain, purity),
        region=table.grid.region_at(x_um, y_um),
        target_mm=last,
        ssim=metrics.ssim(np.abs(field), np.abs(wanted)),
        ssim_table=metrics.ssim(np.abs(compose(fields, promised)), np.abs(wanted)),
        promised=promised,
        played=played,
        field=field,
        target_field=wanted,
    )


def _check_events(
    board: Board, events: list[TouchEvent], places: list[TouchEvent], milliseconds: float
) -> None:
    if not 0.0 < milliseconds <= 600_000.0:
        raise InputError("--ms", milliseconds, "a time from 0 to 600000 ms")
    if not places:
        raise MissingError("--touch", "at least one touch X,Y@MS")
    for event in events:
        option = "--lift" if event.place_mm is None else "--touch"
        if not 0.0 <= event.at_ms < milliseconds:
            raise InputError(option, f"@{event.at_ms:g}", f"a time from 0 to {milliseconds:g} ms")
        if event.place_mm is not None:
            check_target(board, event.place_mm)


def settled_ms(table: Table, touch: TouchEvent) -> float:
    """When a touch plays steadily: after its report and the ramp."""
    return touch.at_ms + PANEL_MS + table.limits.ramp_us / 1e3 + SETTLE_MS


def _steady_play(
    recording: Recording, table: Table, section: Section, events: list[TouchEvent], last: TouchEvent
) -> Play:
    """The settled stretch of the last touch: from after its ramp to its lift or the end."""
    begin_ms = settled_ms(table, last)
    lifts = [e.at_ms for e in events if e.place_mm is None]
    after = [at for at in lifts if at >= last.at_ms]
    # The on-time counts from the first contact since the finger was last lifted.
    before = max([at for at in lifts if at < last.at_ms], default=-1.0)
    contact_ms = min(e.at_ms for e in events if e.place_mm is not None and e.at_ms > before)
    longest_ms = contact_ms + table.limits.max_on_us / 1e3
    total_ms = recording.duty_steps.shape[0] / recording.carrier_hz * 1e3
    end_ms = min([total_ms, longest_ms, *after])
    needed = LEAST_WAVES / section.frequency_hz * 1e3
    if end_ms - begin_ms < needed:
        what = f"a last touch that plays {begin_ms + needed - last.at_ms:.0f} ms at least"
        limit = "the table's max_on" if end_ms == longest_ms else "its lift or the end of the run"
        raise InputError("--touch, --lift, --ms", f"{end_ms - last.at_ms:.0f} ms to {limit}", what)
    return Play(
        int(begin_ms * 1e-3 * recording.carrier_hz), int(end_ms * 1e-3 * recording.carrier_hz)
    )


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
