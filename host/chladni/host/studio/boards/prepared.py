"""What a page has chosen to play, and that board once its plate is solved and its table built."""

from __future__ import annotations

from dataclasses import dataclass

from chladni.drives.methods import Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.search_cost import for_objective
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError, check_estimate
from chladni.sim.fields.transfer import TOLERANCE
from chladni.tables.build import build_table
from chladni.tables.several_fingers.build import with_responses
from chladni.tables.table import Table

TABLE_METHOD = "phasor"
"""Of which tables are built; drives of another one are computed at each press."""


@dataclass(frozen=True)
class BoardChoice:
    """What a page plays: a board, what its drives are best at, and the method that finds them.

    Choices are equal if their boards are equal in every value.
    """

    board: Board
    objective: str
    method: str = TABLE_METHOD


@dataclass(frozen=True)
class Prepared:
    """A board with its plate solved."""

    choice: BoardChoice
    solved: SolvedBoard

    @classmethod
    def of(cls, choice: BoardChoice) -> Prepared:
        """Solve a board's plate.

        Raises
        ------
        ToleranceError
            Its fields may be wrong by more than 5 %.
        """
        solved = solved_board(for_objective(choice.board, choice.objective))
        check_estimate(solved.fields.error_estimate, TOLERANCE, allow_unmet=True)
        return cls(choice, solved)

    @property
    def board(self) -> Board:
        """The board."""
        return self.choice.board


@dataclass(frozen=True)
class ReadyBoard(Prepared):
    """A board with its plate solved and its table built."""

    table: Table

    @property
    def follows_several(self) -> bool:
        """Whether a device with the table gives each of several fingers a signal of its own."""
        return bool(self.table.responses)

    @classmethod
    def of(
        cls, choice: BoardChoice, *, jobs: int | None = None, progress: Progress | None = None
    ) -> ReadyBoard:
        """Solve a board's plate and build its table, with responses if there is room for them.

        Parameters
        ----------
        jobs
            Threads; all cores by default.
        progress
            Called as progress(done, all), of regions and then of pairs of fingers.
        """
        solved = Prepared.of(choice).solved
        table, _ = build_table(
            choice.board, objective=choice.objective, jobs=jobs, progress=progress, allow_unmet=True
        )
        return cls(choice, solved, _for_several(choice.board, table, progress))


def _for_several(board: Board, table: Table, progress: Progress | None) -> Table:
    """A table with responses besides its drives; as it was on a board without room for them."""
    try:
        both, _ = with_responses(
            table,
            board,
            frequencies_hz=[table.sections[0].frequency_hz],
            bits=table.bits,  # wider integers are tried otherwise, and a page would wait for them
            progress=progress,
            allow_unmet=True,
        )
    except InputError:
        return table
    return both
