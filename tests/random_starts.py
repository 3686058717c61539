"""The best SSIM that climbs from random drives find: what the default's drives are held against."""

from __future__ import annotations

import numpy as np

from chladni.drives.problem.field_space import as_complex
from chladni.drives.problem.problem import Problem

STARTS, FINALISTS = 200, 12


def best_of_random_starts(problem: Problem, rng: np.random.Generator) -> float:
    """The highest SSIM that climbs from random drives reach, with nothing of the default's ways.

    Every start climbs a quarter of the image each way to its top, the best distinct ones the whole.
    """
    space = problem.solved.space
    size = 2 * space.rank
    coarse = space.objective(space.levels[1], problem.image)
    tops = []
    for _ in range(STARTS):
        z = rng.normal(size=size)
        tops.append((coarse.climb(z, np.zeros((size, size)), 80, 1e-7), z))
    kept: list[np.ndarray] = []
    for _, z in sorted(tops, key=lambda top: -top[0]):
        unit = as_complex(z) / np.linalg.norm(z)
        if len(kept) < FINALISTS and all(
            abs(np.vdot(unit, as_complex(other)) / np.linalg.norm(other)) ** 2 < 1.0 - 2e-5
            for other in kept
        ):
            kept.append(z)
    full = space.objective(space.levels[-1], problem.image)
    return max(full.climb(z, np.zeros((size, size)), 80, 1e-8) for z in kept)
