"""The scorecard of a focus: SSIM beside its null models, and the numbers SSIM does not show."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.base import Options
from chladni.drives.methods.nearest import nearest
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.problem.problem import Problem, SolvedBoard, solved_board
from chladni.drives.scoring.felt import Felt, disagreement, felt
from chladni.drives.solve import Solution
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.fields.transfer import target_field
from chladni.sim.image import metrics

ComplexArray = NDArray[np.complex128]

DIFFRACTION_SPOT = 0.36
"""Width at half maximum of J₀², the narrowest focus of waves from all sides, in wavelengths."""
FAR_FINGER = 20e-3
"""m; `metrics.SECOND_FINGER_DISTANCE` is the near one's."""
STILL = 1e-9
"""A place where every actuator does this little beside its most does not move."""


@dataclass(frozen=True)
class NullModels:
    """SSIM that comes for nothing: what a score has to beat.

    `silent` is no vibration at all, `nearest_actuator` the single best-placed coil, `misplaced` a
    perfect focus in the wrong place.
    """

    silent: float
    nearest_actuator: float
    misplaced: float


@dataclass(frozen=True)
class Scorecard:
    """How good one field is for one target. Lengths in mm, ratios in dB.

    `second_finger_20mm_db` is None where the plate has no fingertip so far away,
    `nearest_second_finger_db` is what the nearest coil alone leaves, `movable` whether any drive of
    these actuators moves the target at all, `remark` where SSIM and focus disagree, `felt` what a
    finger would feel if it is known what drives the field.
    """

    ssim: float
    focal_error_mm: float
    centroid_error_mm: float
    contrast_db: float
    contrast_limit_db: float
    second_finger_db: float
    second_finger_20mm_db: float | None
    nearest_second_finger_db: float
    louder_fraction: float
    spot_mm2: float
    diffraction_spot_mm: float
    movable: bool
    nulls: NullModels
    remark: str | None
    felt: Felt | None

    def by_key(self) -> dict[str, Any]:
        """Its numbers as `--json` has them: what a finger feels among them, and `baselines`."""
        card = asdict(self)
        felt, nulls = card.pop("felt"), card.pop("nulls")
        return card | (felt or {}) | {"baselines": nulls}


def score(solution: Solution, board: Board) -> Scorecard:
    """Score a solution on the full image, null models included."""
    return score_field(
        solved_board(board),
        solution.field,
        solution.target_field,
        solution.target_mm,
        drive=solution.drive,
    )


def score_field(
    solved: SolvedBoard,
    field: ComplexArray,
    wanted: ComplexArray,
    target_mm: tuple[float, float],
    *,
    drive: ComplexArray | None = None,
) -> Scorecard:
    """Score any field of a board against the field of a unit load at the target.

    Parameters
    ----------
    field, wanted
        complex128, shape (nx, ny), any scale.
    drive
        What makes the field, shape (actuators,), if it is known.
    """
    problem = Problem(solved, target_mm, wanted)
    return score_on(problem, field, null_models(problem), drive=drive)


def null_models(problem: Problem, *, misplaced: ComplexArray | None = None) -> NullModels:
    """The null models of one target.

    Parameters
    ----------
    misplaced
        Field of a unit load at `misplaced_target`, shape (nx, ny), if it was found already.
    """
    solved, wanted = problem.solved, np.abs(problem.wanted)
    alone = _nearest_alone(problem)
    if misplaced is None:
        place = misplaced_target(problem.board, problem.target_mm)
        (misplaced,) = target_field(
            problem.board, place, model=solved.model, allow_unmet=True
        ).values
    return NullModels(
        silent=metrics.ssim(np.zeros_like(wanted), wanted),
        nearest_actuator=metrics.ssim(np.abs(alone), wanted),
        misplaced=metrics.ssim(np.abs(misplaced), wanted),
    )


def _nearest_alone(problem: Problem) -> ComplexArray:
    """The field of the nearest coil alone."""
    drive = nearest(problem, Options()).drive
    return np.asarray(np.tensordot(drive, problem.transfer, axes=1))


def score_on(
    problem: Problem, field: ComplexArray, nulls: NullModels, *, drive: ComplexArray | None = None
) -> Scorecard:
    """Score a field on a problem whose null models are known."""
    board, place, disc = problem.board, problem.place, problem.disc
    x, y = board.x, board.y
    loudest = np.abs(problem.at_target).max()
    wavelength = board.wavelength(problem.solved.fields.frequency_hz)
    ssim = metrics.ssim(np.abs(field), np.abs(problem.wanted))
    focal_error_mm = metrics.focal_error(field, x, y, place) / MM
    near, far = metrics.SECOND_FINGER_DISTANCE, FAR_FINGER
    discs = metrics.FingertipDiscs(x, y)
    second_finger_db, at_20mm_db = discs.second_finger_db(field, place, [near, far])
    return Scorecard(
        ssim=ssim,
        focal_error_mm=focal_error_mm,
        centroid_error_mm=metrics.centroid_error(field, x, y, place) / MM,
        contrast_db=metrics.contrast_db(field, disc),
        contrast_limit_db=problem.contrast[0],
        second_finger_db=second_finger_db,
        second_finger_20mm_db=at_20mm_db if at_20mm_db < -metrics.FLOOR_DB else None,
        nearest_second_finger_db=metrics.second_finger_db(_nearest_alone(problem), x, y, place),
        louder_fraction=metrics.louder_fraction(field, disc),
        spot_mm2=metrics.spot_area(field, x, y) / MM**2,
        diffraction_spot_mm=DIFFRACTION_SPOT * wavelength / MM,
        movable=bool(loudest > STILL * np.abs(problem.transfer).max()),
        nulls=nulls,
        remark=disagreement(ssim, focal_error_mm, second_finger_db),
        felt=felt(problem, drive) if drive is not None else None,
    )


def focuses(problem: Problem, objective: str) -> bool:
    """Whether an objective's best drive has its maximum at the finger, and no finger gets more."""
    board, place = problem.board, problem.place
    drive = OBJECTIVES[objective](problem, Options(objective)).drive
    field = np.tensordot(drive, problem.transfer, axes=1)
    if metrics.focal_error(field, board.x, board.y, place) > metrics.SECOND_FINGER_DISTANCE:
        return False
    return metrics.second_finger_db(field, board.x, board.y, place) > 0.0


def focusing_objective(problem: Problem) -> str | None:
    """An objective that makes a focus, `focus` itself if it does; None where none does."""
    by_promise = sorted(OBJECTIVES, key=lambda objective: objective != "focus")
    return next((one for one in by_promise if focuses(problem, one)), None)


def misplaced_target(board: Board, target_mm: tuple[float, float]) -> tuple[float, float]:
    """A wrong place: mirrored through the centre, or a quarter board away if that is close."""
    quarter = board.plate.size[1] / 4.0 / MM
    x, y = target_mm
    if 2.0 * np.hypot(x, y) >= quarter:
        return -x, -y
    return x, y - quarter if y > 0.0 else y + quarter
