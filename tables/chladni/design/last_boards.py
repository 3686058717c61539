"""The last boards of a search, which are scored with all draws: which, and how long it takes.

One of them takes as long as so many boards of the search as it has draws more. For `strip`,
`phone5` and `phone8`, with eight times the draws, that was 8.2, 6.5 and 8.6 boards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from chladni.design.evaluate import evaluate_in_full
from chladni.design.front import Entry, front_of
from chladni.design.spec import Spec
from chladni.drives.methods import Progress
from chladni.drives.scoring.board_score import BoardScore
from chladni.drives.workers import Workers

FINALISTS = 3
"""Boards that are scored with all draws at the end, besides those of the front."""
USUAL = 4
"""Boards that a search ends with: the front mostly has one that is not among the finalists."""
RECENT = 20
"""Boards by which time is estimated: a few minutes of a search."""

OnLast = Callable[[int, int, float], None]
"""Called with the number of the last boards, the drawn boards of each, and the seconds that
comparing them may take."""


def last_boards(entries: Sequence[Entry]) -> list[Entry]:
    """Boards that are not worse than another in every goal, and the best few."""
    ranked = sorted(entries, key=lambda one: -one.evaluation.robust_score)
    chosen = {id(one): one for one in (*ranked[:FINALISTS], *front_of(ranked))}
    return list(chosen.values())


def draws_more(spec: Spec, samples: int) -> float:
    """How many boards of the search take as long as one of the last ones."""
    return max(1.0, samples / spec.settings.samples)


def boards_more(spec: Spec, samples: int) -> int:
    """How many boards of the search take as long as the end usually does."""
    return round(USUAL * draws_more(spec, samples))


def expected_s(spec: Spec, samples: int, count: int, seconds: Sequence[float], jobs: int) -> float:
    """How long so many last boards may take, by what each board of the search took, s.

    The last ones count: a machine may have got other work since the search began.
    """
    board_s = float(np.median(seconds[-RECENT:])) if seconds else 0.0
    return board_s * draws_more(spec, samples) * math.ceil(count / jobs)


def draws_in(
    left_s: float, spec: Spec, samples: int, count: int, seconds: Sequence[float], jobs: int
) -> int:
    """Drawn boards of each of so many last boards, for which there is time: up to `samples`."""
    once_s = expected_s(spec, spec.settings.samples, count, seconds, jobs)
    fewest = min(spec.settings.samples, samples)
    if once_s <= 0.0:
        return samples
    return int(np.clip(left_s / once_s * spec.settings.samples, fewest, samples))


def compared(
    spec: Spec,
    seed: int,
    samples: int,
    workers: Workers,
    found: Sequence[Entry],
    before: int,
    progress: Progress | None,
) -> list[tuple[Entry, BoardScore]]:
    """The last boards with their scores of all draws; `before` is what was done before them."""
    more, finished = boards_more(spec, samples), []
    in_full = partial(evaluate_in_full, spec, seed, samples)
    scored = workers.map(in_full, [one.document for one in found])
    for one, (own, full) in zip(found, scored, strict=True):
        finished.append((Entry(one.document, own), full))
        if progress:
            progress(before + round(more * len(finished) / len(found)), before + more)
    return finished
