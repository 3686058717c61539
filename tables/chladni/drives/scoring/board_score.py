"""How well a board focuses: its best drives at places all over it, as drawn and as it comes out.

Fingertips side by side are 16 to 20 mm apart, so the second finger is looked for at several
distances.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods import SEED, Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.scoring.best_drives import best_drives, table_drives
from chladni.drives.scoring.kept_focus import KeptFocus, click_20mm_db, click_um, on_foam_twice
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import (
    SAMPLES,
    Score,
    active_lattice,
    border_places,
    score_drives,
)
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.image import metrics

ComplexArray = NDArray[np.complex128]
Place = tuple[float, float]

CLOSE = 12e-3
"""m between coils that focus, about a fingertip (docs/focus.md)."""
PITCH = 6e-3
"""m; half a fingertip."""
FEW_PLACES = 100
"""Of fewer, one in ten is hardly known: nine on the middle line of a strip said 1 dB more than its
table keeps, and 36 on a pad of nine coils, of which symmetry leaves nine, 1.5 dB less. Half as far
apart they agree within 0.5 dB."""


@dataclass(frozen=True)
class BoardScore(Score):
    """What a board is worth with the best drive at every place.

    Attributes
    ----------
    compensated
        Whether drives make up for a finger's load, as those of tables do where it takes much.
    click_20mm_db, click_um
        The second finger from 20 mm on of a click, of a finger that has rested, and its peak under
        one that presses.
    foam_twice
        What the same drives leave on foam twice as stiff; all None if they were not asked for.
    contrast_limit_db
        The most contrast that any drive can have, over the places.
    foam_length_mm
        (4D/k)^¼ of what the plate lies on, by which fields decay; None without a foundation.
    half_wavelength_mm
        Of the endless plate; on foam below its cut-off no wave travels, and it is None.
    coil_spacing_mm
        Median distance of a coil to its nearest neighbour; None for a single one.
    room_for
        How many coils would cover the board about 12 mm apart, as a focus takes.
    error_estimate
        Of the fields.
    """

    objective: str
    compensated: bool
    click_20mm_db: Spread | None
    click_um: Spread | None
    foam_twice: KeptFocus | None
    contrast_limit_db: Spread
    foam_length_mm: float | None
    half_wavelength_mm: float | None
    coil_spacing_mm: float | None
    room_for: int
    error_estimate: float
    seconds: float


def usual_pitch(board: Board) -> float:
    """`PITCH`, or half of it where that leaves few places: the middle line of a strip alone."""
    places = active_lattice(board, PITCH).places
    return PITCH / 2.0 if len(places) < FEW_PLACES else PITCH


def score_board(
    board: Board,
    *,
    pitch: float | None = None,
    objective: str = "focus",
    samples: int = SAMPLES,
    border: bool = False,
    in_full: bool = False,
    seed: int = SEED,
    tolerance: float = TOLERANCE,
    as_tables: bool = True,
    progress: Progress | None = None,
) -> BoardScore:
    """Score a board.

    Parameters
    ----------
    pitch
        Distance of places, m; by default `usual_pitch`.
    objective
        What the drives are best at.
    samples
        Boards drawn within the tolerances; 0 leaves them out.
    border
        Whether places on the border of the active area are scored too.
    in_full
        Whether it tells what a click keeps, too, and what is left on foam twice as stiff.
    tolerance
        Relative L² error of the random boards' fields.
    as_tables
        Whether drives make up for a finger's load where those of a table do.
    progress
        Called with (done, all) of the boards.
    """
    started = time.perf_counter()
    pitch = usual_pitch(board) if pitch is None else pitch
    lattice = active_lattice(board, pitch, samples=samples)
    solved = solved_board(board)
    rim = border_places(board, pitch) if border else []
    if as_tables:
        every, compensated = table_drives(solved, [*lattice.places, *rim], objective, seed)
    else:
        every, compensated = best_drives(solved, [*lattice.places, *rim], objective, seed), False
    drives = every[: len(lattice.places)]
    score = score_drives(
        solved,
        lattice,
        drives,
        samples=samples,
        seed=seed,
        border=(rim, every[len(drives) :]) if border else None,
        tolerance=tolerance,
        progress=progress,
    )
    return BoardScore(
        **vars(score),
        objective=objective,
        compensated=compensated,
        click_20mm_db=click_20mm_db(solved, lattice.places, drives) if in_full else None,
        click_um=click_um(solved, lattice.places, drives) if in_full else None,
        foam_twice=on_foam_twice(solved, lattice.places, drives) if in_full else None,
        contrast_limit_db=_contrast_limit(solved, lattice.places),
        foam_length_mm=foam_length_mm(board),
        half_wavelength_mm=half_wavelength_mm(board),
        coil_spacing_mm=_coil_spacing_mm(board),
        room_for=_room_for(board),
        error_estimate=solved.fields.error_estimate,
        seconds=time.perf_counter() - started,
    )


def _contrast_limit(solved: SolvedBoard, places: Sequence[Place]) -> Spread:
    """By λ, the most of |W|² in a disc over its mean on the board, and f, the disc's share of it.

    C = (1 − f) λ / (1 − f λ), λ from the orthonormal fields of the board.
    """
    board, values = solved.board, solved.space.values
    limits = []
    for place in places:
        disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
        inside = values[:, disc]
        largest = float(np.linalg.eigvalsh(inside.conj() @ inside.T)[-1]) / inside.shape[1]
        share = float(disc.mean())
        rest = max(1.0 - share * largest, 1e-300)
        limits.append(metrics.decibel((1.0 - share) * largest / rest))
    return Spread.of(limits)


def foam_length_mm(board: Board) -> float | None:
    """Over which the answer to a force decays on foam, (4D/k)^¼; None without foam."""
    if board.foundation is None:
        return None
    stiffness = board.foundation.total_stiffness
    return float((4.0 * board.section.bending_stiffness / stiffness) ** 0.25) / MM


def half_wavelength_mm(board: Board) -> float | None:
    """Of the endless plate at the drive's frequency; None on foam below whose cut-off it stays."""
    stiffness = board.foundation.total_stiffness if board.foundation else 0.0
    omega = 2.0 * np.pi * board.drive.frequency_hz
    if stiffness >= board.section.areal_mass * omega**2:
        return None
    return board.wavelength(board.drive.frequency_hz) / 2.0 / MM


def _room_for(board: Board) -> int:
    """Coils that cover a board 12 mm apart."""
    return round(float(np.prod([max(1.0, side / CLOSE) for side in board.plate.size])))


def _coil_spacing_mm(board: Board) -> float | None:
    if len(board.actuators) < 2:
        return None
    at = np.array([actuator.at for actuator in board.actuators])
    apart = np.linalg.norm(at[:, None] - at, axis=2)
    np.fill_diagonal(apart, np.inf)
    return float(np.median(apart.min(axis=1))) / MM
