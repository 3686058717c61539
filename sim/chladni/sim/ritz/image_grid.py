"""Ritz fields on a rectangular grid, at the cost of a quarter of it where both mirrors hold."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrored_grid import MirroredGrid, Oddness
from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis import Basis
from chladni.sim.ritz.parity import Parity, ParityBasis

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


class GridTable:
    """The basis on the grid x × y (m), or on its fundamental part if the grid has the mirrors."""

    def __init__(self, basis: Basis, mirrors: Mirrors, x: FloatArray, y: FloatArray) -> None:
        self.x, self.y = x, y
        self._basis = basis
        self.grid = MirroredGrid(x, y, mirrors.shared_with(x, y))
        part_x, part_y = self.grid.part_x, self.grid.part_y
        self._along_x = basis.along_x.evaluate(part_x)
        self._along_y = basis.along_y.evaluate(part_y)
        px, py = np.meshgrid(part_x, part_y, indexing="ij")
        self._by_class: dict[Parity, tuple[FloatArray, FloatArray, FloatArray]] = {}
        self._circles = basis.enrichment_values(px.ravel(), py.ravel(), (0, 0))

    def fields(self, parities: list[ParityBasis], columns: list[FloatArray]) -> FloatArray:
        """Sum over classes of the fields of real coefficients (class size, fields).

        Returns
        -------
        FloatArray
            Shape (fields, nx, ny).
        """
        return self.grid.join(self.shares(parities, columns))

    def shares(
        self, parities: list[ParityBasis], columns: list[FloatArray]
    ) -> dict[Oddness, FloatArray]:
        """The same class by class on the fundamental part, shape (fields, *part_shape) each."""
        return {
            parity.oddness: self.share(parity, own)
            for parity, own in zip(parities, columns, strict=True)
        }

    def clear_cut_out(self, values: NDArray[Any]) -> None:
        """Set fields to zero where a screw holds the plate or a hole leaves none, in place."""
        rows, columns = self._cut_out
        values[..., rows, columns] = 0.0

    @cached_property
    def _cut_out(self) -> tuple[IntArray, IntArray]:
        """Indices of the points where there is no plate to move."""
        cut = np.zeros((self.x.size, self.y.size), dtype=bool)
        for x, y, radius in self._basis.geometry.cut_out:
            cut |= np.hypot(self.x[:, None] - x, self.y - y) <= radius
        geometry = self._basis.geometry
        if geometry.corner_radius > 0.0:
            beyond_x = np.abs(self.x) - (geometry.width / 2.0 - geometry.corner_radius)
            beyond_y = np.abs(self.y) - (geometry.length / 2.0 - geometry.corner_radius)
            in_corner = (beyond_x[:, None] > 0.0) & (beyond_y > 0.0)
            cut |= in_corner & (np.hypot(beyond_x[:, None], beyond_y) > geometry.corner_radius)
        rows, columns = np.nonzero(cut)
        return rows, columns

    def share(self, parity: ParityBasis, columns: FloatArray) -> FloatArray:
        """The fundamental part of a class's fields: (class size, fields) to (fields, nx, ny).

        Fields without a share in this class are left out.
        """
        along_x, along_y, circles = self._class_tables(parity)
        used = np.flatnonzero(columns.any(axis=0))
        own = np.ascontiguousarray(columns[:, used].T)
        p = parity.polynomials
        grid = own[:, :p].reshape(used.size, along_x.shape[1], along_y.shape[0])
        part = (own[:, p:] @ circles).reshape(used.size, *self.grid.part_shape)
        part += along_x @ (grid @ along_y)
        if used.size == columns.shape[1]:
            return np.asarray(part)
        values = np.zeros((columns.shape[1], *self.grid.part_shape))
        values[used] = part
        return values

    def _class_tables(self, parity: ParityBasis) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A class on the grid, kept for next time: along x, along y, and its circle functions.

        Shapes (nx, degrees), (degrees, ny) and (members, points).
        """
        key = parity.parity
        if key not in self._by_class:
            self._by_class[key] = (
                np.ascontiguousarray(self._along_x[:, parity.degrees_x]),
                np.ascontiguousarray(self._along_y[:, parity.degrees_y].T),
                np.ascontiguousarray(parity.combine(self._circles).T),
            )
        return self._by_class[key]
