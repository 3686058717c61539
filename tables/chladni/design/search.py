"""The search for a board: layouts by exchange, then all numbers together by CMA-ES.

CMA-ES (Hansen, "The CMA evolution strategy: a tutorial", 2016, by the library `cma`) needs no
derivatives and bears the corners that a 10th percentile has. All boards are compared on the same
draws of their tolerances, so a change of score is a change of the board. It goes generation by
generation, so its path does not depend on how many processes work; a search that was interrupted
goes the same path, and finds what it looked at before in its checkpoint.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from chladni.design.evaluate import Evaluation, judged
from chladni.design.front import Design, Entry, front_of
from chladni.design.last_boards import OnLast, OnPace, compared, last_boards
from chladni.design.pace import Pace
from chladni.design.remembered import name_of, remembered
from chladni.design.spec import Spec
from chladni.design.starts import (
    KEPT,
    Point,
    boards_asked,
    check_boards,
    chosen,
    document_at,
    every_point,
    layouts_of,
    spread_numbers,
)
from chladni.design.strategy import DRAWN, fitting, strategy
from chladni.design.variables import Document, never_tried
from chladni.drives.checkpoint import Checkpoint, digest
from chladni.drives.methods import SEED, Progress
from chladni.drives.scoring.survey import SAMPLES
from chladni.drives.workers import Workers
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ArgumentError, InputError

STARTS = 2
AT_THE_START = 0.25
"""Share of it after which no more layouts are looked for."""
USED = "starts"
"""In the checkpoint, of a search whose time ended its layouts: how many rows of them it has."""
UNSEEN = -np.inf
"""Score of a board for which there was no time."""

OnBoard = Callable[[Entry, bool], None]


def design(
    spec: Spec,
    *,
    seed: int = SEED,
    jobs: int | None = None,
    scheduler: str | None = None,
    partial_file: Path | None = None,
    samples: int = SAMPLES,
    minutes: float | None = None,
    progress: Progress | None = None,
    on_board: OnBoard | None = None,
    on_pace: OnPace | None = None,
    on_last: OnLast | None = None,
    on_other: Callable[[], None] | None = None,
) -> Design:
    """Look for the board that answers a SPEC best.

    Parameters
    ----------
    jobs, scheduler
        Processes here, or a Dask scheduler's workers. The result does not depend on them.
    partial_file
        Checkpoint, with which a search goes on; it stays until `remove_checkpoint` is called.
    samples
        Random boards by which the last few are compared.
    minutes
        For all of it. The last few get fewer random boards where time is short; the best of them
        and the first layout are scored anyway. 0 ends a search with all random boards.
    progress
        Called with (done, all) after each layout and board; the last few count for `boards_more`,
        and `all` is less where there is no time for more. What it raises ends the search.
    on_board
        Called with each board that keeps the limits, and whether it is better than all before it.
    on_pace
        Called once it is known what boards take: how many it comes to, and seconds for each.
    on_last
        Called before the last few are compared: their number, random boards of each, and seconds.
    on_other
        Called first where the checkpoint has another search, which the first result replaces.

    Raises
    ------
    InputError
        No board can be what the SPEC asks for; names what stands in the way of the nearest.
    """
    started = time.perf_counter()
    check_boards(spec, seed)
    ends = np.inf if minutes is None else started + 60.0 * minutes
    # No board's own score depends on how many are looked at.
    alike = replace(spec, settings=replace(spec.settings, evaluations=1))
    key = {"search": digest(asdict(alike)), "seed": seed}
    with Workers(jobs, scheduler) as workers, Checkpoint(partial_file, key) as kept:
        if on_other and kept.has_other_work:
            on_other()
        pace = Pace(spec, samples, workers.jobs, boards_asked(spec), started, ends)
        run = _Run(spec, seed, pace, workers, kept, progress, on_board, on_pace)
        run.search()
        found = last_boards(run.allowed())
        draws = pace.draws(len(found)) if minutes else samples
        if on_last:
            on_last(len(found), draws, pace.seconds_to_compare(len(found), draws))
        before = min(run.looked_at, spec.settings.evaluations)
        until = ends if minutes else np.inf
        finished = compared(spec, seed, draws, workers, found, before, until, progress)
    best, full = max(finished, key=lambda pair: pair[0].evaluation.robust_score)
    front, took_s = front_of([one for one, _ in finished]), time.perf_counter() - started
    left_out = len(found) - len(finished)
    untried = run.never_tried()
    return Design(best, full, run.looked_at, front, took_s, seed, draws, left_out, untried)


class _Run:
    """One search: what was looked at, and how to look at more."""

    def __init__(
        self,
        spec: Spec,
        seed: int,
        pace: Pace,
        workers: Workers,
        kept: Checkpoint,
        progress: Progress | None,
        on_board: OnBoard | None,
        on_pace: OnPace | None,
    ) -> None:
        self._spec, self._seed, self._workers, self._kept = spec, seed, workers, kept
        self._pace, self._progress, self._on_board = pace, progress, on_board
        self._on_pace = on_pace
        self._seen: dict[str, tuple[Document, Evaluation]] = {}
        self._best = -np.inf

    @property
    def looked_at(self) -> int:
        """Boards so far."""
        return len(self._seen)

    def never_tried(self) -> dict[str, tuple[Any, ...]]:
        """Values of the SPEC's lists that no board so far has, by their keys."""
        return never_tried(self._spec.variables, [one for one, _ in self._seen.values()])

    def search(self) -> None:
        """Look at as many boards as the SPEC and the time allow."""
        if every := every_point(self._spec, self._seed):
            self._look(every, self._is_over)
            self._tell_pace()
            return
        starts = self._starts()
        self._tell_pace()
        share = self._spec.settings.evaluations / len(starts)
        for number, own in enumerate(starts, 1):
            last = round(number * share)
            for turn, start in enumerate(own):
                left = last - self.looked_at
                part = (number - 1 + (turn + 1) / len(own)) / len(starts)
                until = self._pace.started + part * (self._pace.first_end - self._pace.started)
                self._climb(start, left // (len(own) - turn), turn, until)

    def _is_over(self) -> bool:
        """Whether there is a board, and no time for another one before the end."""
        return self._best > -np.inf and self._pace.room(self._pace.first_end) == 0

    def _before(self) -> int:
        return max(self.looked_at, self._kept.count("board "))

    def _tell_pace(self) -> None:
        """Once, how many boards it comes to."""
        if self._on_pace and self._pace.seconds:
            self._on_pace(self._pace.boards(self._before()), self._pace.seconds)
            self._on_pace = None

    def allowed(self) -> list[Entry]:
        """Boards that break no limit."""
        entries = [Entry(*one) for one in self._seen.values() if one[1].broken is None]
        if not entries:
            raise self._nothing()
        return entries

    def _nothing(self) -> InputError:
        nearest = max((one for _, one in self._seen.values()), key=lambda one: one.robust_score)
        boards = "1 board" if self.looked_at == 1 else f"{self.looked_at} boards"
        hint = f"the nearest is beyond {nearest.broken}"
        return ArgumentError(
            "spec", f"{boards} beyond a limit", "limits that a board can meet", hint=hint
        )

    def _starts(self) -> list[list[Point]]:
        """The best layouts of each number of coils, the best first; solved to know which."""
        spec = self._spec
        scanned = spread_numbers(spec, self._seed)
        if not spec.places_are_free:
            points = [Point(None, numbers, ()) for numbers in scanned[:KEPT]]
            return [self._ranked(points)[:STARTS]]
        tasks = [(count, numbers) for numbers in scanned for count in spec.coils]
        rows, found = self._layouts(tasks), []
        for count in spec.coils:
            own = [
                one
                for (coils, _), row in zip(tasks, rows, strict=False)  # time may have ended them
                if coils == count
                for one in row["layouts"]
            ]
            if own and (ranked := self._ranked(chosen(own))):
                found.append(ranked[:STARTS])
        if not found:
            raise InputError(
                "design.coils",
                list(spec.coils),
                f"fewer: no layout has them {spec.settings.coil_spacing / MM:g} mm apart",
            )
        return found

    def _layouts(self, tasks: Sequence[tuple[int, tuple[float, ...]]]) -> list[dict[str, Any]]:
        """Rows of `layouts_of`, from the first on as many as there is time for.

        The first row's best layout is scored before the others are found, so that a search has a
        board soon: without mirrors a row takes ten times as long as with both.
        """
        used = self._kept.get(USED)
        tasks = tasks[: used["rows"]] if used else tasks
        pace = self._pace
        rows: list[dict[str, Any]] = []
        until = pace.started + AT_THE_START * (pace.ends - pace.started)

        def is_late() -> bool:
            return time.perf_counter() >= until and self._best > -np.inf

        for own in (tasks[:1], tasks[1:]):
            work = partial(layouts_of, self._spec)
            found: Iterator[Any] = remembered(
                self._kept, self._workers, "layouts", own, work, is_late
            )
            for row in takewhile(lambda one: one is not None, found):
                rows.append(row)
                self._tell_progress()
            if len(rows) == 1:
                self._look(chosen(rows[0]["layouts"])[:1])
        if len(rows) < len(tasks) and time.perf_counter() < pace.ends:
            # With more of them later the search would leave the path that it begins now.
            self._kept.put(USED, {"rows": len(rows)})
        return rows

    def _ranked(self, points: Sequence[Point]) -> list[Point]:
        """Those that there is time to look at, the best first."""
        scores = self._look(points, self._is_over)
        ranked = np.argsort([-one for one in scores], kind="stable")
        return [points[k] for k in ranked if scores[k] > UNSEEN]

    def _climb(self, start: Point, evaluations: int, turn: int, until: float) -> None:
        """CMA-ES from a point, over so many boards, until a reading of the clock."""
        if evaluations < 2 or not (len(start.numbers) + len(start.shares)):
            return
        own = strategy(self._spec, start, self._seed + 1 + turn, evaluations)
        last = self.looked_at + evaluations
        while self.looked_at < last and not own.stop():
            asked = fitting(self._spec, own.ask(DRAWN * own.popsize), start, own.popsize)
            points = [start.at(x) for x in asked]
            room = self._pace.room(until)
            if room is not None and room < len(points):
                free = self._of_checkpoint(points)
                inside = [*free, *[one for one in points if one not in free][:room]]
                self._look(inside)
                if len(inside) < len(points):
                    return
            scores = [-score for score in self._look(points)]
            with warnings.catch_warnings():  # of the draws that did not fit, number by number
                warnings.filterwarnings("ignore", r"\s*tell: \d+ solution")
                own.tell(asked, scores)

    def _look(
        self, points: Sequence[Point], is_late: Callable[[], bool] = lambda: False
    ) -> list[float]:
        """Scores of boards, those that were seen before without looking again."""
        documents = [document_at(self._spec, point) for point in points]
        names = [digest(document) for document in documents]
        new = {n: d for n, d in zip(names, documents, strict=True) if n not in self._seen}
        work = partial(judged, self._spec, self._seed)
        tasks = list(new.items())
        rows = remembered(self._kept, self._workers, "board", tasks, work, is_late)
        for (name, document), row in zip(new.items(), rows, strict=True):
            if row is None:
                continue
            found = Evaluation(**row["evaluation"])
            if found.broken is None:
                self._pace.add(row["seconds"])
            self._seen[name] = (document, found)
            self._tell(Entry(document, found))
        seen = [self._seen.get(name) for name in names]
        return [UNSEEN if one is None else one[1].robust_score for one in seen]

    def _of_checkpoint(self, points: Sequence[Point]) -> list[Point]:
        """Those that cost no time: a run before this one looked at them."""
        found = []
        for point in points:
            document = document_at(self._spec, point)
            task = (digest(document), document)
            if task[0] in self._seen or self._kept.get(name_of("board", task)) is not None:
                found.append(point)
        return found

    def _tell(self, entry: Entry) -> None:
        score = entry.evaluation.robust_score
        is_best = entry.evaluation.broken is None and score > self._best
        if is_best:
            self._best = score
        if self._on_board and entry.evaluation.broken is None:
            self._on_board(entry, is_best)
        self._tell_progress()
        if self._pace.is_known:
            self._tell_pace()

    def _tell_progress(self) -> None:
        if self._progress:
            boards, more = self._pace.told(self._before())
            self._progress(min(self.looked_at, boards), boards + more)
