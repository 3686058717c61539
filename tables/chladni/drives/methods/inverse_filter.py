"""Inverse filter: 1 at the target, 0 at the other control points, by a truncated pseudo-inverse.

Pantera and Hudin, "Sparse actuator array combined with inverse filter for multitouch vibrotactile
stimulation", IEEE World Haptics 2019, and "Multitouch vibrotactile feedback on a tactile screen by
the inverse filter technique", IEEE Trans. Haptics 13 (2020). Theirs stands on as many control
points as actuators; here the points are the table's regions, the five actuators cannot meet them
all, and the pseudo-inverse gives the least squares of what is left.
"""

from __future__ import annotations

import numpy as np

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.problem import Problem
from chladni.drives.problem.region_grid import region_grid
from chladni.sim.board.quantity import MM

TRUNCATION = 1e-3
"""Singular values below this share of the largest are left out, as in the 2019 paper's −60 dB."""


def inverse_filter(problem: Problem, options: Options) -> Found:
    """The truncated pseudo-inverse at the control points."""
    del options
    board, grid = problem.board, region_grid(problem.board)
    centres = np.array([grid.centre_mm(region) for region in range(grid.count)]) * MM
    rows = np.abs(board.x[:, None] - centres[:, 0]).argmin(axis=0)
    columns = np.abs(board.y[:, None] - centres[:, 1]).argmin(axis=0)
    fields = problem.transfer[:, rows, columns].T
    wanted = np.zeros(grid.count)
    wanted[int(np.linalg.norm(centres - problem.place, axis=1).argmin())] = 1.0
    return Found(np.asarray(np.linalg.pinv(fields, rcond=TRUNCATION) @ wanted))
