"""A search for a board: how many boards a second, and what goes over the wire for each.

    .venv/bin/python bench/design.py      prints tables

The boards are those of boards/specs/strip.toml at places drawn at random: five coils, four drawn
boards each, places 4 mm apart. Processes are started and warm before the time counts.
"""

from __future__ import annotations

import pickle
import time
from functools import partial
from pathlib import Path
from statistics import median

import dask
import distributed
import numpy as np

from chladni.design.evaluate import Evaluation, document_of, evaluate
from chladni.design.spec import Spec, read_spec
from chladni.design.variables import Document
from chladni.drives.workers import Workers

ROOT = Path(__file__).resolve().parents[1]
BOARDS, TURNS = 6, 3


def judge(spec: Spec, document: Document) -> Evaluation:
    """What a worker is asked."""
    return evaluate(spec, document, 1)


def documents(spec: Spec, count: int) -> list[Document]:
    """Strips whose five coils are a little off their best places."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(count):
        inner = 10.6 + rng.uniform(0.0, 1.4)
        outer = inner + 10.6 + rng.uniform(0.0, 1.4)
        places = [(0.0, y) for y in (-outer, -inner, 0.0, inner, outer)]
        found.append(document_of(spec, [], places))
    return found


def rate(workers: Workers, spec: Spec, boards: list[Document]) -> float:
    """Boards a second, median of a few turns."""
    work = partial(judge, spec)
    list(workers.map(work, boards[:2]))
    times = []
    for _ in range(TURNS):
        begun = time.perf_counter()
        assert all(one.broken is None for one in workers.map(work, boards))
        times.append(time.perf_counter() - begun)
    return len(boards) / median(times)


def main() -> None:
    """Print the tables."""
    spec = read_spec(ROOT / "boards" / "specs" / "strip.toml")
    boards = documents(spec, BOARDS)
    print("## Design: boards a second\n")
    print("| workers | boards a second | times one process |")
    print("|---|---|---|")
    with Workers(1) as one:
        alone = rate(one, spec, boards)
    print(f"| 1 process | {alone:.2f} | 1 |", flush=True)
    with Workers(2) as two:
        found = rate(two, spec, boards)
    print(f"| 2 processes | {found:.2f} | {found / alone:.2f} |", flush=True)
    # Left alone, Dask has its workers hand memory back at once, which costs a third of the time.
    dask.config.set({"distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1 << 30})
    with (
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            silence_logs=50,
        ) as cluster,
        Workers(scheduler=cluster.scheduler_address) as there,
    ):
        found = rate(there, spec, boards)
    print(f"| a Dask cluster of 2 | {found:.2f} | {found / alone:.2f} |\n")
    asked = len(pickle.dumps((partial(judge, spec), boards[0])))
    answered = len(pickle.dumps(judge(spec, boards[0])))
    print(f"A board goes out as {asked:,} bytes and comes back as {answered:,}.\n")


if __name__ == "__main__":
    main()
