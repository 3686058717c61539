"""Where neighbours' drives meet: the points between regions, at which a device mixes them.

While integers are searched one region after the other, what is stored already stands; a region's
own must suit it half-way to each neighbour, and to its own image across a mirror.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.tables.branches import Arranged
from chladni.tables.coding import FULL_SCALE, Predictor, Visit
from chladni.tables.entry import Entry
from chladni.tables.folding import Folding
from chladni.tables.halfway import Halfway, Objectives
from chladni.tables.lookup import labels_of, signs_of
from chladni.tables.regions import RegionGrid

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def as_drive(values: IntArray) -> ComplexArray:
    """Integers, in-phase and quadrature alternating, as drives in units of the largest gain."""
    scaled = values / FULL_SCALE
    return np.asarray(scaled[..., 0::2] + 1j * scaled[..., 1::2])


def apart(visits: Sequence[Visit], columns: int) -> list[list[Visit]]:
    """Visits in batches of which none meets another, so that each may be fitted by itself."""
    batches: list[list[Visit]] = []
    taken: list[set[tuple[int, int]]] = []
    for visit in visits:
        row, column = divmod(visit.at, columns)
        around = {(row + j, column + i) for j in (-1, 0, 1) for i in (-1, 0, 1)}
        k = next((k for k, places in enumerate(taken) if not places & around), len(batches))
        if k == len(batches):
            batches.append([])
            taken.append(set())
        batches[k].append(visit)
        taken[k].add((row, column))
    return batches


@dataclass(frozen=True)
class Meeting:
    """A point between regions: its drive is share · (a region's drive · mix + the others' sum).

    `mix` is the identity times as often as the region stands for a corner, and what a mirror adds
    where it meets its own image. `ssim` is by what the point wants, coarse and fine.
    """

    share: float
    mix: FloatArray
    exact: ComplexArray
    decoded: ComplexArray
    ssim: Objectives


@dataclass(frozen=True)
class _Corner:
    """A region around a point, as the region that is being fitted sees it."""

    is_member: bool
    """Of the same label: its drive is mixed in. A stranger gives way to a member beside it."""
    mix: FloatArray
    exact: ComplexArray
    decoded: ComplexArray


@dataclass(frozen=True)
class Uncoded:
    """One frequency's drives before they are integers, and what is wanted around them.

    Attributes
    ----------
    entries
        Of the stored regions, with the drives of `arranged`.
    """

    grid: RegionGrid
    folding: Folding
    entries: Sequence[Entry]
    arranged: Arranged
    halfway: Halfway


class Coded:
    """What is stored so far, and where a region's drive will be mixed with it."""

    def __init__(self, uncoded: Uncoded) -> None:
        entries, arranged = uncoded.entries, uncoded.arranged
        grid, folding = uncoded.grid, uncoded.folding
        self.predictor = Predictor(arranged.labels, 2 * entries[0].drive.size)
        self._entries, self._arranged = entries, arranged
        self._grid, self._folding = grid, folding
        self._columns = folding.shape(grid)[0]
        self._nodes = folding.nodes(grid)
        self._orders = folding.orders(entries[0].drive.size)
        self._done = np.zeros(len(entries), dtype=bool)
        self._halfway = uncoded.halfway

    def hold(self, visit: Visit, values: IntArray) -> None:
        """A region's integers are known, but not yet its turn in the stream."""
        self.predictor.values[visit.at] = values
        self._done[visit.at] = True

    def held(self, visit: Visit) -> IntArray | None:
        """What was found for a region before its turn."""
        return self.predictor.values[visit.at] if self._done[visit.at] else None

    def put(self, visit: Visit, values: IntArray) -> None:
        """A region's turn in the stream."""
        self.hold(visit, values)
        self.predictor.put(visit, values)

    def meetings(self, at: int) -> list[Meeting]:
        """Points half-way to neighbours, between four regions, and on the board's edge.

        Across a cut the point counts as this side of it, where the device still plays this label.
        What is not stored yet counts as exact: without that, the regions stored first would use up
        all that may be lost, and the last ones find no drive that makes up for it.
        """
        row, column = divmod(at, self._columns)
        found: dict[tuple[tuple[int, ...], ...], Meeting] = {}
        for right, up in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            # Short of the first centre the device mixes as on it, with nothing of the next.
            short_x, short_y = column == 0 and right < 0, row == 0 and up < 0
            along_x, along_y = 1 if short_x else right, 1 if short_y else up
            corners = [
                self._corner(column + i * along_x, row + j * along_y, at)
                for j in (0, 1) for i in (0, 1)
            ]  # fmt: skip
            if (corners[1] is None and column > 0) or (corners[2] is None and row > 0):
                continue  # beyond a mirror, where all is as on this side
            for i, j in ((1, 0), (0, 1), (1, 1)):
                used = [
                    x + 2 * y
                    for y in range(2 if j and not short_y else 1)
                    for x in range(2 if i and not short_x else 1)
                ]
                if any(corners[k] is None for k in used):
                    continue
                taken = [_in_place_of(k, corners) for k in used]
                mixed = [corner for k in taken if (corner := corners[k]) is not None]
                place = 2 * column + i * right, 2 * row + j * up
                drives = tuple((k % 2 * along_x, k // 2 * along_y) for k in taken)
                found[place, *drives] = _meeting(mixed, self._halfway.objectives(*place))
        return list(found.values())

    def _corner(self, column: int, row: int, at: int) -> _Corner | None:
        """A region as `at` sees it; None where a mirror makes it another's business.

        Beyond the last one it is that again: all is flat off the outermost centres.
        """
        if self._folding.x is None:
            column = min(column, self._grid.columns - 1)
        if self._folding.y is None:
            row = min(row, self._grid.rows - 1)
        if column >= self._nodes[0] or row >= self._nodes[1]:
            return None
        cell = self._folding.cells(self._grid, np.array(column), np.array(row))
        k, flips = int(cell.stored), cell.flips
        label = self._arranged.labels[at]
        is_member = bool(labels_of(self._arranged, cell) == label)
        sign = float(signs_of(self._arranged, label, flips))
        order = self._orders[int(flips[0]), int(flips[1])]
        size = order.size
        mix, nothing = np.zeros((size, size)), np.zeros(size, np.complex128)
        if k == at:
            mix[order, np.arange(size)] = sign
            return _Corner(is_member, mix, nothing, nothing)
        exact = self._entries[k].drive
        decoded = as_drive(self.predictor.values[k]) if self._done[k] else exact
        return _Corner(is_member, mix, sign * exact[order], sign * decoded[order])


def _in_place_of(k: int, corners: Sequence[_Corner | None]) -> int:
    """The corner whose drive stands at corner k, by the rule of `lookup`."""
    for other in (k, k ^ 1, k ^ 2):
        corner = corners[other]
        if corner is not None and corner.is_member:
            return other
    return k ^ 3


def _meeting(mixed: Sequence[_Corner], ssim: Objectives) -> Meeting:
    share = 1.0 / len(mixed)
    return Meeting(
        share,
        np.sum([corner.mix for corner in mixed], axis=0),
        np.sum([corner.exact for corner in mixed], axis=0),
        np.sum([corner.decoded for corner in mixed], axis=0),
        ssim,
    )
