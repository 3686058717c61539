"""How well a table focuses as a device plays it: what the emulated pins make all over a board."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods import SEED, Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.scoring.kept_focus import click_20mm_db, click_um
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import (
    SAMPLES,
    Place,
    Score,
    active_lattice,
    border_places,
    score_drives,
)
from chladni.host.emulation.demodulate import made_drive, made_harmonic
from chladni.host.emulation.emulator import LEVEL, Emulator, TouchEvent
from chladni.host.emulation.settling import LEAST_WAVES, steady_play
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image import metrics
from chladni.tables.table import Table

ComplexArray = NDArray[np.complex128]

PITCH = 4e-3
"""m; places half-way between are looked at too."""
TOUCHED_MS = 1.0
"""When the finger comes."""


@dataclass(frozen=True)
class SecondHarmonic:
    """RMS in fingers' discs at twice the frequency, over that of the drive under its own finger.

    Attributes
    ----------
    own_db, other_20mm_db
        Under that finger, and the loudest from 20 mm on. Both dB, below 0 where it is softer.
    """

    own_db: Spread
    other_20mm_db: Spread


@dataclass(frozen=True)
class TableScore(Score):
    """What the pins make of a table's drives.

    Attributes
    ----------
    click_20mm_db, click_um
        Of drives that focus: the second finger from 20 mm on of a rested finger's click, and its
        peak under one that presses.
    objective
        What the drives are best at.
    bytes, bits, pitch_mm
        Of the table: its size, the width of its integers, and from one region to the next.
    second_harmonic
        What a flyback diode's bend leaves at twice the frequency, which no drive focuses; bridges
        have no diode.
    error_estimate
        Of the fields.
    """

    click_20mm_db: Spread | None
    click_um: Spread | None
    objective: str
    frequency_hz: float
    bytes: int
    bits: int
    pitch_mm: Place
    second_harmonic: SecondHarmonic
    error_estimate: float
    seconds: float


def score_table(
    table: Table,
    board: Board,
    *,
    size: int,
    pitch: float = PITCH,
    frequency_hz: float | None = None,
    samples: int = SAMPLES,
    border: bool = False,
    seed: int = SEED,
    progress: Progress | None = None,
) -> TableScore:
    """Play a table at places all over its board and look at the fields that the pins make.

    Parameters
    ----------
    size
        Bytes of the table.
    pitch
        Distance of places, m; those half-way between are added.
    frequency_hz
        Of the drives; those of the table's first section by default.
    samples
        Boards drawn within the tolerances; 0 leaves them out.
    border
        Whether places on the border of the active area are scored too.
    progress
        Called with (done, all) of the boards.
    """
    started = time.perf_counter()
    section = table.section(frequency_hz)
    lattice = active_lattice(board, pitch, halfway=True, samples=samples)
    solved = solved_board(board).at_frequency(section.frequency_hz)
    played = _played(table, board, lattice.places, frequency_hz)
    drives = [drive for drive, _ in played]
    rim = border_places(board, pitch) if border else []
    score = score_drives(
        solved,
        lattice,
        drives,
        samples=samples,
        seed=seed,
        border=(rim, played_drives(table, board, rim, frequency_hz=frequency_hz))
        if border
        else None,
        progress=progress,
    )
    focuses = section.objective == "focus"
    return TableScore(
        **vars(score),
        click_20mm_db=click_20mm_db(solved, lattice.places, drives) if focuses else None,
        click_um=click_um(solved, lattice.places, drives) if focuses else None,
        objective=section.objective,
        frequency_hz=section.frequency_hz,
        bytes=size,
        bits=table.bits,
        pitch_mm=table.grid.pitch_mm,
        second_harmonic=_second_harmonic(solved, lattice.places, played),
        error_estimate=solved.fields.error_estimate,
        seconds=time.perf_counter() - started,
    )


def played_drives(
    table: Table, board: Board, places: Sequence[Place], *, frequency_hz: float | None = None
) -> list[ComplexArray]:
    """The drives that the pins make at places (m), each complex128 of shape (actuators,).

    In units of gain, each with a common phase of its own. Every place is touched on a
    device that was just powered on, whose coils are cold.
    """
    return [drive for drive, _ in _played(table, board, places, frequency_hz)]


def _played(
    table: Table, board: Board, places: Sequence[Place], frequency_hz: float | None
) -> list[tuple[ComplexArray, ComplexArray]]:
    """Those drives, and their second harmonics."""
    section = table.section(frequency_hz)
    needed_ms = LEAST_WAVES / section.frequency_hz * 1e3
    found = []
    for x, y in places:
        emulator = Emulator(board, table, frequency_hz=frequency_hz)
        emulator.touch(TouchEvent(TOUCHED_MS, (x / MM, y / MM)))
        recording, play = steady_play(emulator, table, needed_ms)
        found.append(
            (
                made_drive(recording, play, section, board, level=LEVEL),
                made_harmonic(recording, play, section, board, level=LEVEL),
            )
        )
    return found


def _second_harmonic(
    solved: SolvedBoard,
    places: Sequence[Place],
    played: Sequence[tuple[ComplexArray, ComplexArray]],
) -> SecondHarmonic:
    board, fields = solved.board, solved.fields
    higher = solved.at_frequency(2.0 * fields.frequency_hz).fields
    discs = metrics.FingertipDiscs(board.x, board.y)
    rows = []
    for place, (drive, harmonic) in zip(places, played, strict=True):
        under = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
        own = np.abs(np.tensordot(drive, fields.values, axes=1)[under])
        field = np.tensordot(harmonic, higher.values, axes=1)
        share = metrics.decibel(float(np.mean(np.abs(field[under]) ** 2)) / float(np.mean(own**2)))
        apart = discs.second_finger_db(field, place, [20e-3])[0]
        rows.append((share, share - apart))
    own_db, second_db = zip(*rows, strict=True)
    return SecondHarmonic(Spread.of(own_db), Spread.of(second_db))
