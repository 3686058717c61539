"""The board that a table was made for: a file, or a shipped board of the table's name."""

from __future__ import annotations

import tomllib
from pathlib import Path

from chladni.sim.board.board import Board, fingerprint_text, is_of
from chladni.sim.board.file import MOST_BYTES, load_board, shipped_boards
from chladni.sim.errors import InputError, MissingArgumentError
from chladni.sim.files import read_text
from chladni.tables.table import Table, limits_of


def board_for(table: Table, board: str | Path | None = None, *, file: str | None = None) -> Board:
    """The board a table was made for.

    Parameters
    ----------
    board
        Path of a board file, or a shipped name; by default what `known_board` finds.
    file
        The table's file, for errors.

    Raises
    ------
    InputError
        No such board, or the table was made for another.
    """
    board = board or known_board(table, file)
    if board is None:
        what = f"{table.board_name!r} is no shipped board, and no {table.board_name}.toml is beside"
        raise MissingArgumentError("board", f"{what} the table")
    found = load_board(board)
    if len(found.actuators) != table.actuators:
        expected = f"{len(found.actuators)}, the actuators of board {found.name!r}"
        hint = "name the table's board by --board"
        raise InputError("actuators", table.actuators, expected, file=file, hint=hint)
    if not _is_its_board(table, found):
        raise _another(table, found, file)
    return found


def _another(table: Table, board: Board, file: str | None) -> InputError:
    """What is said of a table that is not this board's."""
    expected = f"{board.fingerprint():#018x}, that of board {board.name!r}"
    hint = "name the board that it was built for, or build it again for this one"
    if board.name == table.board_name:
        # A measured board keeps the drawn one's name.
        expected += " as it was measured" if board.measured is not None else " as its file is now"
        hint = "the table was built for another version of that file: build it again for this one"
    given = fingerprint_text(table.board_fingerprint)
    return InputError("board_fingerprint", given, expected, file=file, hint=hint)


def known_board(table: Table, file: str | None) -> str | Path | None:
    """What names a table's board: a shipped one's name, or its file beside the table's.

    A file beside is of the table's own name, or of the board's; a SPEC of a design is none. Where
    there are several, it is the first that the table was made for: a measured board keeps the name
    of a shipped one.
    """
    found: list[str | Path] = []
    if table.board_name in shipped_boards():
        found.append(table.board_name)
    if file is not None:
        own = Path(file)
        beside = dict.fromkeys(
            (own.with_suffix(".toml"), own.with_name(f"{table.board_name}.toml"))
        )
        found += [path for path in beside if path.is_file() and not _is_spec(path)]
    if len(found) > 1:
        return next((one for one in found if _is_of(table, one)), found[0])
    return found[0] if found else None


def _is_of(table: Table, board: str | Path) -> bool:
    try:
        return _is_its_board(table, load_board(board))
    except InputError:
        return False


def _is_spec(path: Path) -> bool:
    """Whether a file has a block that no board has; one that cannot be read is a board's."""
    try:
        return "design" in tomllib.loads(read_text(path, "board", MOST_BYTES))
    except (InputError, tomllib.TOMLDecodeError):
        return False


def _is_its_board(table: Table, board: Board) -> bool:
    if is_of(table.board_fingerprint, board.fingerprint()):
        return True
    # Of 0.2.0: as far as it tells, and the header's limits besides.
    is_earlier = table.board_fingerprint == board.fingerprint_of_0_2()
    return is_earlier and table.limits == limits_of(board)
