"""A board whose coils' polarity and forces are known, by which its device makes up for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board

FloatArray = NDArray[np.float64]

MOST_TRIM_DB = 12.0
"""That a board file takes."""


def with_coils_known(board: Board, forces: FloatArray) -> Board:
    """The board with such forces in place of its file's polarity and trim.

    Drives are then for the foam that the board has, and no stiffer one.

    Parameters
    ----------
    forces
        Per newton that a coil is driven with, (actuators,): below 0 reversed, 0 dead.
    """
    actuators = []
    for own, force in zip(board.actuators, forces.tolist(), strict=True):
        if force == 0.0:
            actuators.append(replace(own, polarity=1, trim_db=0.0, is_dead=True))
            continue
        trim = float(np.clip(-20.0 * np.log10(abs(force)), -MOST_TRIM_DB, MOST_TRIM_DB))
        actuators.append(replace(own, polarity=int(np.sign(force)), trim_db=trim, is_dead=False))
    focus = replace(board.focus, foam_ratio=1.0) if board.focus else None
    return replace(board, actuators=tuple(actuators), focus=focus)
