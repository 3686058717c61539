"""A plate's outline with its round corners, and pictures that end there."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM

FloatArray = NDArray[np.float64]

CORNER_POINTS = 33
OUTLINE = "#222222"


def outline_of(board: Board, **look: Any) -> Polygon:
    """A plate's edge on axes in mm."""
    half, radius = np.array(board.plate.size) / 2.0 / MM, board.plate.corner_radius / MM
    turns = np.linspace(0.0, np.pi / 2.0, CORNER_POINTS)
    points = [
        np.array(signs) * (half - radius) + radius * np.transpose([np.cos(own), np.sin(own)])
        for own, signs in (
            (turns, (1, 1)),
            (turns + np.pi / 2.0, (-1, 1)),
            (turns + np.pi, (-1, -1)),
            (turns + 1.5 * np.pi, (1, -1)),
        )
    ]
    return Polygon(np.concatenate(points), closed=True, **look)


def clip_to_plate(axes: Axes, board: Board, *drawn: Artist) -> None:
    """Leave out what is drawn beyond round corners, where there is no plate."""
    if board.plate.corner_radius:
        outline = axes.add_patch(outline_of(board, facecolor="none", edgecolor=OUTLINE))
        for own in drawn:
            own.set_clip_path(outline)


def up_to_the_edge(board: Board, values: FloatArray) -> FloatArray:
    """Values, shape (nx, ny), with each point beyond a round corner like the nearest on the plate.

    Points of a grid make a jagged edge. A picture that is clipped at the outline has none then.
    """
    if not board.plate.corner_radius:
        return values
    radius, half = board.plate.corner_radius, np.array(board.plate.size) / 2.0
    x, y = (
        np.maximum(np.abs(along) - (side - radius), 0.0)
        for along, side in zip((board.x, board.y), half, strict=True)
    )
    is_beyond = np.hypot(x[:, None], y) > radius
    nearest = scipy.ndimage.distance_transform_edt(
        is_beyond, return_distances=False, return_indices=True
    )
    return np.asarray(values[tuple(nearest)])
