"""A Dask cluster's workers do what this machine's do, and one that dies loses nothing."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from typing import Any

import pytest

from chladni.design.evaluate import completed_board, document_of
from chladni.design.front import Entry
from chladni.design.search import design
from chladni.design.spec import spec_of
from chladni.drives.scoring.compare import compare
from chladni.drives.workers import Workers
from chladni.tables.build import build_table
from chladni.tables.format import pack
from made_specs import small

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as found:
        yield found


def slow_square(number: int) -> int:
    """Long enough that a worker dies in the middle."""
    import time  # noqa: PLC0415

    time.sleep(0.15)
    return number * number


def test_a_worker_that_is_killed_loses_nothing(cluster: Any) -> None:
    with Workers(scheduler=cluster.scheduler_address) as workers:
        assert workers.jobs == 2
        found = []
        for result in workers.map(slow_square, range(16)):
            found.append(result)
            if len(found) == 2:
                os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)
    assert found == [number * number for number in range(16)]


def test_a_search_finds_the_same_on_a_cluster(cluster: Any) -> None:
    asked = spec_of(small(design={"evaluations": 4}))
    better: list[Entry] = []
    there = design(
        asked,
        scheduler=cluster.scheduler_address,
        samples=1,
        on_board=lambda own, _: better.append(own),
    )
    here = design(asked, jobs=1, samples=1)
    assert there.best.document == here.best.document
    assert there.best.evaluation.robust_score == pytest.approx(
        here.best.evaluation.robust_score, abs=1e-6
    )
    assert better


def test_tables_and_comparisons_are_the_same_from_a_cluster(cluster: Any) -> None:
    address, asked = cluster.scheduler_address, spec_of(small(regions={"pitch_mm": 10.0}))
    board = completed_board(document_of(asked, [], [(0.0, -9.0), (0.0, 7.0)]))
    assert pack(build_table(board, scheduler=address)[0]) == pack(build_table(board)[0])
    methods = ["phasor", "nearest"]
    there = compare(board, pitch=10e-3, methods=methods, scheduler=address)[1]
    here = compare(board, pitch=10e-3, methods=methods)[1]
    for one, other in zip(there, here, strict=True):
        # A core alone adds in another order.
        wanted = other.numbers | {"seconds": one.numbers["seconds"]}
        assert one.numbers == pytest.approx(wanted, rel=1e-9, abs=1e-12, nan_ok=True)
