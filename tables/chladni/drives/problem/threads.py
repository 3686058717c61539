"""Work for all cores, in order: threads, since nearly all the time goes into compiled code."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import cache
from itertools import islice
from typing import TypeVar

from threadpoolctl import ThreadpoolController

Item = TypeVar("Item")
Done = TypeVar("Done")


def in_threads(
    work: Callable[[Item], Done], items: Iterable[Item], *, jobs: int | None = None, ahead: int = 16
) -> Generator[Done, None, None]:
    """`work` of every item, in the items' order.

    Items are drawn in the caller's thread, at most `ahead` before their results are. When the
    caller stops or is interrupted, nothing new begins, and what runs is waited for: a thread that
    outlived the interpreter would take the process down with it.
    """
    source = iter(items)
    pool = ThreadPoolExecutor(jobs or os.cpu_count() or 1)
    try:
        waiting: deque[Future[Done]] = deque(
            pool.submit(work, item) for item in islice(source, max(ahead, 1))
        )
        while waiting:
            result = waiting.popleft().result()
            waiting.extend(pool.submit(work, item) for item in islice(source, 1))
            yield result
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def one_blas_thread() -> AbstractContextManager[object]:
    """Linear algebra in the calling thread only.

    The matrices here are small, so more threads only get in the way of `in_threads`; and sums in
    another order would make drives differ in their last bits, and tables in their bytes.
    """
    limiter: AbstractContextManager[object] = _libraries().limit(limits=1, user_api="blas")
    return limiter


@cache
def _libraries() -> ThreadpoolController:
    """All that are loaded, SciPy's own BLAS among them: one that comes later has no limit."""
    import scipy.linalg  # noqa: F401, PLC0415

    return ThreadpoolController()
