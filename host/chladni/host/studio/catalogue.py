"""Boards that a page may choose by name, and one from the text of a file."""

from __future__ import annotations

from dataclasses import replace

from chladni.host.studio.requests import Choose, Open
from chladni.host.studio.workshop import Choice
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board, parse_board, shipped_boards
from chladni.sim.errors import InputError

MOST_NAME = 80
"""Characters of a dropped file's name that are shown."""


class Catalogue:
    """The shipped boards and the one the studio was started with."""

    def __init__(self, first: Choice) -> None:
        self.first = first
        self._shipped = shipped_boards()

    @property
    def names(self) -> list[str]:
        """In the order they are offered."""
        return list(dict.fromkeys([self.first.board.name, *self._shipped]))

    def chosen(self, request: Choose, shown: Board) -> Choice:
        """The board of a request, at its frequency.

        Parameters
        ----------
        shown
            The one the page has now, which a request without a name means.

        Raises
        ------
        InputError
            No such board, or a frequency it cannot be driven at. No other file can be named.
        """
        board = shown if request.board is None else self._board(request.board)
        if request.frequency_hz is not None:
            board = replace(board, drive=replace(board.drive, frequency_hz=request.frequency_hz))
        return Choice(board, request.objective)

    def opened(self, request: Open, objective: str) -> Choice:
        """The board of a dropped file.

        Raises
        ------
        InputError
            What is wrong with it, by file, key and value.
        """
        return Choice(parse_board(request.text, file=request.name[:MOST_NAME]), objective)

    def _board(self, name: str) -> Board:
        if name == self.first.board.name:
            return self.first.board
        if name not in self._shipped:
            raise InputError("board", name, "one of: " + ", ".join(self.names))
        return load_board(self._shipped[name])
