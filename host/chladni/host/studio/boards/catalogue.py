"""Boards and SPECs that a page may choose by name, or give by the text of a file."""

from __future__ import annotations

from dataclasses import replace

from chladni.design.spec import Spec, parse_spec, read_spec
from chladni.drives.methods import SEED
from chladni.drives.objectives import objective_of
from chladni.drives.solve import check_request
from chladni.host.studio.boards.prepared import TABLE_METHOD, BoardChoice, page_objective
from chladni.host.studio.messages.requests import Begin, Choose, Open
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board, parse_board, shipped_boards, shipped_specs
from chladni.sim.errors import ArgumentError, InputError

MOST_NAME = 80
"""Characters of a dropped file's name that are shown."""


class Catalogue:
    """The shipped boards and SPECs, and the board the studio was started with."""

    def __init__(self, first: BoardChoice) -> None:
        self.first = first
        self._shipped, self._specs = shipped_boards(), shipped_specs()

    @property
    def names(self) -> list[str]:
        """In the order they are offered."""
        return list(dict.fromkeys([self.first.board.name, *self._shipped]))

    @property
    def specs(self) -> list[str]:
        """Designs that can be asked for by name."""
        return list(self._specs)

    def chosen(self, request: Choose, shown: Board) -> BoardChoice:
        """The board of a request, at its frequency.

        Parameters
        ----------
        shown
            The one the page has now, which a request without a name means.

        Raises
        ------
        InputError
            No such board, a frequency it cannot be driven at, or an objective that the method does
            not have. No other file can be named.
        """
        board = shown if request.board is None else self._board(request.board)
        if request.frequency_hz is not None:
            board = replace(board, drive=replace(board.drive, frequency_hz=request.frequency_hz))
        check_request(request.method, request.objective or "ssim", SEED, None, None)
        is_of_tables = request.method == TABLE_METHOD
        own = page_objective(board) if is_of_tables else objective_of(board, request.method)
        return BoardChoice(board, request.objective or own, request.method)

    def asked(self, request: Begin) -> tuple[str, Spec]:
        """A design's name and its SPEC.

        Raises
        ------
        InputError
            No such SPEC, or what is wrong with it, by file, key and value.
        """
        name = request.name[:MOST_NAME]
        if request.text is not None:
            return name, parse_spec(request.text, file=name)
        if name not in self._specs:
            raise ArgumentError("spec", name, "one of: " + ", ".join(self._specs))
        return name, read_spec(self._specs[name])

    def opened(self, request: Open) -> BoardChoice:
        """The board of a dropped file.

        Raises
        ------
        InputError
            What is wrong with it, by file, key and value.
        """
        board = parse_board(request.text, file=request.name[:MOST_NAME])
        return BoardChoice(board, page_objective(board))

    def _board(self, name: str) -> Board:
        if name == self.first.board.name:
            return self.first.board
        if name not in self._shipped:
            raise InputError("board", name, "one of: " + ", ".join(self.names))
        return load_board(self._shipped[name])
