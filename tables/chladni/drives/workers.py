"""Work for many processes: this machine's cores, or those of a Dask cluster."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial
from importlib import import_module
from types import TracebackType
from typing import Any, TypeVar

import joblib
from joblib.externals.loky.process_executor import BrokenProcessPool

from chladni.drives.problem.threads import one_blas_thread
from chladni.sim.errors import ArgumentError, ChladniError

Item = TypeVar("Item")
Done = TypeVar("Done")

SCHEDULER_S = 10.0
"""How long a scheduler may take to answer."""
LOST_WORKERS = 10
"""So many workers may die over one piece of work before it counts as its fault."""
ORPHAN_S = 1.0
"""How often a process of this machine looks whether the one that asked is still there."""


class Workers(contextlib.AbstractContextManager["Workers"]):
    """Processes that are handed pieces of work; results come in the pieces' order.

    Parameters
    ----------
    jobs
        Processes on this machine; all cores by default. With 1 the work is done right here.
    scheduler
        Address of a Dask scheduler, `tcp://host:8786`, whose workers do the work instead; they need
        the same version of Chladni. Needs the extra `chladni[cluster]`. A worker that dies loses
        nothing: its pieces are done again by others.

    Raises
    ------
    InputError
        On entering: nothing answers at the address, or the extra is not installed.
    """

    def __init__(self, jobs: int | None = None, scheduler: str | None = None) -> None:
        self.jobs = jobs or os.cpu_count() or 1
        self._scheduler = scheduler
        self._client: Any = None

    def __enter__(self) -> Workers:
        if self._scheduler is not None:
            self._client = _client_of(self._scheduler)
            self.jobs = max(1, sum(self._client.nthreads().values()))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._client is not None:
            self._client.close()

    _EXPECTED = (
        # A process whose memory has grown is replaced, which loses nothing.
        "A worker stopped while some jobs were given to the executor",
        # Who stops in the middle knows that work is left.
        r"\d+ tasks (have been successfully executed|which were still being processed)",
    )

    def map(self, work: Callable[[Item], Done], items: Iterable[Item]) -> Iterator[Done]:
        """`work` of every item, each result as soon as it and those before it are there.

        What a process that dies takes with it is done again, once.

        Raises
        ------
        ChladniError
            A process died a second time.
        """
        if self._client is not None:
            yield from self._mapped(work, items)
        elif self.jobs == 1:
            for item in items:
                yield _alone(work, item)
        else:
            for message in self._EXPECTED:
                warnings.filterwarnings("ignore", message=message)
            left, done = list(items), 0
            try:
                for result in self._on_processes(work, left):
                    done += 1
                    yield result
            except BrokenProcessPool:
                yield from self._again(work, left[done:])

    def _again(self, work: Callable[[Item], Done], items: list[Item]) -> Iterator[Done]:
        try:
            yield from self._on_processes(work, items)
        except BrokenProcessPool:
            raise ChladniError(
                "a worker process was killed, and one again when its work was repeated, as a "
                "system does that runs out of memory",
                hint=f"with fewer than {self.jobs} jobs (--jobs 1) less memory is needed at once",
            ) from None

    def _on_processes(self, work: Callable[[Item], Done], items: list[Item]) -> Iterator[Done]:
        parallel = joblib.Parallel(
            self.jobs, backend="loky", return_as="generator", initializer=_beginning(os.getpid())
        )
        return iter(parallel(joblib.delayed(_alone)(work, item) for item in items))

    def _mapped(self, work: Callable[[Item], Done], items: Iterable[Item]) -> Iterator[Done]:
        with joblib.parallel_config(backend="dask", wait_for_workers_timeout=SCHEDULER_S):
            yield from joblib.Parallel(return_as="generator", batch_size=1)(
                joblib.delayed(_alone)(work, item) for item in items
            )


def _alone(work: Callable[[Item], Done], item: Item) -> Done:
    """Each process has one core, and so its algebra one thread."""
    with one_blas_thread():
        return work(item)


@cache
def _beginning(parent: int) -> Callable[[], None]:
    """What a worker begins with; the same object each time, or joblib would start new workers."""
    return partial(_begin, parent)


def _begin(parent: int) -> None:
    # Ctrl-C goes to the whole group of processes; only the one that asked reports it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: int) -> None:
    """End this process once its parent is gone, by whatever signal.

    loky's workers would first finish their piece and wait for minutes for another. Linux can send a
    signal in place of this, but does so when the parent's thread ends that began the worker.
    """
    while os.getppid() == parent:
        time.sleep(ORPHAN_S)
    os._exit(1)


def _client_of(address: str) -> Any:
    try:
        # An extra, and a second to import.
        dask, distributed = import_module("dask"), import_module("distributed")
    except ImportError:
        raise ArgumentError(
            "scheduler",
            address,
            "the extra chladni[cluster], which is not installed",
            hint="pip install it",
        ) from None
    dask.config.set({"distributed.scheduler.allowed-failures": LOST_WORKERS})
    try:
        return distributed.Client(address, timeout=SCHEDULER_S, set_as_default=True)
    except (OSError, ValueError, TimeoutError) as error:
        expected = "a Dask scheduler that answers, such as tcp://127.0.0.1:8786"
        raise ArgumentError("scheduler", address, expected) from error
