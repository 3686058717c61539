"""The board that a table was made for: a file, or a shipped board of the table's name."""

from __future__ import annotations

from pathlib import Path

from chladni.sim.board.board import Board, is_of
from chladni.sim.board.file import load_board, shipped_boards
from chladni.sim.errors import InputError, MissingArgumentError
from chladni.tables.table import Table, limits_of


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
    if not _is_its_board(table, found):
        expected = f"{found.fingerprint():#018x}, that of board {found.name!r}"
        raise InputError(
            "board_fingerprint",
            f"{table.board_fingerprint:#018x}",
            expected,
            file=file,
            hint="name the board that it was built for, or build it again for this one",
        )
    return found


def _is_its_board(table: Table, board: Board) -> bool:
    if is_of(table.board_fingerprint, board.fingerprint()):
        return True
    # Of 0.2.0: as far as it tells, and the header's limits besides.
    is_earlier = table.board_fingerprint == board.fingerprint_of_0_2()
    return is_earlier and table.limits == limits_of(board)
