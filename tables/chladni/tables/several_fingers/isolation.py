"""What a table's responses cost: how far apart two pressing fingers are kept with them.

Drives come from the responses as a device reads them, fields from the plate with both fingers on
it. Pairs and λ are those of `score_fingers`, so that all commands tell one number of a board.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers.responses import Responses, responses_at
from chladni.drives.fingers.silence import KnownPlate
from chladni.drives.methods import SEED
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet, finger_sets
from chladni.drives.scoring.several_fingers.fingers_score import SETS, solver_of
from chladni.drives.scoring.several_fingers.kept_apart import rows_of
from chladni.drives.scoring.spread import Spread
from chladni.sim.board.board import Board
from chladni.sim.image.finger import PRESS, pressing_stiffness

FloatArray = NDArray[np.float64]

FINGERS = 2
"""Side by side or further apart: those for which drives can do most, and so lose most by rounding.
They press with 1 N."""
LITTLE_DB = 0.5
"""That a table may lose to be taken where there is a larger one: pins lose some, too."""
LIMIT_DB = 1.0
"""That rounding and interpolation may take, at the median and at the worst tenth: what a table does
is what its board's score said, within less than half the JND of amplitude (2.3 dB)."""


@dataclass(frozen=True)
class DrawnPairs:
    """Pairs of pressing fingers on a board at one frequency, and what is exactly known of it.

    Attributes
    ----------
    known
        The responses that tables round.
    exact
        Isolation with these, dB, a number per finger.
    """

    board: Board
    known: Responses
    sets: list[FingerSet]
    exact: FloatArray

    @classmethod
    def of(cls, solved: SolvedBoard, tell: Callable[[], None] | None = None) -> DrawnPairs:
        """Draw and solve them; `tell` is called after each pair.

        Raises
        ------
        ArgumentError
            The board has no room for two fingers.
        """
        places = finger_sets(
            solved.board, FINGERS, SETS, solved.board.fingers_apart, np.random.default_rng(SEED)
        )
        stiffness = pressing_stiffness(PRESS, solved.fields.frequency_hz)
        sets = []
        with one_blas_thread():
            for one in FingerSet.of_all(solved, places, stiffness):
                sets.append(one)
                if tell:
                    tell()
        known = responses_at(solved)
        board = solved.board
        return cls(board, known, sets, _rows(board, sets, known)[:, 0])

    def rows(self, plate: KnownPlate) -> FloatArray:
        """With drives of what a plate says of itself, as of `rows_of`; shape (fingers, 4)."""
        return _rows(self.board, self.sets, plate)


def _rows(board: Board, sets: list[FingerSet], plate: KnownPlate) -> FloatArray:
    solve, forces = solver_of(board, plate, None), np.ones(len(board.actuators))
    return np.concatenate([rows_of(board, one, solve(one.places), forces) for one in sets])


def lost_db(exact: FloatArray, got: FloatArray) -> float:
    """Isolation lost at the median or at the 10th percentile, whichever is more."""
    one, other = Spread.of(exact.tolist()), Spread.of(got.tolist())
    return max(one.median - other.median, one.p10 - other.p10)
