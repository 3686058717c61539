"""Greedy exchange over a grid of candidate coils, by a figure of each layout (ratings.py)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from chladni.design.layouts.layouts import Candidate, Place, makeups
from chladni.design.layouts.ratings import Rating

SWEEPS = 4
"""Of exchanging every orbit; usual are 2 or 3."""
PACKINGS, PACKING_SEED = 200, 1
"""How often coils are thrown on the plate where choosing one after the other leaves no room."""


def best_layouts(
    rating: Rating, offered: Sequence[Candidate], count: int, least: float
) -> list[tuple[float, list[Candidate]]]:
    """The best layout of each make-up of so many coils, the best make-up first.

    Parameters
    ----------
    rating
        With a row for each image of each candidate, in their order.
    least
        Distance of two coils, m.
    """
    first = np.cumsum([0, *(len(one.images) for one in offered)])
    rows = [list(range(*ends)) for ends in pairwise(first.tolist())]
    offers = Counter(len(one.images) for one in offered)
    found = []
    for makeup in makeups(count, offers):
        picked = _exchanged(rating, offered, rows, makeup, least)
        if picked is not None:
            level, chosen = picked
            found.append((level, [offered[k] for k in chosen]))
    return sorted(found, key=lambda one: -one[0])


def _exchanged(
    rating: Rating,
    offered: Sequence[Candidate],
    rows: Sequence[list[int]],
    makeup: Sequence[int],
    least: float,
) -> tuple[float, list[int]] | None:
    """One orbit after the other where it does best; then each again while that gains anything."""
    chosen: list[int] = []
    level = -np.inf

    def best(others: list[int], size: int) -> tuple[float, int] | None:
        places = [place for k in others for place in offered[k].images]
        tried = []
        for k, one in enumerate(offered):
            if len(one.images) == size and _fits(one, places, least):
                taken = [row for other in (*others, k) for row in rows[other]]
                tried.append((rating.figure(taken), k))
        return max(tried, default=None)

    for size in makeup:
        found = best(chosen, size)
        if found is None:
            # Those before it left no room: begin with any that have it.
            chosen = _packed(offered, makeup, least)
            if not chosen:
                return None
            break
        level = found[0]
        chosen.append(found[1])
    level = rating.figure([row for k in chosen for row in rows[k]])
    for _ in range(SWEEPS):
        before = level
        for slot, size in enumerate(makeup):
            others = chosen[:slot] + chosen[slot + 1 :]
            found = best(others, size)
            if found is not None and found[0] > level:
                level, chosen[slot] = found
        if level <= before + 1e-3:
            break
    return level, chosen


def _packed(offered: Sequence[Candidate], makeup: Sequence[int], least: float) -> list[int]:
    """Orbits drawn at random that fit beside each other; none if that was not seen to be."""
    rng = np.random.default_rng(PACKING_SEED)
    for _ in range(PACKINGS):
        chosen: list[int] = []
        for size in makeup:
            places = [place for k in chosen for place in offered[k].images]
            room = [
                k
                for k, one in enumerate(offered)
                if len(one.images) == size and _fits(one, places, least)
            ]
            if not room:
                break
            chosen.append(int(rng.choice(room)))
        else:
            return chosen
    return []


def _fits(one: Candidate, places: Sequence[Place], least: float) -> bool:
    return all(
        (x - u) ** 2 + (y - v) ** 2 >= (least - 1e-9) ** 2 for x, y in one.images for u, v in places
    )
