"""How loud a board is at each frequency, as most of its places have it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.scoring.several_fingers.finger_sets import finger_sets
from chladni.host.emulation.felt_over_time import (
    FingerPlate,
    Progress,
    frequencies_of,
    over_frequency,
)
from chladni.sim.board.board import Board
from chladni.sim.image.finger import PRESS

FloatArray = NDArray[np.float64]
PLACES, SEED = 16, 3


def common_level(
    board: Board,
    *,
    solved: Sequence[SolvedBoard] | None = None,
    progress: Progress | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Hz, and the median over drawn places of the level under a pressing finger, 1 at the drive's.

    Parameters
    ----------
    solved
        The board `over_frequency`, if it is at hand.
    """
    solved = over_frequency(board, progress) if solved is None else solved
    rng = np.random.default_rng(SEED)
    places = finger_sets(board, 2, PLACES // 2, board.fingers_apart, rng).reshape(-1, 2)
    hz, own = frequencies_of(solved), board.drive.frequency_hz
    levels = []
    for plate in FingerPlate.each_alone(solved, places, PRESS):
        level = plate.level(0, own)
        levels.append(level / np.interp(own, hz, level))
    return hz, np.asarray(np.median(levels, axis=0))
