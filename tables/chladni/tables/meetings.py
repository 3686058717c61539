"""Where neighbours' drives meet: the points between regions, at which a device mixes them.

While integers are searched one region after the other, what is stored already stands; a region's
own must suit it half-way to each neighbour of its label, and to its own image across a mirror.
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
from chladni.tables.lookup import labels_of, signs_of
from chladni.tables.regions import RegionGrid
from chladni.tables.scene import Scene

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

COARSE_STEP = 4
"""Images between regions, and models of SSIM, have every fourth image point each way."""


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

    `mix` is the identity, and what a mirror adds where a region meets its own image. `image` is the
    mean of all wanted images, coarse, which is as good as the point's own.
    """

    share: float
    mix: FloatArray
    exact: ComplexArray
    decoded: ComplexArray
    image: FloatArray


class Coded:
    """What is stored so far, and where a region's drive will be mixed with it."""

    def __init__(
        self, scene: Scene, entries: Sequence[Entry], arranged: Arranged, grid: RegionGrid,
        folding: Folding,
    ) -> None:  # fmt: skip
        self.predictor = Predictor(arranged.labels, 2 * entries[0].drive.size)
        self._entries, self._arranged = entries, arranged
        self._grid, self._folding = grid, folding
        self._columns = folding.shape(grid)[0]
        self._nodes = folding.nodes(grid)
        self._orders = folding.orders(entries[0].drive.size)
        self._done = np.zeros(len(entries), dtype=bool)
        level = scene.space.nearest_level(COARSE_STEP)
        self._images = [level.sample(entry.image.astype(np.float64)) for entry in entries]

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
        """Points half-way to stored neighbours of the same label, and between four of them."""
        row, column = divmod(at, self._columns)
        found = []
        for right, up in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            corners = {(right, up), (right, 0), (0, up)} - {(0, 0)}
            known = [self._find(column + i, row + j, at) for i, j in sorted(corners)]
            parts = [part for part in known if part is not None]
            if len(parts) == len(known):
                mix, exact, decoded, images = (sum(terms) for terms in zip(*parts, strict=True))
                share = 1.0 / (1 + len(parts))
                image = share * (images + self._images[at])
                found.append(Meeting(share, np.eye(len(exact)) + mix, exact, decoded, image))
        return found

    def _find(
        self, column: int, row: int, at: int
    ) -> tuple[FloatArray, ComplexArray, ComplexArray, FloatArray] | None:
        """What a neighbour of the same label adds to a meeting's mix, exact, decoded and images."""
        if not (0 <= column < self._nodes[0] and 0 <= row < self._nodes[1]):
            return None
        cell = self._folding.cells(self._grid, np.array(column), np.array(row))
        k, flips = int(cell.stored), cell.flips
        label = self._arranged.labels[at]
        if labels_of(self._arranged, cell) != label:
            return None
        sign = float(signs_of(self._arranged, label, flips))
        order = self._orders[int(flips[0]), int(flips[1])]
        size = order.size
        image = self._images[k][:: -1 if flips[0] else 1, :: -1 if flips[1] else 1]
        if k == at:
            mirror = np.zeros((size, size))
            mirror[order, np.arange(size)] = sign
            nothing = np.zeros(size, np.complex128)
            return mirror, nothing, nothing, image
        if not self._done[k]:
            return None
        exact, decoded = self._entries[k].drive, as_drive(self.predictor.values[k])
        return np.zeros((size, size)), sign * exact[order], sign * decoded[order], image
