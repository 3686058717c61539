"""Mirrors of a board: regions whose drives are others' images, and are not stored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.places import RegionGrid

Order = tuple[int, ...]
IndexArray = NDArray[np.intp]


@dataclass(frozen=True)
class Cells:
    """Where the drives of some regions are found.

    Attributes
    ----------
    stored
        Position among the stored regions, any shape.
    flips
        Whether the region is a mirror image in x and in y, shape (…, 2).
    """

    stored: IndexArray
    flips: NDArray[np.bool_]


@dataclass(frozen=True)
class Folding:
    """Mirrors whose images are not stored: the order of the actuators each stands for, or None."""

    x: Order | None = None
    y: Order | None = None

    @property
    def flags(self) -> int:
        """Bit 0 for x, bit 1 for y."""
        return int(self.x is not None) | int(self.y is not None) << 1

    def nibbles(self, axis: int) -> int:
        """The order of one mirror, four bits an actuator; 0 without that mirror."""
        order = (self.x, self.y)[axis]
        return sum(image << (4 * k) for k, image in enumerate(order)) if order else 0

    def shape(self, grid: RegionGrid) -> tuple[int, int]:
        """Columns and rows that are stored: those at small x and small y."""
        return (
            stored_cells(grid.columns, self.x is not None),
            stored_cells(grid.rows, self.y is not None),
        )

    def nodes(self, grid: RegionGrid) -> tuple[int, int]:
        """Columns and rows to mix between: the stored ones, and an image that the last one meets.

        An odd number of cells has its middle one on the mirror, and nothing beyond it to meet.
        """
        columns, rows = self.shape(grid)
        return (
            columns + (self.x is not None and grid.columns % 2 == 0),
            rows + (self.y is not None and grid.rows % 2 == 0),
        )

    def stored(self, grid: RegionGrid) -> IndexArray:
        """Numbers of the stored regions, ascending."""
        columns, rows = self.shape(grid)
        return (np.arange(rows)[:, None] * grid.columns + np.arange(columns)).ravel()

    def cells(self, grid: RegionGrid, column: IndexArray, row: IndexArray) -> Cells:
        """Where the drives of cells are found."""
        flip_x = (self.x is not None) & (2 * column >= grid.columns)
        flip_y = (self.y is not None) & (2 * row >= grid.rows)
        column = np.where(flip_x, grid.columns - 1 - column, column)
        row = np.where(flip_y, grid.rows - 1 - row, row)
        return Cells(row * self.shape(grid)[0] + column, np.stack((flip_x, flip_y), axis=-1))

    def regions(self, grid: RegionGrid) -> Cells:
        """Where the drive of every region is found, in the order of their numbers."""
        row, column = np.divmod(np.arange(grid.count), grid.columns)
        return self.cells(grid, column, row)

    def orders(self, actuators: int) -> IndexArray:
        """The stored channel that each channel plays, by flip in x and y: (2, 2, actuators)."""
        orders = np.empty((2, 2, actuators), dtype=np.intp)
        for flip_x in (0, 1):
            for flip_y in (0, 1):
                order = np.arange(actuators)
                if flip_x and self.x is not None:
                    order = order[list(self.x)]
                if flip_y and self.y is not None:
                    order = order[list(self.y)]
                orders[flip_x, flip_y] = order
        return orders


def stored_cells(cells: int, is_mirrored: bool) -> int:
    """Cells along one direction that are stored."""
    return (cells + 1) // 2 if is_mirrored else cells


UNFOLDED = Folding()
"""Every region stored."""
