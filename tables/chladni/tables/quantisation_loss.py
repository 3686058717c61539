"""Loss of SSIM (or of second finger) and of field when drives are rounded to integers.

Drives of the objective `focus` are compared by their second finger, all others by SSIM.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.field_space import Level
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.threads import in_threads

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class LossLimits:
    """What a table may lose: a tenth of the amplitude JND, and SSIM that no one can see.

    Of the second finger an eighth of that JND.
    """

    field_db: float = 0.25
    ssim: float = 0.002
    second_finger_db: float = 0.3


LIMITS = LossLimits()


@dataclass(frozen=True)
class MeasuredPoint:
    """A place at which losses are measured: where it is, and the image wanted there."""

    place_um: tuple[int, int]
    level: Level
    """The image points on which SSIM is compared."""
    image: NDArray[np.float32]
    """Normalised, on those points."""


@dataclass(frozen=True)
class Losses:
    """Of drives at some points, each of shape (points,).

    Attributes
    ----------
    kept
        SSIM that is left.
    ssim
        SSIM that is lost.
    field_db
        20·log₁₀(1 + max‖Ŵ|−|W‖ / max|W|).
    second_finger_db
        dB of second finger that are lost; None where drives are best at something else.
    """

    kept: FloatArray
    ssim: FloatArray
    field_db: FloatArray
    second_finger_db: FloatArray | None = None

    @property
    def are_within(self) -> bool:
        """Whether the limits are kept at every point."""
        second = self.second_finger_db
        if second is None:
            aim = self.ssim.max(initial=0.0) <= LIMITS.ssim
        else:
            aim = second.max(initial=0.0) <= LIMITS.second_finger_db
        return bool(aim and self.field_db.max(initial=0.0) <= LIMITS.field_db)


def losses(
    solved: SolvedBoard,
    points: Sequence[MeasuredPoint],
    exact: ComplexArray,
    got: ComplexArray,
    *,
    objective: str = "ssim",
    until_beyond: bool = False,
    jobs: int | None = None,
) -> Losses:
    """What drives (points, actuators) lose against the exact ones.

    Parameters
    ----------
    objective
        What they are best at.
    until_beyond
        Stop at the first point that loses more than the limits: what is beyond them will be.
    """
    fields, space = solved.fields.values, solved.space
    is_focus = objective == "focus"
    if is_focus:
        _ = solved.second_fingers  # found once, before there are threads

    def one(case: tuple[MeasuredPoint, ComplexArray, ComplexArray]) -> tuple[float, ...]:
        point, *drives = case
        wanted = space.objective_of(point.level, point.image.astype(np.float64))
        best, kept = (space.value(wanted, drive) for drive in drives)
        right, wrong = (np.abs(np.tensordot(drive, fields, axes=1)) for drive in drives)
        lost = 0.0
        if is_focus:
            place = (point.place_um[0] * 1e-6, point.place_um[1] * 1e-6)
            levels = [solved.second_fingers.second_finger_db(drive, place) for drive in drives]
            lost = levels[0] - levels[1]
        return kept, best - kept, _error_db(wrong, right), lost

    rows: list[tuple[float, ...]] = []
    for row in in_threads(one, zip(points, exact, got, strict=True), jobs=jobs):
        rows.append(row)
        if until_beyond and not _of_rows([row], is_focus=is_focus).are_within:
            break
    return _of_rows(rows, is_focus=is_focus)


def _of_rows(rows: Sequence[tuple[float, ...]], *, is_focus: bool) -> Losses:
    kept, ssim, field_db, second = np.array(rows).reshape(-1, 4).T
    return Losses(kept, ssim, field_db, second if is_focus else None)


def _error_db(got: FloatArray, exact: FloatArray) -> float:
    largest = float(exact.max())
    error = float(np.abs(got - exact).max())
    return float(20.0 * np.log10(1.0 + error / largest)) if largest > 0.0 else 0.0
