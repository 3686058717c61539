"""What one set of fingers gets all over a board, for figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet, pressed_fields
from chladni.drives.scoring.several_fingers.kept_apart import most_newtons
from chladni.drives.scoring.tolerances import Drawn
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image.finger import PRESS, pressing_stiffness

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class FingersPlay:
    """What fingers get that play all at once, limits kept for the sum.

    Attributes
    ----------
    places_mm
        Their middles.
    levels_db
        Amplitude of each finger's own signal all over the board, all fingers pressing, over that
        under the finger, shape (fingers, x, y).
    isolation_db
        Each one's signal over the most that another finger has of it, shape (fingers,).
    finger_um
        Mean over the fingertip of its own signal, peak in time, shape (fingers,); NaN without a
        coil.
    """

    board: Board
    places_mm: list[tuple[float, float]]
    levels_db: FloatArray
    isolation_db: FloatArray
    finger_um: FloatArray


def fingers_play(
    board: Board,
    places: FloatArray,
    drives: ComplexArray,
    newtons: float = PRESS,
    on: Drawn | None = None,
) -> FingersPlay:
    """Look at what drives make of fingers that press.

    Parameters
    ----------
    places
        Middles of the fingertips, m, shape (fingers, 2).
    drives
        Of each finger, any common scale, shape (fingers, actuators).
    newtons
        How hard each presses.
    on
        The plate that fingers are on and what its coils do; `board` is what the device knows, which
        keeps its limits. The board itself by default.
    """
    on = on or Drawn(board, np.ones(len(board.actuators)))
    solved, most = solved_board(on.board), most_newtons(board, drives)
    drives = drives * on.forces
    stiffness = pressing_stiffness(newtons, solved.fields.frequency_hz)
    fingers = FingerSet.of(solved, places, stiffness)
    fields = np.abs(np.tensordot(drives, pressed_fields(solved, places, stiffness), axes=1))
    own = np.abs(np.diag(fingers.means(drives)))
    tiny = 1e-300
    return FingersPlay(
        on.board,
        [(float(x / MM), float(y / MM)) for x, y in places],
        20.0 * np.log10(np.maximum(fields, tiny) / np.maximum(own, tiny)[:, None, None]),
        fingers.isolation_db(drives),
        own * (np.nan if most is None else most / MICROMETRE),
    )
