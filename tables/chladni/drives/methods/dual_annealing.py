"""SciPy's generalised simulated annealing over the same variables, with SciPy's own schedule.

Tsallis and Stariolo, Physica A 233 (1996), with local searches by L-BFGS-B, which here get the
exact gradient. The objective is SSIM on the full image, in the search's orthonormal coordinates.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.field_space import as_complex
from chladni.drives.problem.problem import Problem

EVALUATIONS = 3000
"""About two seconds; the default `maxiter` of 1000 would take a minute for the same result."""


def dual_annealing(problem: Problem, options: Options) -> Found:
    """Minimise 1 − SSIM in a box that holds every drive up to its scale."""
    # No other method needs SciPy's optimisers, which take a tenth of a second to load.
    from scipy.optimize import dual_annealing as scipy_dual_annealing  # noqa: PLC0415

    space = problem.solved.space
    objective = space.objective(space.levels[-1], problem.image)
    gradient = np.empty(2 * space.rank)

    def loss(z: NDArray[np.float64]) -> float:
        return 1.0 - objective.value(np.ascontiguousarray(z))

    def slope(z: NDArray[np.float64]) -> NDArray[np.float64]:
        objective.evaluate(np.ascontiguousarray(z), gradient)
        return -gradient

    result = scipy_dual_annealing(
        loss,
        bounds=[(-1.0, 1.0)] * (2 * space.rank),
        maxfun=options.steps or EVALUATIONS,
        rng=np.random.default_rng(options.seed),
        minimizer_kwargs={"method": "L-BFGS-B", "jac": slope},
    )
    return Found(space.drive(as_complex(result.x)), objective.evaluations)
