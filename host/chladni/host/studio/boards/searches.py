"""Searches for a board: a page begins, watches and stops one, and opens boards that it found.

The boards are looked at by other processes, so presses go on meanwhile.
"""

from __future__ import annotations

import asyncio
import os
import threading
from dataclasses import replace
from typing import Any

from chladni.design.evaluate import completed_board
from chladni.design.front import Entry, front_of, shown_goals
from chladni.design.search import design
from chladni.design.spec import Spec
from chladni.design.weights import FINGER_CLICK
from chladni.host.studio.boards.prepared import BoardChoice, page_objective
from chladni.host.studio.messages.sender import Sender
from chladni.sim.errors import ChladniError, InputError, StoppedError

MOST_EVALUATIONS = 500
"""Of a search on a page: some ten minutes on two cores. `chladni design` has no such limit."""
SAMPLES = 8
"""Random boards by which the last few are compared, in place of the command's 32."""
TOLD_S = 0.5


class Search:
    """One search, in a thread that waits for processes.

    Attributes
    ----------
    entries
        Boards so far that keep the limits. Those of the result, scored with more random boards,
        come last.
    front
        Which of them no other one beats in every goal, the best score first.
    state
        "running", "stopped", "done", or what went wrong.
    """

    def __init__(self, name: str, spec: Spec, jobs: int | None) -> None:
        evaluations = min(spec.settings.evaluations, MOST_EVALUATIONS)
        self._spec = replace(spec, settings=replace(spec.settings, evaluations=evaluations))
        # With one job the work would be done in this process, and hold up its presses.
        self._jobs = max(jobs or os.cpu_count() or 1, 2)
        self._is_stopped = False
        self.name, self.state = name, "running"
        self.done, self.all = 0, evaluations
        self.entries: tuple[Entry, ...] = ()
        self.front: tuple[int, ...] = ()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    @property
    def is_running(self) -> bool:
        """Whether it still uses the cores."""
        return self.state == "running"

    def stop(self) -> None:
        """Look at no more boards; it ends within the one it is at."""
        self._is_stopped = True

    def close(self) -> None:
        """Stop it and wait for its end."""
        self.stop()
        self._thread.join()

    def _run(self) -> None:
        # Told once the processes have been let go: another search may begin then.
        self.state = self._searched()

    def _searched(self) -> str:
        """Search to the end or until it is stopped; the state after that."""
        try:
            found = design(
                self._spec,
                jobs=self._jobs,
                samples=SAMPLES,
                progress=self._tell,
                on_board=self._keep,
            )
        except StoppedError:
            return "stopped"
        except ChladniError as error:
            return str(error)
        except BaseException as error:
            self.state = f"{type(error).__name__}: {error}"
            raise
        first = len(self.entries)
        self.entries += found.front
        self.front = tuple(range(first, len(self.entries)))
        return "done"

    def _tell(self, done: int, _: int) -> None:
        self.done = min(done, self.all)  # boards that are compared again are no more boards
        if self._is_stopped:
            raise StoppedError("not wanted any more")

    def _keep(self, entry: Entry, _: bool) -> None:
        entries = (*self.entries, entry)
        order = {id(one): number for number, one in enumerate(entries)}
        self.front = tuple(order[id(one)] for one in front_of(entries))
        self.entries = entries


class Searches:
    """The searches of all pages, of which one runs at a time: it takes all cores."""

    def __init__(self, jobs: int | None = None) -> None:
        self._jobs = jobs
        self._latest: Search | None = None

    def begin(self, name: str, spec: Spec) -> Search:
        """Begin a search.

        Raises
        ------
        InputError
            Another one runs.
        """
        if self._latest is not None and self._latest.is_running:
            expected = "one at a time, and this or another page's still runs"
            raise InputError("design", name, expected, hint="stop it, or wait")
        self._latest = Search(name, spec, self._jobs)
        return self._latest

    def close(self) -> None:
        """Stop what runs."""
        if self._latest is not None:
            self._latest.close()


class PageSearch:
    """One page's search.

    Parameters
    ----------
    searches
        Shared by all pages.
    sender
        To the page.
    """

    def __init__(self, searches: Searches, sender: Sender) -> None:
        self._searches, self._sender = searches, sender
        self._search: Search | None = None
        self._has_begun = asyncio.Event()

    def begin(self, name: str, spec: Spec) -> None:
        """Begin a search, as `Searches.begin`."""
        self._search = self._searches.begin(name, spec)
        self._has_begun.set()

    def stop(self) -> None:
        """End it; what it found stays."""
        if self._search is not None:
            self._search.stop()

    def taken(self, index: int) -> BoardChoice:
        """A board that it found, for the board's own objective.

        Raises
        ------
        InputError
            There is none of that number.
        """
        entries = self._search.entries if self._search else ()
        if index >= len(entries):
            raise InputError("index", index, f"one of the {len(entries)} boards that were found")
        board = completed_board(entries[index].document)
        return BoardChoice(board, page_objective(board))

    async def follow(self) -> None:
        """Tell the page how each search goes, until cancelled."""
        while True:
            await self._has_begun.wait()
            self._has_begun.clear()
            search, told = self._search, None
            while search is not None and search is self._search:
                is_over = not search.is_running
                now = len(search.entries), search.done, search.state
                if now != told:
                    told = now
                    await self._sender.send(_message(search))
                if is_over:
                    break
                await asyncio.sleep(TOLD_S)


def _message(search: Search) -> dict[str, Any]:
    """How a design goes: a point for each board that it found, and which of them are the front."""
    summaries = [entry.summary for entry in search.entries]
    fingers, apart, um = shown_goals(summaries)
    keys = (um, apart, "coils", "robust_score")
    rows = [[summary.get(key) for key in keys] for summary in summaries]
    return {
        "type": "search",
        "name": search.name,
        "state": search.state,
        "done": search.done,
        "all": search.all,
        "fingers": fingers,
        "clicks": apart == FINGER_CLICK,
        "columns": list(keys),
        "boards": rows,
        "front": list(search.front),
    }
