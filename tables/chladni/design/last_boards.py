"""The last boards of a search, which are scored with all draws: which, and how long it takes.

One of them takes as long as so many boards of the search as it has draws more. For `strip`,
`phone5` and `phone8`, with eight times the draws, that was 8.2, 6.5 and 8.6 boards. With few draws
its own finer image and its sets of fingers count: as many draws took 1.3 boards of `strip-open` and
1.8 of `phone5`, 3.5 times as many 3.5 and 2.8.
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
ALONE = 1.5
"""Boards of the search that one of them takes however few its draws are, and half as much for each
as has its draws; no less than what was measured."""
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
    share = draws_more(spec, samples)
    return board_s * max(share, ALONE + share / 2.0) * math.ceil(count / jobs)


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
    own_s = expected_s(spec, spec.settings.samples, count, seconds, jobs) / (ALONE + 0.5)
    fewest = min(spec.settings.samples, samples)
    if own_s <= 0.0:
        return samples
    share = min(left_s / own_s, 2.0 * (left_s / own_s - ALONE))
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
