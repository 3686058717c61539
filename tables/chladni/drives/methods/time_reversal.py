"""Time reversal: every actuator plays back, conjugated, what it would hear from the target.

Fink, "Time reversal of ultrasonic fields", IEEE Trans. UFFC 39 (1992); at one frequency it is the
conjugate of the transfer functions, and makes the target move most for the power that goes in.
"""

from __future__ import annotations

import numpy as np

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.problem import Problem


def time_reversal(problem: Problem, options: Options) -> Found:
    """Conjugate of the mean transfer function over the fingertip."""
    del options
    return Found(np.asarray(problem.transfer[:, problem.disc].mean(axis=1).conj()))
