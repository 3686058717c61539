"""Contrast control: the most energy under the finger for the least elsewhere, as an eigenproblem.

Choi and Kim, "Generation of an acoustically bright zone with an illuminated region using multiple
sources", JASA 111 (2002). The largest eigenvalue of the pencil (mean over the disc, mean over the
rest) is a certificate: no drive of these actuators has a higher contrast.
"""

from __future__ import annotations

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.problem import Problem
from chladni.sim.image import metrics


def contrast(problem: Problem, options: Options) -> Found:
    """The leading eigenvector; `limit_db` is its eigenvalue."""
    del options
    limit, drive = metrics.best_contrast(problem.transfer, problem.disc)
    return Found(drive, details={"limit_db": limit})
