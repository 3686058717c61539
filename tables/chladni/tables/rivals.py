"""Other optima of a region that are as good as its best, found from its neighbours' drives.

Two optima often tie within what nobody could feel. A neighbour's drive, climbed from on a region's
own target, finds the region's optimum on the neighbour's branch; where that is good enough it
becomes an option, and over all regions the options are chosen that differ least between neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.tables.branches import JOIN, choose, distances, neighbours
from chladni.tables.entry import Entry
from chladni.tables.objectives import OBJECTIVES
from chladni.tables.scene import Scene
from chladni.tables.search import as_complex, as_reals
from chladni.tables.threads import in_threads

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

NEAR_ENOUGH = 0.001
"""SSIM (and objective) that a rival may fall short by: half of what a table may lose."""
APART = 0.3
"""Unit fields that differ by more are other optima."""
ROUNDS = 3
COARSE_STEP, COARSE_CLIMB, FINE_CLIMB = 2, 20, 12
TOLERANCE = 1e-6
GAP_WEIGHT = 10.0
"""Squared step that a unit of score is worth: between equal steps the better drive is taken."""


def smoothest(
    scene: Scene, regions: Sequence[Entry], columns: int, objective: str, *,
    jobs: int | None = None,
) -> list[ComplexArray]:  # fmt: skip
    """The drive of every region, rivals taken where neighbours then differ less."""
    weights = OBJECTIVES[objective]
    if weights.ssim == 0.0:
        return [region.drive for region in regions]  # closed forms have no rivals
    pairs = neighbours(columns, len(regions) // columns)
    around: list[list[int]] = [[] for _ in regions]
    for a, b in pairs.tolist():
        around[a].append(b)
        around[b].append(a)
    options = [
        [_Option(region.drive, scene.space.coordinates(region.drive), 0.0)] for region in regions
    ]
    tried: list[list[ComplexArray]] = [[] for _ in regions]

    def search(at: int) -> list[_Option]:
        found: list[_Option] = []
        for unit in _foreign(at, options, around, tried):
            rival = _climb(scene, regions[at], unit, objective)
            if rival and all(_step(rival.unit, one.unit) > APART for one in options[at] + found):
                found.append(rival)
        return found

    for _ in range(ROUNDS):
        news = list(in_threads(search, range(len(regions)), jobs=jobs))
        for at, found in enumerate(news):
            options[at] += found
        if not any(news):
            break
    steps = [(a, b, _costs(options[a], options[b])) for a, b in pairs.tolist()]
    gaps = [np.array([option.gap for option in some]) for some in options]
    chosen = choose(steps, gaps, GAP_WEIGHT)
    return [some[k].drive for some, k in zip(options, chosen, strict=True)]


@dataclass(frozen=True)
class _Option:
    drive: ComplexArray
    unit: ComplexArray
    gap: float


def _step(one: ComplexArray, other: ComplexArray) -> float:
    """‖u − v‖ of unit fields, the common phase that suits them best taken out."""
    return float(distances(complex(np.vdot(one, other))))


def _foreign(
    at: int, options: list[list[_Option]], around: list[list[int]],
    tried: list[list[ComplexArray]],
) -> list[ComplexArray]:  # fmt: skip
    """Neighbours' drives unlike any of this region, each once."""
    result = []
    for other in around[at]:
        for option in options[other]:
            known = [own.unit for own in options[at]] + tried[at]
            if np.any(option.unit) and all(_step(option.unit, unit) > APART for unit in known):
                tried[at].append(option.unit)
                result.append(option.unit)
    return result


def _climb(scene: Scene, region: Entry, unit: ComplexArray, objective: str) -> _Option | None:
    """The optimum on a neighbour's branch, if it is good enough."""
    space, weights = scene.space, OBJECTIVES[objective]
    z = np.ascontiguousarray(as_reals(unit))
    curvature = np.zeros((z.size, z.size))
    for step, steps in ((COARSE_STEP, COARSE_CLIMB), (1, FINE_CLIMB)):
        level = space.nearest_level(step)
        climbing = space.objective(
            level, region.wanted.image.astype(np.float64), ssim=weights.ssim,
            contrast=weights.contrast, disc=region.wanted.disc,
        )  # fmt: skip
        value = climbing.climb(z, curvature, steps, TOLERANCE)
        own = space.value(climbing, region.drive)
        # A coarse image is off by about as much for both.
        if value < own - (NEAR_ENOUGH if level.step == 1 else 10.0 * NEAR_ENOUGH):
            return None
    drive = space.drive(as_complex(z))
    ssim = space.value(region.ssim(scene), drive)
    if not ssim >= region.best - NEAR_ENOUGH:
        return None
    return _Option(drive, space.coordinates(drive), max(own - value, region.best - ssim, 0.0))


def _costs(some: list[_Option], others: list[_Option]) -> FloatArray:
    """Squared steps between options, none more than a cut costs."""
    return np.array([[min(_step(a.unit, b.unit), JOIN) ** 2 for b in others] for a in some])
