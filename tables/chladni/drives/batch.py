"""Many targets of one board: the plate solved once, target fields in groups, all cores at work."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache, partial
from itertools import chain

from chladni.drives.checkpoint import Checkpoint, Part, Result
from chladni.drives.methods import Progress
from chladni.drives.problem.problem import TOGETHER, Problem, SolvedBoard, solved_board
from chladni.drives.problem.threads import in_threads
from chladni.drives.workers import Workers
from chladni.sim.board.board import Board

Target = tuple[float, float]
AHEAD = 3 * TOGETHER
"""Problems made before their results are asked for: the threads have work while a group is made."""


def over_targets(
    solved: SolvedBoard,
    targets_mm: Sequence[Target],
    work: Callable[[Problem], Result],
    *,
    jobs: int | None = None,
    checkpoint: Checkpoint | Part | None = None,
    besides: Iterable[Problem] = (),
    with_finger: bool = False,
) -> Iterator[Result]:
    """Run `work` on every target; results in the targets' order, whatever the number of jobs.

    Parameters
    ----------
    jobs
        Threads; all cores by default.
    checkpoint
        Holds what was finished before, and gets what is finished now.
    besides
        Problems to be worked on after these, of which no results are wanted.
    with_finger
        Problems come with what a finger at their target does.
    """
    kept = checkpoint or Checkpoint(None, {})
    _ = solved.space, solved.mirrors  # found once, before there are threads

    def finish(case: tuple[Problem | None, Result | None]) -> Result:
        problem, saved = case
        if saved is not None:
            return saved
        assert problem is not None
        return work(problem)

    own = _problems(solved, targets_mm, kept, with_finger)
    problems = chain(own, ((problem, None) for problem in besides))
    finished = in_threads(finish, problems, jobs=jobs, ahead=AHEAD)
    for target in targets_mm:
        result, name = next(finished), _name(target)
        yield result if kept.get(name) else kept.put(name, result)
    for _ in finished:
        pass


def on_workers(
    workers: Workers,
    board: Board,
    targets_mm: Sequence[Target],
    work: Callable[[Problem], Result],
    checkpoint: Checkpoint | Part,
    *,
    with_finger: bool = False,
    progress: Progress | None = None,
) -> None:
    """Do what `over_targets` would, on workers, so that the checkpoint has it all.

    Parameters
    ----------
    work
        Something that another process can be sent: a function of a module, or a partial of one.
    progress
        Called with (done, all).
    """
    groups = [targets_mm[k : k + TOGETHER] for k in range(0, len(targets_mm), TOGETHER)]
    left = [group for group in groups if not all(checkpoint.get(_name(one)) for one in group)]
    done = len(targets_mm) - sum(map(len, left))
    send = partial(_of_group, board, work, with_finger=with_finger)
    for group, results in zip(left, workers.map(send, left), strict=True):
        for target, result in zip(group, results, strict=True):
            if not checkpoint.get(_name(target)):
                checkpoint.put(_name(target), result)
        done += len(group)
        if progress:
            progress(done, len(targets_mm))


def _of_group(
    board: Board, work: Callable[[Problem], Result], group: Sequence[Target], *, with_finger: bool
) -> list[Result]:
    return [work(one) for one in _solved(board).problems(group, with_finger=with_finger)]


@lru_cache(maxsize=1)
def _solved(board: Board) -> SolvedBoard:
    """A worker is sent a board with each group, and solves its plate once."""
    return solved_board(board)


def _problems(
    solved: SolvedBoard, targets_mm: Sequence[Target], kept: Checkpoint | Part, with_finger: bool
) -> Iterator[tuple[Problem | None, Result | None]]:
    """Problems of targets still to do. Groups are the same after a resume, and so are the bits."""
    for group in solved.groups(targets_mm):
        if all(kept.get(_name(target)) for target in group):
            yield from ((None, kept.get(_name(target))) for target in group)
            continue
        for problem in solved.problems(group, with_finger=with_finger):
            yield problem, kept.get(_name(problem.target_mm))


def _name(target: Target) -> str:
    return f"{target[0]!r},{target[1]!r}"
