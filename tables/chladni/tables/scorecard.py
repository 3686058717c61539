"""The scorecard of a focus: SSIM beside its null models, and the numbers SSIM does not show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim import metrics
from chladni.sim.board import MM, Board
from chladni.sim.transfer import target_field
from chladni.tables.solve import Scene, Solution, scene_of

ComplexArray = NDArray[np.complex128]

DIFFRACTION_SPOT = 0.36
"""Width at half maximum of J₀², the narrowest focus of waves from all sides, in wavelengths."""


@dataclass(frozen=True)
class Scorecard:
    """How good one field is for one target. Lengths in mm, ratios in dB.

    `silent`, `nearest_actuator` and `misplaced` are the SSIM of null models: no vibration at all,
    the single best-placed coil, and a perfect focus in the wrong place.
    """

    ssim: float
    focal_error_mm: float
    centroid_error_mm: float
    contrast_db: float
    contrast_limit_db: float
    second_finger_db: float
    louder_fraction: float
    spot_mm2: float
    diffraction_spot_mm: float
    silent: float
    nearest_actuator: float
    misplaced: float


def score(solution: Solution, board: Board) -> Scorecard:
    """Score a solution on the full image, null models included."""
    return score_field(scene_of(board), solution.field, solution.target_field, solution.target_mm)


def score_field(
    scene: Scene, field: ComplexArray, wanted: ComplexArray, target_mm: tuple[float, float]
) -> Scorecard:
    """Score any field of a board against the field of a unit load at the target.

    Parameters
    ----------
    field, wanted
        complex128, shape (nx, ny), any scale.
    """
    board = scene.board
    x, y = board.x, board.y
    place = (target_mm[0] * MM, target_mm[1] * MM)
    disc = metrics.disc_mask(x, y, place, metrics.FINGERTIP_RADIUS)
    target_image = np.abs(wanted)
    limit, _ = metrics.best_contrast(scene.fields.values, disc)
    wrong = target_field(board, misplaced_target(board, target_mm), model=scene.model).values[0]
    return Scorecard(
        ssim=metrics.ssim(np.abs(field), target_image),
        focal_error_mm=metrics.focal_error(field, x, y, place) / MM,
        centroid_error_mm=metrics.centroid_error(field, x, y, place) / MM,
        contrast_db=metrics.contrast_db(field, disc),
        contrast_limit_db=limit,
        second_finger_db=metrics.second_finger_db(field, x, y, place),
        louder_fraction=metrics.louder_fraction(field, disc),
        spot_mm2=metrics.spot_area(field, x, y) / MM**2,
        diffraction_spot_mm=DIFFRACTION_SPOT
        * board.plate.wavelength(scene.fields.frequency_hz) / MM,
        silent=metrics.ssim(np.zeros_like(target_image), target_image),
        nearest_actuator=metrics.ssim(np.abs(_nearest(scene, place)), target_image),
        misplaced=metrics.ssim(np.abs(wrong), target_image),
    )  # fmt: skip


def misplaced_target(board: Board, target_mm: tuple[float, float]) -> tuple[float, float]:
    """A wrong place: mirrored through the centre, or a quarter board away if that is close."""
    quarter = board.plate.size[1] / 4.0 / MM
    x, y = target_mm
    if 2.0 * np.hypot(x, y) >= quarter:
        return -x, -y
    return x, y - quarter if y > 0.0 else y + quarter


def _nearest(scene: Scene, place: tuple[float, float]) -> ComplexArray:
    places = np.array([actuator.at for actuator in scene.board.actuators])
    return np.asarray(scene.fields.values[np.argmin(np.linalg.norm(places - place, axis=1))])
