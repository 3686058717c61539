"""What integers lose against the drives they stand for: of SSIM, and of the field."""

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
    """What a table may lose: a tenth of the amplitude JND, and SSIM that no one can see."""

    field_db: float = 0.25
    ssim: float = 0.002


LIMITS = LossLimits()


@dataclass(frozen=True)
class Point:
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
    """

    kept: FloatArray
    ssim: FloatArray
    field_db: FloatArray

    @property
    def are_within(self) -> bool:
        """Whether the limits are kept at every point."""
        ssim, field_db = self.ssim.max(initial=0.0), self.field_db.max(initial=0.0)
        return bool(ssim <= LIMITS.ssim and field_db <= LIMITS.field_db)


def losses(
    solved: SolvedBoard, points: Sequence[Point], exact: ComplexArray, got: ComplexArray, *,
    until_beyond: bool = False, jobs: int | None = None,
) -> Losses:  # fmt: skip
    """What drives (points, actuators) lose against the exact ones.

    Parameters
    ----------
    until_beyond
        Stop at the first point that loses more than the limits: what is beyond them will be.
    """
    fields, space = solved.fields.values, solved.space

    def one(case: tuple[Point, ComplexArray, ComplexArray]) -> tuple[float, float, float]:
        point, *drives = case
        wanted = space.objective_of(point.level, point.image.astype(np.float64))
        best, kept = (space.value(wanted, drive) for drive in drives)
        right, wrong = (np.abs(np.tensordot(drive, fields, axes=1)) for drive in drives)
        return kept, best - kept, _error_db(wrong, right)

    rows = []
    for row in in_threads(one, zip(points, exact, got, strict=True), jobs=jobs):
        rows.append(row)
        if until_beyond and (row[1] > LIMITS.ssim or row[2] > LIMITS.field_db):
            break
    return Losses(*np.array(rows).reshape(-1, 3).T)


def _error_db(got: FloatArray, exact: FloatArray) -> float:
    largest = float(exact.max())
    error = float(np.abs(got - exact).max())
    return float(20.0 * np.log10(1.0 + error / largest)) if largest > 0.0 else 0.0
