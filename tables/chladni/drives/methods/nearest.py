"""The nearest actuator alone: what anybody would try first."""

from __future__ import annotations

import numpy as np

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.problem import Problem


def nearest(problem: Problem, options: Options) -> Found:
    """Unit gain on the actuator nearest to the target."""
    del options
    places = np.array([actuator.at for actuator in problem.board.actuators])
    distance = np.linalg.norm(places - problem.place, axis=1)
    drive = np.zeros(len(places), dtype=np.complex128)
    drive[int(np.argmin(distance))] = 1.0
    return Found(drive)
