"""Regions of a board, which a table tells apart: equal cells, numbered row by row."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM

IntArray = NDArray[np.int64]

FRACTION_BITS = 8
"""Places are told apart to 1/256 of a cell."""


@dataclass(frozen=True)
class RegionGrid:
    """columns × rows cells over width × length µm; cell (i, j) has number j · columns + i.

    Whole micrometres and integer arithmetic throughout: the device computes exactly this.
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

    @property
    def pitch_mm(self) -> tuple[float, float]:
        """From one centre to the next along x and y, mm."""
        return self.width_um / self.columns / 1000.0, self.length_um / self.rows / 1000.0

    def halfway_mm(self, half_column: int, half_row: int) -> tuple[float, float]:
        """A point counted in half cells from the first cell's centre, mm from the board's."""
        x, y = self.centre_mm(0)
        along_x, along_y = self.pitch_mm
        return x + half_column * along_x / 2.0, y + half_row * along_y / 2.0

    def position(self, x_um: IntArray, y_um: IntArray) -> tuple[IntArray, IntArray]:
        """Places in µm from the centre as 1/256 cells from the lower left; off the board, its edge.

        A cell's width is rounded up to a fraction of a micrometre that lets the device multiply in
        32 bits: a place is off by 1/4000 of the board at most.
        """
        x, y = self.offsets(x_um, y_um)
        return position(x, self.width_um, self.columns), position(y, self.length_um, self.rows)

    def offsets(self, x_um: IntArray, y_um: IntArray) -> tuple[IntArray, IntArray]:
        """Places in µm from the centre as µm from the lower left corner, within the board."""
        return _offset(x_um, self.width_um), _offset(y_um, self.length_um)

    def region_at(self, x_um: int, y_um: int) -> int:
        """The cell of a place in µm from the centre; off the board, the nearest cell."""
        column, row = self.position(np.array(x_um), np.array(y_um))
        return int(row >> FRACTION_BITS) * self.columns + int(column >> FRACTION_BITS)


def step_of(span_um: int, cells: int) -> tuple[int, int]:
    """(k, shift): an offset of d µm is (d · k) >> shift in 1/256 cells, within 32 bits."""
    shift = 32 - FRACTION_BITS - cells.bit_length()
    return (cells << (FRACTION_BITS + shift)) // span_um, shift


def _offset(place_um: IntArray, span_um: int) -> IntArray:
    return np.clip(np.asarray(place_um, dtype=np.int64) + span_um // 2, 0, span_um - 1)


def position(offset_um: IntArray, span_um: int, cells: int) -> IntArray:
    """Offsets from an edge, µm, in 1/256 cells."""
    k, shift = step_of(span_um, cells)
    return np.asarray((offset_um * k) >> shift)


def region_grid(board: Board, pitch: float | None = None) -> RegionGrid:
    """Cells of about a pitch (m), by default the board's: the nearest whole number each way."""
    about = board.regions.pitch if pitch is None else pitch
    counts = [max(1, round(side / about)) for side in board.plate.size]
    width_um, length_um = (round(side / MM * 1000.0) for side in board.plate.size)
    return RegionGrid(counts[0], counts[1], width_um, length_um)
