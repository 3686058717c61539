"""Bring the image's maximum to the target, as far as contrast allows.

Among drives that move the target by 1, min max|W| is convex, and Lawson's iteration finds it:
weighted least squares, the weights multiplied by |W| after every turn. (Lawson, "Contributions to
the theory of linear least maximum approximation", UCLA 1961.) With even weights the first turn is
nearly the drive of best contrast; the more turns, the lower the highest peak elsewhere, and the
lower the contrast. Every turn is a candidate: of those within `FLOOR_DB` of the contrast's limit,
the one whose maximum is nearest to the target is taken.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.field_space import every
from chladni.drives.problem.problem import Problem
from chladni.sim.image import metrics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FLOOR_DB = 3.0
"""Contrast given up at most: about one just noticeable difference of amplitude (2.3 dB)."""
TURNS = 60
SPACING = 4
"""Maxima are followed on every fourth image point (1.6 mm on the shipped boards)."""


def peak(problem: Problem, options: Options) -> Found:
    """The candidate with the smallest focal error above the contrast floor."""
    limit, best = problem.contrast
    rows, columns = (every(SPACING, points.size) for points in (problem.board.x, problem.board.y))
    x, y = problem.board.x[rows], problem.board.y[columns]
    scale = float(np.abs(problem.transfer).max())
    at_target = problem.at_target
    if not np.abs(at_target).max() > 1e-12 * scale:
        return Found(best)  # nothing moves the target, so no drive is better than another
    fields = problem.transfer[:, rows][:, :, columns].reshape(len(at_target), -1)
    weight = np.full(fields.shape[1], 1.0 / fields.shape[1])
    candidates = [best]
    for _ in range(options.steps or TURNS):
        candidates.append(_least(fields, weight, at_target))
        weight = weight * np.abs(candidates[-1] @ fields)
        weight /= weight.sum()

    def rank(drive: ComplexArray) -> tuple[float, float]:
        """Focal error first, then contrast; out of the running below the floor."""
        reached = metrics.contrast_db(np.tensordot(drive, problem.transfer, axes=1), problem.disc)
        if reached < limit - FLOOR_DB:
            return np.inf, -reached
        image = (drive @ fields).reshape(x.size, y.size)
        return metrics.focal_error(image, x, y, problem.place), -reached

    return Found(min(candidates, key=rank), evaluations=len(candidates))


def _least(fields: ComplexArray, weight: FloatArray, at_target: ComplexArray) -> ComplexArray:
    """The drive of least weighted |W|² that moves the target by 1."""
    gram = (fields.conj() * weight) @ fields.T
    damping = 1e-10 * np.trace(gram).real / len(gram)
    solved = np.linalg.solve(gram + damping * np.eye(len(gram)), at_target.conj())
    return np.asarray(solved / (at_target @ solved))
