"""Work in threads: in order, drawn as it is needed, and never outliving its caller."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from chladni.drives.problem.threads import in_threads


@pytest.mark.parametrize("jobs", [1, 3, None])
def test_results_come_in_the_order_of_the_items(jobs: int | None) -> None:
    def late(item: int) -> int:
        time.sleep(0.002 * (item % 3))
        return item * item

    assert list(in_threads(late, range(30), jobs=jobs)) == [k * k for k in range(30)]
    assert list(in_threads(late, [], jobs=jobs)) == []


def test_no_more_items_are_drawn_than_asked_for() -> None:
    drawn = []

    def items() -> Iterator[int]:
        for k in range(100):
            drawn.append(k)
            yield k

    results = in_threads(lambda k: k, items(), jobs=2, ahead=5)
    for k in range(3):
        assert next(results) == k
    assert len(drawn) <= 5 + 3
    results.close()


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_when_the_caller_stops_nothing_runs_on(error: type[BaseException]) -> None:
    begun, ended = [], []

    def slow(item: int) -> int:
        begun.append(item)
        time.sleep(0.05)
        ended.append(item)
        return item

    def stop() -> None:
        for _ in in_threads(slow, range(50), jobs=2, ahead=20):
            raise error

    before = set(threading.enumerate())
    with pytest.raises(error):
        stop()
    assert sorted(begun) == sorted(ended)
    assert len(begun) < 50
    assert set(threading.enumerate()) <= before


def test_an_error_of_the_work_reaches_the_caller() -> None:
    def fail(item: int) -> int:
        if item == 4:
            raise ZeroDivisionError
        return item

    results = in_threads(fail, range(9), jobs=2)
    assert [next(results) for _ in range(4)] == [0, 1, 2, 3]
    with pytest.raises(ZeroDivisionError):
        next(results)
