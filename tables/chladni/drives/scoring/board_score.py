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
from scipy.spatial import cKDTree

from chladni.drives.batch import over_targets
from chladni.drives.methods import SEED, Options, Progress
from chladni.drives.methods.focus import focus_at
from chladni.drives.methods.phasor import phasor
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.threads import in_threads, one_blas_thread
from chladni.drives.scoring.finger import MICROMETRE, Spread
from chladni.drives.scoring.tolerances import drawn_boards
from chladni.sim.board.board import Board
from chladni.sim.board.focus import Active
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.errors import InputError
from chladni.sim.fields.driven import driven_fields
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.image import metrics

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]
Place = tuple[float, float]

PITCH = 6e-3
"""m; half a fingertip."""
SAMPLES = 32
"""The share of boards' places that win is then known to a percent or two."""
DISTANCES = (metrics.SECOND_FINGER_DISTANCE, 16e-3, 20e-3, 25e-3)


@dataclass(frozen=True)
class Numbers:
    """Of places all over a board, or over several boards; p10 is the bad tail.

    Attributes
    ----------
    above_second_finger
        Share of places that move more than every second finger, 12 mm or more away.
    focal_error_mm
        From the place to the image's maximum; here the bad tail is p90.
    second_finger_db, second_finger_16mm_db, second_finger_20mm_db, second_finger_25mm_db
        RMS in the place's disc over the loudest equal disc at that distance or more; None where a
        board is smaller than that.
    finger_um
        Peak under the finger at the coils' limit; None on a board without a coil.
    """

    above_second_finger: float
    focal_error_mm: Spread
    second_finger_db: Spread | None
    second_finger_16mm_db: Spread | None
    second_finger_20mm_db: Spread | None
    second_finger_25mm_db: Spread | None
    finger_um: Spread | None


@dataclass(frozen=True)
class Perturbed(Numbers):
    """The same drives on boards that are all off at once (tolerances.py)."""

    samples: int
    seed: int


@dataclass(frozen=True)
class Maps:
    """Numbers by place, for figures.

    Attributes
    ----------
    x_mm, y_mm
        Centres of the cells, shapes (columns,) and (rows,).
    cell_mm
        Their size.
    second_finger_20mm_db, focal_error_mm, finger_um
        Shape (columns, rows); NaN where there is no such number.
    """

    x_mm: FloatArray
    y_mm: FloatArray
    cell_mm: Place
    second_finger_20mm_db: FloatArray
    focal_error_mm: FloatArray
    finger_um: FloatArray


@dataclass(frozen=True)
class BoardScore(Numbers):
    """What a board is worth.

    Attributes
    ----------
    places
        How many were looked at.
    perturbed
        The same on boards that are off; None if that was not asked for.
    contrast_limit_db
        The most contrast that any drive can have, over the places.
    foam_length_mm
        (4D/k)^¼ of what the plate lies on, by which fields decay; None without a foundation.
    half_wavelength_mm
        Of the endless plate; on foam below its cut-off no wave travels, and it is None.
    coil_spacing_mm
        Median distance of a coil to its nearest neighbour; None for a single one.
    error_estimate
        Of the fields.
    """

    places: int
    objective: str
    perturbed: Perturbed | None
    contrast_limit_db: Spread
    foam_length_mm: float | None
    half_wavelength_mm: float | None
    coil_spacing_mm: float | None
    error_estimate: float
    seconds: float
    maps: Maps


def score_board(
    board: Board,
    *,
    pitch: float = PITCH,
    objective: str = "focus",
    samples: int = SAMPLES,
    seed: int = SEED,
    tolerance: float = TOLERANCE,
    progress: Progress | None = None,
) -> BoardScore:
    """Score a board.

    Parameters
    ----------
    pitch
        Distance of places, m.
    objective
        What the drives are best at.
    samples
        Boards drawn within the tolerances; 0 leaves them out.
    tolerance
        Relative L² error of the drawn boards' fields.
    progress
        Called with (done, all) of the boards.
    """
    started = time.perf_counter()
    x, y, cell = active_grid(board, pitch)
    places = [(along_x, along_y) for along_x in x.tolist() for along_y in y.tolist()]
    solved = solved_board(board)
    drives = _drives(solved, places, objective, seed)
    own = _Sight(board, places, drives)
    seen = own.look(solved.fields.values)
    if progress:
        progress(1, 1 + samples)
    perturbed = None
    if samples:
        rows = []
        for number, drawn in enumerate(drawn_boards(board, samples, seed), 2):
            with one_blas_thread():
                values = driven_fields(drawn.board, tolerance=tolerance, allow_unmet=True).values
            rows.append(own.look(drawn.forces[:, None, None] * values))
            if progress:
                progress(number, 1 + samples)
        perturbed = Perturbed(**vars(_numbers(np.concatenate(rows))), samples=samples, seed=seed)
    return BoardScore(
        **vars(_numbers(seen)),
        places=len(places),
        objective=objective,
        perturbed=perturbed,
        contrast_limit_db=_contrast_limit(solved, places),
        foam_length_mm=_foam_length_mm(board),
        half_wavelength_mm=_half_wavelength_mm(board),
        coil_spacing_mm=_coil_spacing_mm(board),
        error_estimate=solved.fields.error_estimate,
        seconds=time.perf_counter() - started,
        maps=Maps(x / MM, y / MM, cell, *(seen[:, k].reshape(x.size, y.size) for k in (3, 0, 5))),
    )


def active_grid(board: Board, pitch: float) -> tuple[FloatArray, FloatArray, Place]:
    """Equal cells of about a pitch over the active area: centres along x and y, m, and size, mm.

    Raises
    ------
    InputError
        The pitch is not a length, or nothing is left of the board.
    """
    if not pitch > 0.0 or not np.isfinite(pitch):
        raise InputError("pitch", pitch / MM, "a length above 0 mm")
    margin = (board.active or Active()).margin
    axes, cell = [], []
    for side in board.plate.size:
        left = side - 2.0 * margin
        if left <= 0.0:
            expected = f"less than half the short side, {min(board.plate.size) / 2.0 / MM:g}"
            raise InputError("active.margin_mm", margin / MM, expected)
        count = max(1, round(left / pitch))
        axes.append(((np.arange(count) + 0.5) / count - 0.5) * left)
        cell.append(left / count / MM)
    return axes[0], axes[1], (cell[0], cell[1])


def _drives(
    solved: SolvedBoard, places: Sequence[Place], objective: str, seed: int
) -> list[ComplexArray]:
    """The best drive of every place, of any scale."""
    if objective != "focus":
        targets = [(x / MM, y / MM) for x, y in places]
        options = Options(objective, seed)
        work = over_targets(solved, targets, lambda one: {"drive": phasor(one, options).drive})
        return [one["drive"] for one in work]
    board, values = solved.board, solved.fields.values
    _ = solved.second_fingers  # found once, before there are threads

    def one(place: Place) -> ComplexArray:
        disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
        focused = focus_at(solved, place, values[:, disc].mean(axis=1))
        return np.ones(len(values), np.complex128) if focused is None else focused.drive

    folded = [_folded(solved, place) for place in places]
    stored = list(dict.fromkeys(own for own, _ in folded))
    with one_blas_thread():
        found = dict(zip(stored, in_threads(one, stored), strict=True))
    return [found[own][order] for own, order in folded]


def _folded(solved: SolvedBoard, place: Place) -> tuple[Place, IndexArray]:
    """The place's image in the board's mirrors at large x and y, and the order of coils there.

    A drive of the image is that of the place once its coils are put in this order.
    """
    order = np.arange(len(solved.board.actuators))
    own = [round(along, 9) for along in place]
    for axis, mirror in enumerate(solved.mirrors):
        if mirror is not None and own[axis] < 0.0:
            own[axis], order = -own[axis], order[list(mirror)]
    return (own[0], own[1]), order


class _Sight:
    """Drives of places, looked at on fields of the board or of one that came out otherwise."""

    def __init__(
        self, board: Board, places: Sequence[Place], drives: Sequence[ComplexArray]
    ) -> None:
        self._x, self._y = board.x, board.y
        self._discs = metrics.FingertipDiscs(board.x, board.y)
        full = [full_drive(board, drive, board.drive.frequency_hz) for drive in drives]
        newtons = [one.newtons if one else np.nan for one in full]
        # Each drive at the coils' limit.
        self._cases = [
            (place, drive / max(float(np.abs(drive).max()), 1e-300), own)
            for place, drive, own in zip(places, drives, newtons, strict=True)
        ]

    def look(self, values: ComplexArray) -> FloatArray:
        """Focal error (mm), second finger at each distance (dB) and µm; shape (places, 6)."""
        with one_blas_thread():
            rows = in_threads(lambda case: self._one(values, *case), self._cases)
            return np.array(list(rows))

    def _one(
        self, values: ComplexArray, place: Place, drive: ComplexArray, newtons: float
    ) -> list[float]:
        field = np.tensordot(drive, values, axes=1)
        disc = metrics.disc_mask(self._x, self._y, place, metrics.FINGERTIP_RADIUS)
        return [
            metrics.focal_error(field, self._x, self._y, place) / MM,
            *self._discs.second_finger_db(field, place, DISTANCES),
            float(abs(field[disc].mean())) * newtons / MICROMETRE,
        ]


def _numbers(seen: FloatArray) -> Numbers:
    """Of rows as `_Sight.look` has them."""
    # 300 dB says that there is no disc so far away.
    known = [column[column < -metrics.FLOOR_DB] for column in seen[:, 1:5].T]
    seconds = [Spread.of(column.tolist()) if column.size else None for column in known]
    has_coil = bool(np.all(np.isfinite(seen[:, 5])))
    return Numbers(
        above_second_finger=float(np.mean(seen[:, 1] > 0.0)),
        focal_error_mm=Spread.of(seen[:, 0].tolist()),
        second_finger_db=seconds[0],
        second_finger_16mm_db=seconds[1],
        second_finger_20mm_db=seconds[2],
        second_finger_25mm_db=seconds[3],
        finger_um=Spread.of(seen[:, 5].tolist()) if has_coil else None,
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


def _foam_length_mm(board: Board) -> float | None:
    if board.foundation is None:
        return None
    stiffness = board.foundation.total_stiffness
    return float((4.0 * board.plate.bending_stiffness / stiffness) ** 0.25) / MM


def _half_wavelength_mm(board: Board) -> float | None:
    stiffness = board.foundation.total_stiffness if board.foundation else 0.0
    omega = 2.0 * np.pi * board.drive.frequency_hz
    if stiffness >= board.plate.areal_mass * omega**2:
        return None
    return board.plate.wavelength(board.drive.frequency_hz) / 2.0 / MM


def _coil_spacing_mm(board: Board) -> float | None:
    if len(board.actuators) < 2:
        return None
    at = np.array([actuator.at for actuator in board.actuators])
    return float(np.median(np.asarray(cKDTree(at).query(at, k=2)[0])[:, 1])) / MM
