"""Mirror symmetry of a board: which actuator takes the place of which."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chladni.sim.board.board import Board
from chladni.sim.board.quantity import SAME_PLACE
from chladni.sim.fields.board_plate import plate_geometry
from chladni.sim.ritz.basis.parity import find_mirrors


@dataclass(frozen=True)
class BoardMirrors:
    """For each mirror the board has, the actuator that stands where each one's image falls.

    `x` is the permutation of x → −x, `y` that of y → −y; None where the board has no such mirror.
    A field driven by c, mirrored, is the field driven by c[permutation].
    """

    x: tuple[int, ...] | None
    y: tuple[int, ...] | None


def board_mirrors(board: Board) -> BoardMirrors:
    """The mirrors of a board; nothing is assumed."""
    return BoardMirrors(_permutation(board, -1.0, 1.0), _permutation(board, 1.0, -1.0))


def _permutation(board: Board, sign_x: float, sign_y: float) -> tuple[int, ...] | None:
    places = np.array([actuator.at for actuator in board.actuators])
    order = _matches(places, places * (sign_x, sign_y))
    dead = [actuator.is_dead for actuator in board.actuators]
    if order is None or [dead[k] for k in order] != dead:
        return None
    mirrors = find_mirrors(plate_geometry(board))
    if not (mirrors.x if sign_x < 0 else mirrors.y):
        return None
    return order


def _matches(places: np.ndarray, images: np.ndarray) -> tuple[int, ...] | None:
    distance = np.linalg.norm(images[:, None] - places, axis=2)
    nearest = distance.argmin(axis=1)
    if distance.min(axis=1).max(initial=0.0) > SAME_PLACE:
        return None
    if len(set(nearest.tolist())) != len(places):
        return None
    return tuple(int(k) for k in nearest)
