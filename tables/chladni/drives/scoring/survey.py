"""A board survey: second fingers, focal error and micrometres of drives all over a board.

Where the drives come from does not matter: a solver, or the pins of a device.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods import Progress
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.threads import in_threads, one_blas_thread
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE, drawn_boards
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.cost import Cost, begin
from chladni.sim.errors import ArgumentError
from chladni.sim.fields.driven import driven_fields
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.image import metrics

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
Place = tuple[float, float]

SAMPLES = 32
"""The share of boards' places that win is then known to a percent or two."""
SMALLEST_PITCH = 1e-4
"""m; fields have a value each millimetre."""
PLACE_BYTES, ROW_BYTES = 2000, 100
"""Of each place: its drive and what is kept with it, as measured; and its row on a drawn board."""
DISTANCES = (metrics.SECOND_FINGER_DISTANCE, 16e-3, 20e-3, 25e-3)


@dataclass(frozen=True)
class FocusStatistics:
    """How drives focus at places all over a board, or over several boards; p10 is the bad tail.

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
class Perturbed(FocusStatistics):
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
class Score(FocusStatistics):
    """What drives all over a board are worth.

    Attributes
    ----------
    places
        How many were surveyed.
    nearest_coil_20mm_db
        What comes for nothing: the second finger from 20 mm on where each place is played by its
        nearest coil alone.
    border
        Places on the border of the active area, which none of the others is; None if that was not
        asked for.
    perturbed
        The same on boards that are off; None if that was not asked for.
    """

    places: int
    border: FocusStatistics | None
    nearest_coil_20mm_db: Spread | None
    perturbed: Perturbed | None
    maps: Maps


@dataclass(frozen=True)
class Lattice:
    """Places all over the active area.

    Attributes
    ----------
    x, y
        m, shapes (columns,) and (rows,).
    cell_mm
        Between neighbours.
    """

    x: FloatArray
    y: FloatArray
    cell_mm: Place

    @property
    def places(self) -> list[Place]:
        """All of them, column by column, m."""
        return [(along_x, along_y) for along_x in self.x.tolist() for along_y in self.y.tolist()]

    def with_halfway(self) -> Lattice:
        """The same places, and those half-way from each to the next."""
        x, y = (np.linspace(axis[0], axis[-1], 2 * axis.size - 1) for axis in (self.x, self.y))
        # A single column or row keeps its width: there is nothing half-way.
        cell = [
            size / (1.0 if axis.size == 1 else 2.0)
            for size, axis in zip(self.cell_mm, (x, y), strict=True)
        ]
        return Lattice(x, y, (cell[0], cell[1]))


def active_lattice(
    board: Board, pitch: float, *, halfway: bool = False, samples: int = 0
) -> Lattice:
    """Centres of equal cells of about a pitch (m) over the active area.

    Parameters
    ----------
    halfway
        Whether places half-way from each to the next are added.
    samples
        Random boards on which each place is measured too, for the memory that takes.

    Raises
    ------
    InputError
        The pitch is not a length, nothing is left of the board, or it has too many places.
    """
    if not SMALLEST_PITCH <= pitch < np.inf:
        raise ArgumentError("pitch", pitch / MM, f"a length of at least {SMALLEST_PITCH / MM:g} mm")
    axes, cell = [], []
    for low, high in board.active_area:
        left = high - low
        count = max(1, round(left / pitch))
        axes.append((low + high) / 2.0 + ((np.arange(count) + 0.5) / count - 0.5) * left)
        cell.append(left / count / MM)
    lattice = Lattice(axes[0], axes[1], (cell[0], cell[1]))
    lattice = lattice.with_halfway() if halfway else lattice
    count = lattice.x.size * lattice.y.size
    # Progress bars tell the time.
    needed = count * (PLACE_BYTES + ROW_BYTES * float(samples))
    begin(Cost(f"a survey of {count} places", needed, 0.0, "the number of places or of samples"))
    return lattice


def border_places(board: Board, pitch: float) -> list[Place]:
    """Places on the border of the active area, about a pitch (m) apart, its corners among them.

    A lattice of cells' centres ends half a cell before the border, where a focus is worst.
    """
    area = board.active_area
    x, y = (
        np.linspace(low, high, max(1, round((high - low) / pitch)) + 1).tolist()
        for low, high in area
    )
    ends = [(along, end) for along in x for end in area[1]]
    return ends + [(end, along) for along in y[1:-1] for end in area[0]]


def score_drives(
    solved: SolvedBoard,
    lattice: Lattice,
    drives: Sequence[ComplexArray],
    *,
    samples: int,
    seed: int,
    border: tuple[Sequence[Place], Sequence[ComplexArray]] | None = None,
    tolerance: float = TOLERANCE,
    progress: Progress | None = None,
) -> Score:
    """Score drives of places, as drawn and on boards that come out otherwise.

    Parameters
    ----------
    drives
        One a place, complex128, shape (actuators,), any scale.
    border
        Places on the border of the active area and their drives.
    samples
        Boards drawn within the tolerances; 0 leaves them out.
    tolerance
        Relative L² error of the random boards' fields.
    progress
        Called with (done, all) of the boards.
    """
    board = solved.board
    survey = Survey(board, lattice.places, drives)
    measured = survey.measure(solved.fields.values)
    alone = Survey(board, lattice.places, nearest_coils(board, lattice.places))
    rim = None if border is None else Survey(board, *border).measure(solved.fields.values)
    nearest = statistics(alone.measure(solved.fields.values))
    if progress:
        progress(1, 1 + samples)
    perturbed = None
    if samples:
        rows, own = [], max(tolerance, DRAWN_TOLERANCE)
        for number, drawn in enumerate(drawn_boards(board, samples, seed), 2):
            with one_blas_thread():
                values = driven_fields(drawn.board, tolerance=own, allow_unmet=True).values
            rows.append(survey.measure(drawn.forces[:, None, None] * values))
            if progress:
                progress(number, 1 + samples)
        perturbed = Perturbed(**vars(statistics(np.concatenate(rows))), samples=samples, seed=seed)
    x, y = lattice.x, lattice.y
    maps = (measured[:, k].reshape(x.size, y.size) for k in (3, 0, 5))
    return Score(
        **vars(statistics(measured)),
        places=len(drives),
        border=None if rim is None else statistics(rim),
        nearest_coil_20mm_db=nearest.second_finger_20mm_db,
        perturbed=perturbed,
        maps=Maps(x / MM, y / MM, lattice.cell_mm, *maps),
    )


def nearest_coils(board: Board, places: Sequence[Place]) -> list[ComplexArray]:
    """For each place the drive of its nearest coil alone."""
    coils = np.array([actuator.at for actuator in board.actuators])
    each = np.eye(len(coils), dtype=np.complex128)
    return [each[int(np.argmin(np.linalg.norm(coils - place, axis=1)))] for place in places]


class Survey:
    """Drives of places, measured on fields of the board or of one that came out otherwise."""

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

    def measure(self, values: ComplexArray) -> FloatArray:
        """Focal error (mm), second finger at each distance (dB) and µm; shape (places, 6)."""
        with one_blas_thread():
            rows = in_threads(lambda k: self.one(values, k), range(len(self._cases)))
            return np.array(list(rows))

    def one(self, values: ComplexArray, k: int, forces: FloatArray | None = None) -> list[float]:
        """The row of one place, with its coils' forces over those that they should have."""
        place, drive, newtons = self._cases[k]
        drive = drive if forces is None else forces * drive
        field = np.tensordot(drive, values, axes=1)
        disc = metrics.disc_mask(self._x, self._y, place, metrics.FINGERTIP_RADIUS)
        return [
            metrics.focal_error(field, self._x, self._y, place) / MM,
            *self._discs.second_finger_db(field, place, DISTANCES),
            float(abs(field[disc].mean())) * newtons / MICROMETRE,
        ]


def statistics(measured: FloatArray) -> FocusStatistics:
    """Of rows as `Survey.measure` has them."""
    # 300 dB means that there is no disc so far away.
    known = [column[column < -metrics.FLOOR_DB] for column in measured[:, 1:5].T]
    seconds = [Spread.of(column.tolist()) if column.size else None for column in known]
    has_coil = bool(np.all(np.isfinite(measured[:, 5])))
    return FocusStatistics(
        above_second_finger=float(np.mean(measured[:, 1] > 0.0)),
        focal_error_mm=Spread.of(measured[:, 0].tolist()),
        second_finger_db=seconds[0],
        second_finger_16mm_db=seconds[1],
        second_finger_20mm_db=seconds[2],
        second_finger_25mm_db=seconds[3],
        finger_um=Spread.of(measured[:, 5].tolist()) if has_coil else None,
    )
