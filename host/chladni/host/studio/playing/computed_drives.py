"""A board without a table: each press is solved for by itself, and no device plays.

Parts can be moved on it. A table would take seconds to build each time, or has no such drives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from chladni.drives.methods import SEED, Options
from chladni.drives.solve import solve_problem
from chladni.host.studio.boards.prepared import LOUDEST, Prepared
from chladni.host.studio.messages.requests import Move, Place, Touch, Voice
from chladni.host.studio.playing.played import Played
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError

COMPUTED = "computed"
"""In place of a device's state."""


class ComputedDrives:
    """A board in the making, with fingers on it.

    Attributes
    ----------
    prepared
        The board as it is now, its plate solved.
    """

    def __init__(self, prepared: Prepared) -> None:
        self.prepared = prepared
        self._down: dict[int, Place] = {}

    def move(self, moves: Sequence[Move]) -> Prepared:
        """Put coils or screws elsewhere and solve the plate again.

        Raises
        ------
        InputError
            There is none of that number, or it may not be there. Nothing has moved then.
        """
        board = self.prepared.board
        for move in moves:
            board = _moved(board, move)
        self.prepared = Prepared.of(replace(self.prepared.choice, board=board))
        return self.prepared

    def apply(self, touches: Sequence[Touch | Voice]) -> Played | None:
        """Let fingers go down, move and lift; the first one's drive, None if none is left.

        What a finger plays is a device's, of which there is none.

        Raises
        ------
        InputError
            A place off the board.
        """
        down = dict(self._down)
        for touch in touches:
            if isinstance(touch, Voice):
                continue
            if touch.place_mm is None:
                down.pop(touch.finger, None)
            else:
                down[touch.finger] = touch.place_mm
        played = self.solve(next(iter(down.values()))) if down else None
        self._down = down
        return played

    def solve(self, place_mm: Place) -> Played:
        """The drive for a place.

        Raises
        ------
        InputError
            It is off the board.
        """
        problem = self.prepared.solved.problem(place_mm)
        choice = self.prepared.choice
        # The loudest drive is the method of time reversal's.
        is_loudest = choice.objective == LOUDEST
        method, objective = (
            ("time-reversal", "ssim") if is_loudest else (choice.method, choice.objective)
        )
        found = solve_problem(problem, method, Options(objective, SEED))
        return Played(place_mm, found.drive, None, COMPUTED)


def _moved(board: Board, move: Move) -> Board:
    parts = list(getattr(board, move.part))
    if move.index >= len(parts):
        raise InputError("index", move.index, f"one of the board's {len(parts)} {move.part}")
    x_mm, y_mm = move.place_mm
    parts[move.index] = replace(parts[move.index], at=(x_mm * MM, y_mm * MM))
    changed: dict[str, Any] = {move.part: tuple(parts)}
    return replace(board, **changed)
