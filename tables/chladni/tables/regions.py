"""The places a table tells apart: equal cells that cover the board, numbered row by row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board import MM, Board

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class RegionGrid:
    """columns × rows cells over width × length µm; cell (i, j) has number j · columns + i.

    Whole micrometres, because the device divides integers.
    """

    columns: int
    rows: int
    width_um: int
    length_um: int

    @property
    def count(self) -> int:
        """Number of cells."""
        return self.columns * self.rows

    def centre_mm(self, region: int) -> tuple[float, float]:
        """Centre of a cell, mm from the centre of the board."""
        column, row = region % self.columns, region // self.columns
        return (
            ((column + 0.5) / self.columns - 0.5) * self.width_um / 1000.0,
            ((row + 0.5) / self.rows - 0.5) * self.length_um / 1000.0,
        )

    def region_at(self, x_um: int, y_um: int) -> int:
        """The cell of a place in µm from the centre; places off the board go to the nearest cell.

        The device computes exactly this, in 32-bit integers.
        """
        column = _cell(x_um, self.width_um, self.columns)
        row = _cell(y_um, self.length_um, self.rows)
        return row * self.columns + column

    def mirrored(self, region: int, *, x: bool, y: bool) -> int:
        """The cell that a mirror image of this one covers."""
        column, row = region % self.columns, region // self.columns
        column = self.columns - 1 - column if x else column
        row = self.rows - 1 - row if y else row
        return row * self.columns + column


def _cell(place_um: int, span_um: int, cells: int) -> int:
    # Twice the offset from the lower edge, so that an odd span needs no half micrometre.
    doubled = min(max(2 * place_um + span_um, 0), 2 * span_um - 1)
    return (doubled >> 1) * cells // span_um


def region_grid(board: Board) -> RegionGrid:
    """Cells of about the board's pitch: the nearest whole number of them each way."""
    counts = [max(1, round(side / board.regions.pitch)) for side in board.plate.size]
    width_um, length_um = (round(side / MM * 1000.0) for side in board.plate.size)
    return RegionGrid(counts[0], counts[1], width_um, length_um)
