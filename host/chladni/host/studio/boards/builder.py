"""Boards made ready for pages, in the background: plate solved and table built, once each."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from dataclasses import dataclass

from chladni.host.studio.boards.prepared import TABLE_METHOD, BoardChoice, Prepared, ReadyBoard
from chladni.host.studio.boards.searches import Searches
from chladni.sim.errors import ChladniError, StoppedError

MOST_KEPT = 8
"""Boards with their tables; 0.1 GB each of the shipped ones. The one asked for longest ago goes."""


@dataclass
class BoardBuild:
    """A board that is being made ready; `done` of `all` regions have their drives.

    `pages` wait for it. When the last of them has gone elsewhere, it is made no further.
    """

    result: Future[Prepared]
    done: int = 0
    all: int = 0
    pages: int = 0
    is_given_up: bool = False


class BoardBuilder:
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
        self._builds: dict[BoardChoice, BoardBuild] = {}
        self._lock, self._turn = threading.Lock(), threading.Lock()
        self._threads: list[threading.Thread] = []
        self._is_closed = False

    def build(self, choice: BoardChoice) -> BoardBuild:
        """A board that is ready or will be; its future holds the error if there is one.

        Whoever asks for it waits for it, until `leave`.
        """
        with self._lock:
            build = self._builds.pop(choice, None)
            if build is None or build.is_given_up or _has_failed(build):
                build = BoardBuild(Future())
                self._begin(choice, build)
            self._builds[choice] = build
            build.pages += 1
            for key in list(self._builds)[:-MOST_KEPT]:
                del self._builds[key]
            return build

    def keep(self, ready: Prepared) -> None:
        """A board that is ready already."""
        build = BoardBuild(Future(), pages=1)
        build.result.set_result(ready)
        self._builds[ready.choice] = build

    def leave(self, build: BoardBuild) -> None:
        """One page waits no longer."""
        with self._lock:
            build.pages -= 1
            build.is_given_up = build.pages == 0 and not build.result.done()

    def close(self) -> None:
        """Stop what is being made, and wait until it has: a plate is solved to its end."""
        self._is_closed = True
        self.searches.close()
        for thread in self._threads:
            thread.join()

    def _begin(self, choice: BoardChoice, build: BoardBuild) -> None:
        self._threads = [thread for thread in self._threads if thread.is_alive()]
        self._threads.append(threading.Thread(target=self._run, args=(choice, build)))
        self._threads[-1].start()

    def _run(self, choice: BoardChoice, build: BoardBuild) -> None:
        try:
            with self._turn:
                build.result.set_result(self._built(choice, build))
        except ChladniError as error:
            build.result.set_exception(error)
        except BaseException as error:
            build.result.set_exception(
                ChladniError(
                    f"{type(error).__name__}: {error}",
                    hint="this is a fault of the studio, and its terminal has more",
                )
            )
            raise

    def _built(self, choice: BoardChoice, build: BoardBuild) -> Prepared:
        def tell(done: int, of_all: int) -> None:
            build.done, build.all = done, of_all
            if self._is_closed or build.is_given_up:
                raise StoppedError("not wanted any more")

        tell(0, 0)
        if choice.method == TABLE_METHOD:
            made: Prepared = ReadyBoard.of(choice, jobs=self._jobs, progress=tell)
        else:
            made = Prepared.of(choice)
        _ = made.solved.second_fingers  # made here, so that the first press need not wait for it
        return made


def _has_failed(build: BoardBuild) -> bool:
    return build.result.done() and build.result.exception() is not None
