"""The regions that a table stores, and where among them the drive of any region is found.

A stored region of a mirrored board stands for its images: those at small x and small y are stored.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.region_grid import RegionGrid, region_grid
from chladni.sim.board.board import Board
from chladni.sim.fields.board_mirrors import board_mirrors
from chladni.tables.mirror_symmetry import MirrorSymmetry, stored_cells

IndexArray = NDArray[np.intp]
HalfPlace = tuple[int, int]
"""Along x and y in half regions from the first region's centre."""


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
class StoredRegions:
    """A board's regions with its mirrors."""

    grid: RegionGrid
    symmetry: MirrorSymmetry

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Columns and rows that are stored."""
        return (
            stored_cells(self.grid.columns, self.symmetry.has[0]),
            stored_cells(self.grid.rows, self.symmetry.has[1]),
        )

    @property
    def count(self) -> int:
        """How many are stored."""
        return self.shape[0] * self.shape[1]

    @property
    def nodes(self) -> tuple[int, int]:
        """Columns and rows to mix between: the stored ones, and an image that the last one meets.

        An odd number of cells has its middle one on the mirror, and nothing beyond it to meet.
        """
        (columns, rows), (in_x, in_y) = self.shape, self.symmetry.has
        return (
            columns + (in_x and self.grid.columns % 2 == 0),
            rows + (in_y and self.grid.rows % 2 == 0),
        )

    @cached_property
    def numbers(self) -> IndexArray:
        """Which regions are stored, ascending."""
        columns, rows = self.shape
        return (np.arange(rows)[:, None] * self.grid.columns + np.arange(columns)).ravel()

    @property
    def centres(self) -> list[HalfPlace]:
        """Centres of the stored regions, in their order."""
        columns = self.grid.columns
        return [(2 * (k % columns), 2 * (k // columns)) for k in self.numbers.tolist()]

    def cells(self, column: IndexArray, row: IndexArray) -> Cells:
        """Where the drives of cells are found."""
        in_x, in_y = self.symmetry.has
        flip_x = in_x & (2 * column >= self.grid.columns)
        flip_y = in_y & (2 * row >= self.grid.rows)
        column = np.where(flip_x, self.grid.columns - 1 - column, column)
        row = np.where(flip_y, self.grid.rows - 1 - row, row)
        return Cells(row * self.shape[0] + column, np.stack((flip_x, flip_y), axis=-1))

    @cached_property
    def everywhere(self) -> Cells:
        """Where the drive of every region is found, in the order of their numbers."""
        row, column = np.divmod(np.arange(self.grid.count), self.grid.columns)
        return self.cells(column, row)


def stored_regions(board: Board, pitch: float | None = None) -> StoredRegions:
    """The regions of a board that its mirrors leave to be stored, of about a pitch (m).

    By default the pitch is the board's.
    """
    found = board_mirrors(board)
    return StoredRegions(region_grid(board, pitch), MirrorSymmetry(found.x, found.y))
