"""What a page has chosen to play, and that board once its plate is solved and its table built."""

from __future__ import annotations

from dataclasses import dataclass

from chladni.drives.methods import Progress
from chladni.drives.objectives import default_objective
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.search_cost import for_objective
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError, check_estimate
from chladni.sim.fields.transfer import TOLERANCE
from chladni.tables.build import build_table
from chladni.tables.several_fingers.build import responses_table, with_responses
from chladni.tables.table import Table

TABLE_METHOD = "phasor"
"""Of which tables are built; drives of another one are computed at each press."""
LOUDEST = "loudest"
"""In place of an objective, of tables without drives: a device then plays one finger the loudest
drive."""


def page_objective(board: Board) -> str:
    """What a page shows of a board unless something else is asked for: what its device plays."""
    return LOUDEST if board.is_for_several else default_objective(board)


@dataclass(frozen=True)
class BoardChoice:
    """What a page plays: a board, what its drives are best at, and the method that finds them.

    `objective` may be `LOUDEST`, with the method of tables.

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

    @property
    def frequency_hz(self) -> float:
        """Of the table."""
        return (self.table.sections or self.table.responses)[0].frequency_hz

    @classmethod
    def of(
        cls, choice: BoardChoice, *, jobs: int | None = None, progress: Progress | None = None
    ) -> ReadyBoard:
        """Solve a board's plate and build its table, with responses if there is room for them.

        A choice of the loudest drives has responses alone.

        Parameters
        ----------
        jobs
            Threads; all cores by default.
        progress
            Called as progress(done, all), of regions and then of pairs of fingers.
        """
        solved = Prepared.of(choice).solved
        if choice.objective == LOUDEST:
            own, _ = responses_table(
                choice.board,
                frequencies_hz=[choice.board.drive.frequency_hz],
                progress=progress,
                allow_unmet=True,
            )
            return cls(choice, solved, own)
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
