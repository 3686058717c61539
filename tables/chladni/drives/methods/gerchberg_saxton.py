"""Gerchberg–Saxton: keep the target's amplitudes and the field's own phases, turn by turn.

Gerchberg and Saxton, Optik 35 (1972); for phased arrays with many control points, Plasencia et al.,
"GS-PAT", ACM Trans. Graph. 39 (2020). Here the control points are a quarter of the image's points
each way, and the way back to the drives is their pseudo-inverse.
"""

from __future__ import annotations

import numpy as np

from chladni.drives.methods.base import Found, Options
from chladni.drives.methods.least_squares import damped
from chladni.drives.problem.problem import Problem

ITERATIONS = 100
SPACING = 4
CONVERGED = 1e-7


def gerchberg_saxton(problem: Problem, options: Options) -> Found:
    """Alternating projections from the least-squares drive."""
    fields = problem.transfer[:, ::SPACING, ::SPACING].reshape(len(problem.transfer), -1).T
    wanted = problem.wanted[::SPACING, ::SPACING].ravel()
    amplitude = np.abs(wanted)
    drive, _ = damped(fields, wanted)
    done = 0
    for done in range(1, (options.steps or ITERATIONS) + 1):  # noqa: B007 (counted)
        now = fields @ drive
        size = np.abs(now)
        turned = np.where(size > 0.0, now / np.where(size > 0.0, size, 1.0), 1.0)
        following, _ = damped(fields, amplitude * turned)
        change = np.linalg.norm(following - drive)
        drive = following
        if change <= CONVERGED * np.linalg.norm(drive):
            break
    return Found(drive, evaluations=done)
