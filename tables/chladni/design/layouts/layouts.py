"""Where coils stand: orbits under the plate's mirrors, each with the coordinates left open."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Place = tuple[float, float]

SPACINGS = 4
"""Of rows and columns, from the least to the widest."""


@dataclass(frozen=True)
class Orbit:
    """A coil and its images: whether it may leave the middle line x = 0, and y = 0."""

    leaves: tuple[bool, bool]

    def size(self, mirrors: tuple[bool, bool]) -> int:
        """How many coils it is."""
        doubles = [mirror and own for mirror, own in zip(mirrors, self.leaves, strict=True)]
        return int(2 ** sum(doubles))


@dataclass(frozen=True)
class Layout:
    """Coils of a board, as orbits under the mirrors that are to be kept."""

    mirrors: tuple[bool, bool]
    orbits: tuple[Orbit, ...]

    @property
    def coils(self) -> int:
        """How many."""
        return sum(orbit.size(self.mirrors) for orbit in self.orbits)

    @property
    def unknowns(self) -> int:
        """How many coordinates are open."""
        return sum(sum(orbit.leaves) for orbit in self.orbits)

    def places(self, shares: Sequence[float], reach: Place) -> list[Place]:
        """Places of all coils, from below left to above right.

        Parameters
        ----------
        shares
            0 to 1 for each open coordinate: of the way from the middle to `reach` where a mirror is
            kept, from one side to the other where none is.
        reach
            The farthest a coil may stand from the middle lines, in any unit.
        """
        left, found = list(shares), []
        for orbit in self.orbits:
            own: list[tuple[float, ...]] = []
            for axis in (0, 1):
                share = left.pop(0) if orbit.leaves[axis] else None
                if share is None:
                    own.append((0.0,))
                elif self.mirrors[axis]:
                    own.append((-share * reach[axis], share * reach[axis]))
                else:
                    own.append(((2.0 * share - 1.0) * reach[axis],))
            found += list(product(*own))
        # 0.1 µm: what files show is what was computed.
        rounded = {(round(x, 4) + 0.0, round(y, 4) + 0.0) for x, y in found}
        return sorted(rounded, key=lambda place: (place[1], place[0]))

    def shares(self, representatives: Sequence[Place], reach: Place) -> list[float]:
        """What `places` is to be given for an orbit's first coil at each of these places."""
        found = []
        for orbit, place in zip(self.orbits, representatives, strict=True):
            for axis in (0, 1):
                if not orbit.leaves[axis]:
                    continue
                at, far = place[axis], reach[axis]
                share = abs(at) if self.mirrors[axis] else (at + far) / 2.0
                found.append(float(share / far) if far > 0.0 else 0.5)
        return found


@dataclass(frozen=True)
class Candidate:
    """An orbit at a place of its first coil, in metres."""

    orbit: Orbit
    at: Place
    images: tuple[Place, ...]


def candidates(
    mirrors: tuple[bool, bool], reach: Place, step: float, least: float
) -> list[Candidate]:
    """Orbits on a grid of a step, m, whose own coils keep `least` apart from each other."""
    axes = [_axis(mirrors[axis], reach[axis], step).tolist() for axis in (0, 1)]
    found = []
    for x, y in product(*axes):
        found.append(_candidate((x, y), mirrors))
    return [one for one in found if closest(one.images) >= least]


def lattices(
    count: int, mirrors: tuple[bool, bool], reach: Place, least: float
) -> Iterator[list[Candidate]]:
    """Rows and columns of so many coils about the middle, evenly apart: close, wide and between."""
    for columns in range(1, count + 1):
        rows, rest = divmod(count, columns)
        if rest:
            continue
        axes = [_even(n, far, least) for n, far in zip((columns, rows), reach, strict=True)]
        for x, y in product(*axes):
            firsts = product(
                *(
                    [at for at in own if at >= 0.0 or not mirror]
                    for own, mirror in zip((x, y), mirrors, strict=True)
                )
            )
            yield [_candidate((first[0], first[1]), mirrors) for first in firsts]


def spread_out(
    count: int, mirrors: tuple[bool, bool], size: Place, least: float
) -> Iterator[list[Candidate]]:
    """Coils in the middles of equal cells of a plate, m: in all of them, or in every other one.

    Five in every other cell of three by three stand as a quincunx.
    """
    for columns, rows in product(range(1, 2 * count + 2), repeat=2):
        x, y = (
            [round(((k + 0.5) / n - 0.5) * side, 9) + 0.0 for k in range(n)]
            for n, side in zip((columns, rows), size, strict=True)
        )
        cells = list(product(range(columns), range(rows)))
        ways = [cells] if columns * rows == count else []
        if columns % 2 and rows % 2 and min(columns, rows) > 1:
            ways += [[(i, j) for i, j in cells if (i + j) % 2 == odd] for odd in (0, 1)]
        for own in ways:
            places = [(x[i], y[j]) for i, j in own]
            if len(places) == count and closest(places) >= least - 1e-9:
                firsts = [
                    place
                    for place in places
                    if all(a >= 0.0 or not m for a, m in zip(place, mirrors, strict=True))
                ]
                yield [_candidate(first, mirrors) for first in firsts]


def _even(number: int, reach: float, least: float) -> list[list[float]]:
    """Coordinates of so many, at a few spacings from the least to the widest."""
    widest = 2.0 * reach / (number - 1) if number > 1 else least
    if widest < least:
        return []
    steps = np.unique(np.linspace(least, widest, SPACINGS))
    return [
        [round((k - (number - 1) / 2.0) * step, 9) + 0.0 for k in range(number)]
        for step in steps.tolist()
    ]


def _candidate(at: Place, mirrors: tuple[bool, bool]) -> Candidate:
    # Where a mirror is not kept, 0 is a coordinate like all others.
    leaves = (at[0] != 0.0 or not mirrors[0], at[1] != 0.0 or not mirrors[1])
    x, y = (
        (-along, along) if mirror and away else (along,)
        for along, mirror, away in zip(at, mirrors, leaves, strict=True)
    )
    return Candidate(Orbit(leaves), at, tuple(product(x, y)))


def closest(places: Sequence[Place]) -> float:
    """The least distance of two of them; infinite for one."""
    if len(places) < 2:
        return np.inf
    at = np.array(places)
    apart = np.hypot(*(at[:, None] - at).transpose(2, 0, 1))
    return float(apart[np.triu_indices(len(at), 1)].min())


def makeups(count: int, offers: Mapping[int, int]) -> Iterator[tuple[int, ...]]:
    """Ways to make so many coils of orbits of these sizes, of each as many as are offered.

    Small orbits, which can stand at few places, come first in each.
    """
    if not offers:
        if count == 0:
            yield ()
        return
    largest = max(offers)
    others = {size: number for size, number in offers.items() if size != largest}
    for number in range(min(count // largest, offers[largest]), -1, -1):
        for rest in makeups(count - number * largest, others):
            yield rest + (largest,) * number


def _axis(mirror: bool, reach: float, step: float) -> FloatArray:
    half = np.arange(0.0, reach + 1e-9, step)
    return half if mirror else np.concatenate([-half[:0:-1], half])
