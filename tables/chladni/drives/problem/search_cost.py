"""What a search and a score on a board's image take, beside the plate itself."""

from __future__ import annotations

import math
from dataclasses import replace

from chladni.sim.board.board import Board
from chladni.sim.board.parts import Image
from chladni.sim.board.quantity import MM
from chladni.sim.cost import Cost

BYTES, BYTES_PER_COIL, BYTES_OF_FOCUS = 500.0, 128.0, 2600.0
"""For each image point: eight copies of a field for each coil, an image's windows, and for a focus
the points of all the discs in which a second finger could lie. Measured for 5 and 16 coils on
images of 40,000 to 1,300,000 points: within a factor of two of what is taken at the peak, `compare`
and `board score` included."""
SECONDS, SECONDS_PER_COIL, TIMES_OF_FOCUS = 1e-5, 1.4e-6, 1.5
"""For each image point of a search and its score, on one core."""
BYTES_OF_FIELD, SECONDS_OF_FIELD = 116.0, 2e-6
"""For each image point: complex responses at the points, their image and what is written of both.
Measured on images of 8 and 24 million points. Of 2 million points 2 s went into the field, and 1.5
into the compressed file."""
LARGE = 200_000
"""Points from which on the search takes seconds."""


def for_focus(board: Board) -> Board:
    """The board with an image that is fine enough for a focus, where its own is larger.

    A focus is found and scored by means over fingertips: its image is one of the scorecard's
    pictures only, and the usual one shows it as well.
    """
    if math.prod(board.image.points) <= LARGE:
        return board
    usual = Image.usual([side / MM for side in board.plate.size])
    is_less = math.prod(usual.points) < math.prod(board.image.points)
    return replace(board, image=usual) if is_less else board


def for_objective(board: Board, objective: str) -> Board:
    """The same where drives are best at a focus; of other drives images are what they are for."""
    return for_focus(board) if objective == "focus" else board


def field_cost(board: Board) -> Cost:
    """What a field, its energy image and their file take, where nothing is searched on it."""
    points = math.prod(board.image.points)
    what = f"a field on {points:,} image points"
    return Cost(what, BYTES_OF_FIELD * points, SECONDS_OF_FIELD * points, "image.points")


def search_cost(board: Board, plate_bytes: float) -> Cost:
    """What a search for a drive takes, with the plate that it is on.

    Parameters
    ----------
    plate_bytes
        Of the solved plate.
    """
    points, coils = math.prod(board.image.points), len(board.actuators)
    is_focus = board.focus is not None
    each = BYTES + BYTES_PER_COIL * coils + BYTES_OF_FOCUS * is_focus
    seconds = points * (SECONDS + SECONDS_PER_COIL * coils)
    seconds *= TIMES_OF_FOCUS if is_focus else 1.0
    return Cost(
        f"a search on {points:,} image points",
        plate_bytes + each * points,
        seconds if points > LARGE else 0.0,
        "image.points",
    )
