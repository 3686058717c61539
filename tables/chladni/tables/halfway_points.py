"""Test points half-way between regions, where losses are measured, and their target fields.

Half-way from centre to centre the device mixes drives that differ most. A load's field changes
little from one region to the next, so that of a point between them is interpolated from the
regions' own, and from those of points on the board's edge, which are solved beside every region
there. Around screws and pins, where a field comes to nothing, each point's own is solved; and so
is every measured point's where regions are wide or few, and where there are too many points to
measure them all.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.region_grid import RegionGrid
from chladni.sim.board.board import Board
from chladni.tables.stored_regions import HalfPlace, StoredRegions

SHARES = ((-1, -1 / 16), (0, 9 / 16), (1, 9 / 16), (2, -1 / 16))
"""Cubic interpolation half-way: what the four nearest regions along a line count."""
NEAR = 1.0
"""Regions from a support within which a point's own field is solved. With it losses of SSIM on
`prototype` are within 0.001 of those by the points' own images."""

OWN_TOLERANCE = 8e-3
"""Error of those fields: beside that of the interpolated ones it is small, and asking for less
would have the plate solved again, larger, for a few places between a screw and the edge."""
WIDEST_MM = 8.0
"""Pitch up to which fields are interpolated: a load's own peak is a centimetre or two wide."""
MOST_POINTS = 1000
"""Regions, and points between them, at which losses are measured; drawn at random of more."""
SEED = 2

Target = tuple[float, float]
Field = NDArray[np.complex64]
Lines = tuple[list[int], list[int]]


def measured_indices(count: int) -> NDArray[np.intp]:
    """Which of so many points are measured, ascending: all, or `MOST_POINTS` at random."""
    if count <= MOST_POINTS:
        return np.arange(count)
    chosen = np.random.default_rng(SEED).choice(count, MOST_POINTS, replace=False)
    return np.sort(chosen).astype(np.intp)


def halfway_places(regions: StoredRegions) -> list[HalfPlace]:
    """Points half-way from stored regions to the next in x, in y and in both."""
    every = [
        (i + right, j + up) for right, up in ((1, 0), (0, 1), (1, 1)) for i, j in regions.centres
    ]
    return [every[k] for k in measured_indices(len(every)).tolist()]


def own_places(board: Board, regions: StoredRegions, places: list[HalfPlace]) -> list[HalfPlace]:
    """Places whose fields are solved: from these and the regions' own, those of all are known."""
    grid, mirrors = regions.grid, regions.symmetry.has
    if 3 * regions.count > len(places):
        return places
    lines_x, lines_y = _lines(grid.columns, mirrors[0]), _lines(grid.rows, mirrors[1])
    few = _on_edge(lines_x, lines_y) + _not_interpolated(board, grid, lines_x[0], lines_y[0])
    return few if len(few) < len(places) else places


def target_of(grid: RegionGrid, place: HalfPlace) -> Target:
    """Where a place is, mm; on the edge, rounding or not."""
    half = np.array([grid.width_um, grid.length_um]) / 2000.0
    x_mm, y_mm = np.clip(grid.halfway_mm(*place), -half, half).tolist()
    return x_mm, y_mm


class HalfwayFields:
    """Fields of unit loads on the lattice of half regions, of those that are known.

    Parameters
    ----------
    known
        Solved fields by place, on some image points.
    """

    def __init__(self, known: Mapping[HalfPlace, Field], regions: StoredRegions) -> None:
        self._known = known
        self._mirrored = regions.symmetry.has
        self._counts = regions.grid.columns, regions.grid.rows

    def at(self, place: HalfPlace) -> Field:
        """The field of a place: known, a mirror image, or interpolated."""
        known = self._find(place)
        if known is not None:
            return known
        parts = []
        for i, share in _around(place[0], self._counts[0]):
            for j, other in _around(place[1], self._counts[1]):
                own = self._find((i, j))
                if own is None:
                    raise KeyError((i, j))
                parts.append(own * np.float32(share * other))
        return np.asarray(sum(parts[1:], parts[0]))

    def _find(self, place: HalfPlace) -> Field | None:
        """What is known of a place, or of its mirror image, turned over."""
        images = [
            2 * (count - 1) - at if mirrored and at > count - 1 else at
            for at, count, mirrored in zip(place, self._counts, self._mirrored, strict=True)
        ]
        field = self._known.get(place)
        if field is not None:
            return field
        field = self._known.get((images[0], images[1]))
        if field is None:
            return None
        x, y = (
            slice(None, None, -1 if image != at else 1)
            for image, at in zip(images, place, strict=True)
        )
        return field[x, y]


def _lines(count: int, is_mirrored: bool) -> Lines:
    """Where along an axis the stored part has its points, and which of them are on the edge."""
    last = count - 1 if is_mirrored else 2 * count - 1
    return list(range(-1, last + 1)), [at for at in (-1, 2 * count - 1) if at <= last]


def _on_edge(lines_x: Lines, lines_y: Lines) -> list[HalfPlace]:
    """Points of the stored part's edge, beside every region and at the corners."""
    (along_x, edges_x), (along_y, edges_y) = lines_x, lines_y
    return [
        (i, j)
        for i in along_x
        for j in along_y
        if (i in edges_x or i % 2 == 0)
        and (j in edges_y or j % 2 == 0)
        and (i in edges_x or j in edges_y)
    ]


def _not_interpolated(
    board: Board, grid: RegionGrid, along_x: list[int], along_y: list[int]
) -> list[HalfPlace]:
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
