"""Turn a board's drives in phase so that they change smoothly, and label what belongs together.

A drive's common phase is free. All phases are chosen at once over the graph of neighbouring
regions, by the leading eigenvector's method (angular synchronisation). Regions whose fields still
differ too much to interpolate get different labels; the device cross-fades between those.

References
----------
Singer, Angular synchronization by eigenvectors and semidefinite programming, 2011.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from chladni.drives.problem.field_space import FieldSpace, in_phase, turn_in_phase
from chladni.tables.layout import MAX_LABELS
from chladni.tables.mirror_symmetry import CUT, JOINED, NEGATED
from chladni.tables.stored_regions import StoredRegions

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.intp]

JOIN = 0.75
"""Neighbours whose unit fields differ by more are not interpolated: half-way between such two the
mean would have lost 7 % of its level (1 − √(1 − 0.75²/4))."""
STEEP = 0.3
"""Steps above this are counted in reports."""
SWEEPS = 300


@dataclass(frozen=True)
class Steps:
    """Steps ‖uᵢ − uⱼ‖ between the unit fields of neighbouring regions."""

    median: float
    largest: float
    share_above: float

    @classmethod
    def of(cls, steps: FloatArray) -> Steps:
        """Summed up; all zero for a single region."""
        if steps.size == 0:
            return cls(0.0, 0.0, 0.0)
        return cls(float(np.median(steps)), float(steps.max()), float(np.mean(steps > STEEP)))


@dataclass(frozen=True)
class Synchronised:
    """Drives turned to change smoothly, shape (stored, actuators), and what belongs together.

    Attributes
    ----------
    labels
        uint8, shape (stored,).
    crossings
        uint8, shape (labels, 2): what becomes of a label across the mirrors (mirror_symmetry.py).
    before, after
        Steps between neighbours with every drive turned by itself, and as they are now; `within`
        counts only neighbours of one label.
    """

    drives: ComplexArray
    labels: NDArray[np.uint8]
    crossings: NDArray[np.uint8]
    before: Steps
    after: Steps
    within: Steps


def neighbours(columns: int, rows: int, *, diagonal: bool = False) -> IndexArray:
    """Pairs of neighbouring cells, shape (pairs, 2)."""
    numbers = np.arange(columns * rows).reshape(rows, columns)
    pairs = [(numbers[:, :-1], numbers[:, 1:]), (numbers[:-1], numbers[1:])]
    if diagonal:
        pairs += [(numbers[:-1, :-1], numbers[1:, 1:]), (numbers[:-1, 1:], numbers[1:, :-1])]
    return np.concatenate([np.stack((a.ravel(), b.ravel()), axis=1) for a, b in pairs])


def synchronise(space: FieldSpace, regions: StoredRegions, drives: ComplexArray) -> Synchronised:
    """Turn drives so that neighbours agree, and label what may be interpolated."""
    columns, rows = regions.shape
    units = np.array([space.coordinates(drive) for drive in drives])
    turned = np.array([in_phase(drive) for drive in drives])
    pairs = neighbours(columns, rows)
    near = neighbours(columns, rows, diagonal=True)
    alone = np.array([space.coordinates(drive) for drive in turned])
    before = _steps(alone, pairs)
    distance, longest = distances(_overlaps(units, near)), _longest_steps(near, columns)
    apart = np.zeros(len(near), dtype=bool)
    while True:
        labels, tree = _components(units, near, apart | (distance > longest))
        phases = _phases(units, labels, pairs, tree)
        stepped = _steps(units * phases[:, None], near)
        frustrated = (labels[near[:, 0]] == labels[near[:, 1]]) & (stepped > longest)
        if not np.any(frustrated & ~apart):
            break
        apart |= frustrated
    phases = phases * _label_phases(drives * phases[:, None], labels)
    placed = units * phases[:, None]
    after = _steps(placed, pairs)
    same = labels[pairs[:, 0]] == labels[pairs[:, 1]]
    synchronised = drives * phases[:, None]
    labels, crossings = _shared_labels(
        labels, _crossings(space, regions, synchronised, labels), near
    )
    return Synchronised(
        drives=synchronised,
        labels=labels.astype(np.uint8),
        crossings=crossings.astype(np.uint8),
        before=Steps.of(before),
        after=Steps.of(after),
        within=Steps.of(after[same]),
    )


def in_phase_at_targets(
    space: FieldSpace, regions: StoredRegions, drives: ComplexArray
) -> Synchronised:
    """Drives that focus, whose phases are right already: each moves its own finger in phase 0.

    All belong together, across the mirrors too. The mean of W under a finger and the RMS in a disc
    are a linear and a convex function of the drive. So a drive mixed of such drives moves the
    finger as much as they do on average, and no disc more.
    """
    units = np.array([space.coordinates(drive) for drive in drives])
    steps = Steps.of(_steps(units, neighbours(*regions.shape)))
    return Synchronised(
        drives=drives,
        labels=np.zeros(len(drives), dtype=np.uint8),
        crossings=np.full((1, 2), JOINED, dtype=np.uint8),
        before=steps,
        after=steps,
        within=steps,
    )


def _steps(units: ComplexArray, pairs: IndexArray) -> FloatArray:
    return np.asarray(np.linalg.norm(units[pairs[:, 0]] - units[pairs[:, 1]], axis=1))


def _overlaps(units: ComplexArray, pairs: IndexArray) -> ComplexArray:
    return np.asarray((units[pairs[:, 1]].conj() * units[pairs[:, 0]]).sum(axis=1))


def distances(overlaps: ComplexArray | complex) -> FloatArray:
    """‖u − v‖ of unit fields by their overlaps, the common phase that suits them best taken out."""
    return np.asarray(np.sqrt(np.maximum(2.0 - 2.0 * np.abs(overlaps), 0.0)))


def _longest_steps(near: IndexArray, columns: int) -> FloatArray:
    """The largest step two neighbours may have; those across a corner are √2 as far away."""
    across = np.abs(near[:, 1] - near[:, 0])
    return np.where((across == 1) | (across == columns), JOIN, np.sqrt(2.0) * JOIN)


def _components(
    units: ComplexArray, near: IndexArray, apart: NDArray[np.bool_]
) -> tuple[IndexArray, list[tuple[int, int]]]:
    """Labels that hold no two neighbours too far apart, and the tree of merges.

    Kruskal's algorithm, the nearest first; two components stay apart when any of their regions are
    neighbours that must.
    """
    count = len(units)
    is_bad = apart | ~np.any(units, axis=1)[near].any(axis=1)
    root = list(range(count))
    kept_apart: list[set[int]] = [set() for _ in range(count)]
    for a, b in near[is_bad].tolist():
        kept_apart[a].add(b)
        kept_apart[b].add(a)

    def find(k: int) -> int:
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    tree = []
    distance = distances(_overlaps(units, near))
    order = np.argsort(np.where(is_bad, np.inf, distance), kind="stable")
    for a, b in near[order[: np.count_nonzero(~is_bad)]].tolist():
        one, other = find(a), find(b)
        if one == other or other in kept_apart[one]:
            continue
        if len(kept_apart[one]) < len(kept_apart[other]):
            one, other = other, one
        root[other] = one
        for third in kept_apart[other]:
            kept_apart[third].discard(other)
            kept_apart[third].add(one)
        kept_apart[one] |= kept_apart[other]
        kept_apart[other] = set()
        tree.append((a, b))
    _, labels = np.unique([find(k) for k in range(count)], return_inverse=True)
    return np.asarray(labels), tree


def _phases(
    units: ComplexArray, labels: IndexArray, pairs: IndexArray, tree: Sequence[tuple[int, int]]
) -> ComplexArray:
    """Phase factors that bring neighbours of one label together, all at once."""
    count = len(units)
    phases = np.ones(count, dtype=np.complex128)
    linked: list[list[int]] = [[] for _ in range(count)]
    for a, b in tree:
        linked[a].append(b)
        linked[b].append(a)
    seen = np.zeros(count, dtype=bool)
    for first in range(count):
        stack = [] if seen[first] else [first]
        seen[first] = True
        while stack:
            k = stack.pop()
            for other in linked[k]:
                if not seen[other]:
                    seen[other] = True
                    overlap = np.vdot(units[other], units[k]) * phases[k]
                    phases[other] = overlap / abs(overlap)
                    stack.append(other)
    inside = pairs[labels[pairs[:, 0]] == labels[pairs[:, 1]]]
    overlap = _overlaps(units, inside)
    # Row b of the matrix takes b's phase as a has it, and the other way round.
    entries = np.concatenate((overlap, overlap.conj()))
    places = (
        np.concatenate((inside[:, 1], inside[:, 0])),
        np.concatenate((inside[:, 0], inside[:, 1])),
    )
    matrix = sparse.csr_array((entries, places), shape=(count, count))
    for _ in range(SWEEPS):
        # Half of each region's own weight keeps the iteration from alternating.
        wished: ComplexArray = np.asarray(matrix @ phases) + 2.0 * phases
        moved: ComplexArray = np.asarray(wished / np.abs(wished))
        if np.abs(moved - phases).max(initial=0.0) < 1e-9:
            break
        phases = moved
    return phases


def _label_phases(drives: ComplexArray, labels: IndexArray) -> ComplexArray:
    """One phase per label, so that its quadrature parts are small and its gains mostly positive."""
    phases = np.ones(len(drives), dtype=np.complex128)
    for label in range(int(labels.max()) + 1):
        own = drives[labels == label]
        phase = turn_in_phase(own)
        phases[labels == label] = phase if np.sum((own * phase).real) >= 0.0 else -phase
    return phases


def _crossings(
    space: FieldSpace, regions: StoredRegions, drives: ComplexArray, labels: IndexArray
) -> IndexArray:
    """What becomes of every label across the mirrors: joined only where all its regions are."""
    columns, rows = regions.shape
    numbers = np.arange(columns * rows).reshape(rows, columns)
    # The regions next to each mirror, or on it.
    lines = (numbers[:, -1], numbers[-1])
    result = np.full((int(labels.max()) + 1, 2), CUT)
    for axis, last in enumerate(lines):
        if not regions.symmetry.has[axis]:
            continue
        exchanged = regions.symmetry.channels(drives.shape[1], np.arange(2) == axis)
        here = np.array([space.coordinates(drive) for drive in drives[last]])
        beyond = np.array([space.coordinates(drive[exchanged]) for drive in drives[last]])
        joined = np.linalg.norm(here - beyond, axis=1) <= JOIN
        negated = np.linalg.norm(here + beyond, axis=1) <= JOIN
        for label in np.unique(labels[last]):
            own = labels[last] == label
            if np.all(joined[own]):
                result[label, axis] = JOINED
            elif np.all(negated[own]):
                result[label, axis] = NEGATED
    return result


def _shared_labels(
    labels: IndexArray, crossings: IndexArray, near: IndexArray
) -> tuple[IndexArray, IndexArray]:
    """At most `MAX_LABELS` labels: more share one where they are no neighbours and cross alike."""
    if len(crossings) <= MAX_LABELS:
        return labels, crossings
    touching: list[set[int]] = [set() for _ in crossings]
    for a, b in labels[near].tolist():
        if a != b:
            touching[a].add(b)
            touching[b].add(a)
    shared: list[int] = []
    kinds: list[tuple[int, ...]] = []
    for label, crossing in enumerate(map(tuple, crossings.tolist())):
        taken = {shared[other] for other in touching[label] if other < label}
        free = [k for k, kind in enumerate(kinds) if kind == crossing and k not in taken]
        if not free:
            kinds.append(crossing)
            free = [len(kinds) - 1]
        shared.append(free[0])
    assert len(kinds) <= MAX_LABELS, "eight neighbours and nine kinds need fewer"
    return np.array(shared)[labels], np.array(kinds)
