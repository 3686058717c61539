"""The board that a table was made for: a file, or a shipped board of the table's name."""

from __future__ import annotations

from pathlib import Path

from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board, shipped_boards
from chladni.sim.errors import InputError, MissingArgumentError
from chladni.tables.table import Table


def board_for(table: Table, board: str | Path | None = None, *, file: str | None = None) -> Board:
    """The board a table was made for.

    Parameters
    ----------
    board
        Path of a board file, or a shipped name; by default the shipped board of the table's name.
    file
        The table's file, for errors.

    Raises
    ------
    InputError
        No such board, or the table was made for another.
    """
    if board is None and table.board_name not in shipped_boards():
        raise MissingArgumentError("board", f"{table.board_name!r} is not a shipped board")
    found = load_board(board or table.board_name)
    if len(found.actuators) != table.actuators:
        expected = f"{len(found.actuators)}, the actuators of board {found.name!r}"
        raise InputError("actuators", table.actuators, expected, file=file)
    if found.fingerprint() != table.board_fingerprint:
        expected = f"{found.fingerprint():#018x}, that of board {found.name!r}"
        raise InputError(
            "board_fingerprint", f"{table.board_fingerprint:#018x}", expected, file=file
        )
    return found
