"""Files that a page asks for: its board, or the table that plays."""

from __future__ import annotations

import base64
from typing import Any

from chladni.host.studio.boards.prepared import Prepared, ReadyBoard
from chladni.sim.board.writing import board_file
from chladni.sim.errors import InputError, MissingError
from chladni.tables.format import pack


def file_message(shown: Prepared | None, what: str) -> dict[str, Any]:
    """A file for the page to hand to its user.

    Parameters
    ----------
    shown
        The board of the page; None while it is made ready.
    what
        "board" or "table".

    Raises
    ------
    MissingError
        No board is shown yet.
    InputError
        The board has no table.
    """
    if shown is None:
        raise MissingError("board", "none is shown yet")
    if what == "board":
        name, data = f"{shown.board.name}.toml", board_file(shown.board)
    elif isinstance(shown, ReadyBoard):
        name, data = f"{shown.board.name}.chl", pack(shown.table)
    else:
        raise InputError("table", "a board with parts that were moved", "a board with a table")
    return {"type": "file", "name": name, "data": base64.b64encode(data).decode("ascii")}
