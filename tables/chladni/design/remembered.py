"""Results of a search's tasks, from its checkpoint where they are in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from chladni.drives.checkpoint import Checkpoint, Result, digest
from chladni.drives.workers import Workers


def name_of(what: str, task: Any) -> str:
    """A task's result in the checkpoint."""
    return f"{what} {digest(task)}"


def remembered(
    kept: Checkpoint,
    workers: Workers,
    what: str,
    tasks: Sequence[Any],
    work: Callable[[Any], Result],
    is_late: Callable[[], bool],
) -> Iterator[Result | None]:
    """Results of tasks in their order, as they come.

    Parameters
    ----------
    what
        With what their names in the checkpoint begin.
    is_late
        Whether there is no time for more: what is not in the checkpoint is None then.
    """
    names = [name_of(what, task) for task in tasks]
    known = [kept.get(name) for name in names]
    new = [task for task, one in zip(tasks, known, strict=True) if one is None]
    done = workers.map(work, new)
    for name, one in zip(names, known, strict=True):
        if one is not None:
            yield one
        else:
            yield None if is_late() else kept.put(name, next(done))
