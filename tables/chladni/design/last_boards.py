"""The last boards of a search, which are scored with all draws: which, and how long it takes.

One of them takes as long as so many boards of the search as it has draws more, on its own finer
image: `strip` took 8.3 boards with eight times the draws, 2.9 with twice as many and 1.9 with as
many. Several fingers are drawn as often for each draw in the search, and 200 times in all at the
end: `feet5`, `phone5` and `phone8` took 3.0, 2.7 and 3.3 boards with eight times the draws, 1.6 to
2.4 with twice as many and 1.4 to 2.1 with as many.
"""

from __future__ import annotations

import math
import time
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
OF_ONE = ((0.0, 1.0), (1.5, 0.5))
OF_SEVERAL = ((2.0, 0.25),)
"""Boards of the search that one of them takes: so many however few its draws are, and so many more
for each time that it has the search's draws; no less than what was measured. Of two the larger."""
RECENT = 20
"""Boards by which time is estimated: a few minutes of a search."""

OnPace = Callable[[int, float], None]
"""Called with the number of boards that the search may come to, by its time and its SPEC, and the
seconds between two of them."""
OnLast = Callable[[int, int, float], None]
"""Called with the number of the last boards, the random boards of each, and the seconds that
comparing them may take."""


def last_boards(entries: Sequence[Entry]) -> list[Entry]:
    """Boards that are not worse than another in every goal, and the best few."""
    ranked = sorted(entries, key=lambda one: -one.evaluation.robust_score)
    chosen = {id(one): one for one in (*ranked[:FINALISTS], *front_of(ranked))}
    return list(chosen.values())


def boards_of_one(spec: Spec, samples: float) -> float:
    """How many boards of the search take as long as one of the last ones."""
    share = max(1.0, samples / spec.settings.samples)
    return max(fixed + more * share for fixed, more in _lines(spec))


def _lines(spec: Spec) -> Sequence[tuple[float, float]]:
    return OF_SEVERAL if spec.is_for_several else OF_ONE


def boards_more(spec: Spec, samples: int) -> int:
    """How many boards of the search take as long as the end usually does."""
    return round(USUAL * boards_of_one(spec, samples))


def expected_s(spec: Spec, samples: int, count: int, seconds: Sequence[float], jobs: int) -> float:
    """How long so many last boards may take, by what each board of the search took, s.

    The last ones count: a machine may have got other work since the search began.
    """
    board_s = float(np.median(seconds[-RECENT:])) if seconds else 0.0
    return board_s * boards_of_one(spec, samples) * math.ceil(count / jobs)


def boards_in(left_s: float, seconds: Sequence[float], jobs: int) -> int | None:
    """Boards of the search for which there is time; None where it has no end, or none is known."""
    board_s = float(np.median(seconds[-RECENT:])) if seconds else 0.0
    if not board_s or math.isinf(left_s):
        return None
    return jobs * math.floor(max(left_s, 0.0) / board_s)


def draws_in(
    left_s: float, spec: Spec, samples: int, count: int, seconds: Sequence[float], jobs: int
) -> int:
    """Random boards of each of so many last boards, for which there is time: up to `samples`."""
    fewest = min(spec.settings.samples, samples)
    one_s = expected_s(spec, fewest, count, seconds, jobs) / boards_of_one(spec, fewest)
    if one_s <= 0.0:
        return samples
    share = min((left_s / one_s - fixed) / more for fixed, more in _lines(spec))
    return int(np.clip(share * spec.settings.samples, fewest, samples))


def compared(
    spec: Spec,
    seed: int,
    samples: int,
    workers: Workers,
    found: Sequence[Entry],
    before: int,
    until: float,
    progress: Progress | None,
) -> list[tuple[Entry, BoardScore | None]]:
    """The last boards with their scores of all draws: the first, and others while there is time.

    Parameters
    ----------
    found
        The best ones first.
    before
        What was done before them.
    until
        A reading of the clock, s. A machine that got other work may need more time than it was
        expected to.
    """
    more, finished = boards_more(spec, samples), []
    in_full = partial(evaluate_in_full, spec, seed, samples)
    scored = workers.map(in_full, [one.document for one in found])
    for one, (own, full) in zip(found, scored, strict=False):
        finished.append((Entry(one.document, own), full))
        is_last = len(finished) == len(found) or time.perf_counter() >= until
        if progress:
            share = 1.0 if is_last else len(finished) / len(found)
            progress(before + round(more * share), before + more)
        if is_last:
            break
    return finished
