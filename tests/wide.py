"""Boards that lie on their long side."""

from __future__ import annotations

from dataclasses import replace

from chladni.sim.board.board import Board
from chladni.sim.board.parts import Image


def turned(board: Board) -> Board:
    """The board with x and y exchanged; without a panel, which does not turn with it."""
    return replace(
        board,
        plate=replace(board.plate, size=board.plate.size[::-1]),
        actuators=tuple(replace(one, at=one.at[::-1]) for one in board.actuators),
        screws=tuple(replace(one, at=one.at[::-1]) for one in board.screws),
        image=Image(board.image.points[::-1]),
        panel=None,
    )
