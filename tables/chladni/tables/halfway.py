"""What is wanted between regions: SSIM at the points half-way from centre to centre.

A load's field changes little from one region to the next, so that of a point between them is
interpolated from the regions' own, and from those of points on the board's edge, which are solved
beside every region there. Only around screws and pins, where a field comes to nothing, and where
regions are wide, each point's own is solved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board import Board
from chladni.sim.metrics import image_of
from chladni.tables import _kernel
from chladni.tables.entry import COARSE_STEP, FINE_STEP, Entry, Wanted
from chladni.tables.folding import Folding
from chladni.tables.regions import RegionGrid
from chladni.tables.scene import Scene

Objectives = tuple[_kernel.Objective, _kernel.Objective]
"""SSIM on every `COARSE_STEP`-th and on every `FINE_STEP`-th image point each way."""

SHARES = ((-1, -1 / 16), (0, 9 / 16), (1, 9 / 16), (2, -1 / 16))
"""Cubic interpolation half-way: what the four nearest regions along a line count."""
NEAR = 1.0
"""Regions from a support within which a point's own field is solved. With it losses of SSIM on
`prototype` are within 0.001 of those by the points' own images."""

OWN_TOLERANCE = 8e-3
"""Error of those fields: beside that of the interpolated ones it is small, and asking for less
would have the plate solved anew, larger, for a few places between a screw and the edge."""
WIDEST_MM = 8.0
"""Pitch up to which fields are interpolated: a load's own peak is a centimetre or two wide."""
KEPT = 512
"""Points whose objectives stay in memory, half a megabyte each: a region's neighbours meet it."""

Place = tuple[int, int]
"""Along x and y in half regions from the first region's centre."""
Target = tuple[float, float]
Fields = list[NDArray[np.complex64]]
"""What a place wants, coarse and fine."""
Lines = tuple[list[int], list[int]]


class Halfway:
    """SSIM against the wanted images on the lattice of half regions.

    Parameters
    ----------
    entries
        Of the stored regions.
    own
        What the `own_places` want.

    Attributes
    ----------
    objectives
        (half_column, half_row) to the two objectives of that point; the last ones are kept.
    """

    def __init__(
        self, scene: Scene, entries: Sequence[Entry], own: Mapping[Place, Wanted],
        grid: RegionGrid, folding: Folding,
    ) -> None:  # fmt: skip
        self._space = scene.space
        self._mirrored = folding.x is not None, folding.y is not None
        self._counts = grid.columns, grid.rows
        self.objectives = lru_cache(KEPT)(self._make)
        columns, _ = folding.shape(grid)
        self._known: dict[Place, Fields] = {
            (2 * (k % columns), 2 * (k // columns)): list(entry.wanted.fields)
            for k, entry in enumerate(entries)
        }
        self._known |= {place: list(wanted.fields) for place, wanted in own.items()}

    def _make(self, half_column: int, half_row: int) -> Objectives:
        """Of a point."""
        fields = self._fields((half_column, half_row))
        coarse, fine = (
            self._space.objective_of(
                self._space.nearest_level(step), image_of(field.astype(np.complex128))
            )
            for step, field in zip((COARSE_STEP, FINE_STEP), fields, strict=True)
        )
        return coarse, fine

    def _fields(self, place: Place) -> Fields:
        known = self._find(place)
        if known is not None:
            return known
        total: Fields = []
        for i, share in _around(place[0], self._counts[0]):
            for j, other in _around(place[1], self._counts[1]):
                own = self._find((i, j))
                if own is None:
                    raise KeyError((i, j))
                parts = [field * np.float32(share * other) for field in own]
                total = [a + b for a, b in zip(total, parts, strict=True)] if total else parts
        return total

    def _find(self, place: Place) -> Fields | None:
        """What is known of a place, or of its mirror image, turned over."""
        images = [
            2 * (count - 1) - at if mirrored and at > count - 1 else at
            for at, count, mirrored in zip(place, self._counts, self._mirrored, strict=True)
        ]
        fields = self._known.get((images[0], images[1]))
        if fields is None:
            return None
        turned = tuple(
            slice(None, None, -1 if image != at else 1)
            for image, at in zip(images, place, strict=True)
        )
        return [field[turned] for field in fields]


def own_places(board: Board, grid: RegionGrid, folding: Folding) -> dict[Place, Target]:
    """Places between regions whose fields are not interpolated, and where they are, mm."""
    lines_x, lines_y = _lines(grid.columns, folding.x), _lines(grid.rows, folding.y)
    places = _on_edge(lines_x, lines_y) + _not_interpolated(board, grid, lines_x[0], lines_y[0])
    # On the edge, whatever rounding says.
    half = np.array([grid.width_um, grid.length_um]) / 2000.0
    targets: dict[Place, Target] = {}
    for place in places:
        x_mm, y_mm = np.clip(grid.halfway_mm(*place), -half, half).tolist()
        targets[place] = x_mm, y_mm
    return targets


def _lines(count: int, mirror: object) -> Lines:
    """Where along an axis the stored part has its points, and which of them are on the edge."""
    last = count - 1 if mirror is not None else 2 * count - 1
    return list(range(-1, last + 1)), [at for at in (-1, 2 * count - 1) if at <= last]


def _on_edge(lines_x: Lines, lines_y: Lines) -> list[Place]:
    """Points of the stored part's edge, beside every region and at the corners."""
    (along_x, edges_x), (along_y, edges_y) = lines_x, lines_y
    return [
        (i, j)
        for i in along_x
        for j in along_y
        if (i in edges_x or i % 2 == 0) and (j in edges_y or j % 2 == 0)
        and (i in edges_x or j in edges_y)
    ]  # fmt: skip


def _not_interpolated(
    board: Board, grid: RegionGrid, along_x: list[int], along_y: list[int]
) -> list[Place]:
    """Points of the stored part that are near supports, or all of them if regions are wide."""
    reach = NEAR if max(grid.pitch_mm) <= WIDEST_MM else np.inf
    supports = np.array(
        [screw.at for screw in board.screws] + [pin.at for pin in board.pins]
    ).reshape(-1, 2)
    found = []
    for place in product(along_x, along_y):
        at = np.array(grid.halfway_mm(*place))
        apart = np.linalg.norm((at - supports * 1e3) / grid.pitch_mm, axis=1)
        if apart.min(initial=np.inf) <= reach and (place[0] % 2 or place[1] % 2):
            found.append(place)
    return found


def _around(at: int, count: int) -> list[tuple[int, float]]:
    """Places along a line that have fields of their own, and their shares in one between them."""
    if at % 2 == 0 or at in (-1, 2 * count - 1):
        return [(at, 1.0)]
    return [(min(max(at + 2 * k - 1, 0), 2 * count - 2), share) for k, share in SHARES]
