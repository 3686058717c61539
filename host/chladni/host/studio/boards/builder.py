"""Boards made ready for pages, in the background: plate solved and table built, once each."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from dataclasses import dataclass

from chladni.drives.methods import Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.host.studio.boards.search import Searches
from chladni.sim.board.board import Board
from chladni.sim.errors import ChladniError, StoppedError, check_estimate
from chladni.sim.fields.transfer import TOLERANCE
from chladni.tables.build import build_table
from chladni.tables.table import Table

TABLE_METHOD = "phasor"
"""Of which tables are built; drives of another one are computed at each press."""
MOST_KEPT = 8
"""Boards with their tables; 0.1 GB each of the shipped ones. The one asked for longest ago goes."""


@dataclass(frozen=True)
class Choice:
    """What a page plays: a board, what its drives are best at, and the method that finds them."""

    board: Board
    objective: str
    method: str = TABLE_METHOD

    @property
    def key(self) -> tuple[object, ...]:
        """Equal for boards that are equal in every value."""
        return self.board, self.objective, self.method


@dataclass(frozen=True)
class Prepared:
    """A board with its plate solved."""

    choice: Choice
    solved: SolvedBoard

    @classmethod
    def of(cls, choice: Choice) -> Prepared:
        """Solve a board's plate.

        Raises
        ------
        ToleranceError
            Its fields may be wrong by more than 5 %.
        """
        solved = solved_board(choice.board)
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

    @classmethod
    def of(
        cls, choice: Choice, *, jobs: int | None = None, progress: Progress | None = None
    ) -> ReadyBoard:
        """Solve a board's plate and build its table.

        Parameters
        ----------
        jobs
            Threads; all cores by default.
        progress
            Called as progress(done regions, all regions).
        """
        solved = Prepared.of(choice).solved
        table, _ = build_table(
            choice.board, objective=choice.objective, jobs=jobs, progress=progress,
            allow_unmet=True,
        )  # fmt: skip
        return cls(choice, solved, table)


@dataclass
class Making:
    """A board that is being made ready; `done` of `all` regions have their drives.

    `pages` wait for it. When the last of them has gone elsewhere, it is made no further.
    """

    result: Future[Prepared]
    done: int = 0
    all: int = 0
    pages: int = 0
    is_given_up: bool = False


class Workshop:
    """Makes boards ready, one at a time, and keeps the last ones.

    Parameters
    ----------
    jobs
        Threads of a table's build, and processes of a design; all cores by default.

    Attributes
    ----------
    searches
        Designs that pages have begun.
    """

    def __init__(self, jobs: int | None = None) -> None:
        self._jobs = jobs
        self.searches = Searches(jobs)
        self._made: dict[tuple[object, ...], Making] = {}
        self._lock, self._turn = threading.Lock(), threading.Lock()
        self._threads: list[threading.Thread] = []
        self._is_closed = False

    def make(self, choice: Choice) -> Making:
        """A board that is ready or will be; its future holds the error if there is one.

        Whoever asks for it waits for it, until `leave`.
        """
        with self._lock:
            making = self._made.pop(choice.key, None)
            if making is None or making.is_given_up or _has_failed(making):
                making = Making(Future())
                self._begin(choice, making)
            self._made[choice.key] = making
            making.pages += 1
            for key in list(self._made)[:-MOST_KEPT]:
                del self._made[key]
            return making

    def keep(self, ready: Prepared) -> None:
        """A board that is ready already."""
        making = Making(Future(), pages=1)
        making.result.set_result(ready)
        self._made[ready.choice.key] = making

    def leave(self, making: Making) -> None:
        """One page waits no longer."""
        with self._lock:
            making.pages -= 1
            making.is_given_up = making.pages == 0 and not making.result.done()

    def close(self) -> None:
        """Stop what is being made, and wait until it has: a plate is solved to its end."""
        self._is_closed = True
        self.searches.close()
        for thread in self._threads:
            thread.join()

    def _begin(self, choice: Choice, making: Making) -> None:
        self._threads = [thread for thread in self._threads if thread.is_alive()]
        self._threads.append(threading.Thread(target=self._run, args=(choice, making)))
        self._threads[-1].start()

    def _run(self, choice: Choice, making: Making) -> None:
        try:
            with self._turn:
                making.result.set_result(self._made_ready(choice, making))
        except ChladniError as error:
            making.result.set_exception(error)
        except BaseException as error:
            making.result.set_exception(
                ChladniError(
                    f"{type(error).__name__}: {error}",
                    hint="this is a fault of the studio, and its terminal has more",
                )
            )
            raise

    def _made_ready(self, choice: Choice, making: Making) -> Prepared:
        def tell(done: int, of_all: int) -> None:
            making.done, making.all = done, of_all
            if self._is_closed or making.is_given_up:
                raise StoppedError("not wanted any more")

        tell(0, 0)
        if choice.method == TABLE_METHOD:
            made: Prepared = ReadyBoard.of(choice, jobs=self._jobs, progress=tell)
        else:
            made = Prepared.of(choice)
        _ = made.solved.second_fingers  # made here, so that the first press need not wait for it
        return made


def _has_failed(making: Making) -> bool:
    return making.result.done() and making.result.exception() is not None
