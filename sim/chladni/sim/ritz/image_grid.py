"""Ritz fields on a rectangular grid, at the cost of a quarter of it where both mirrors hold."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrored_grid import MirroredGrid, Oddness
from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.parity import Parity, ParityBasis
from chladni.sim.ritz.basis.resolution import MOST_VALUES

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


BLOCK_VALUES = 1 << 22
"""Of circle functions at once, where they are not kept: 32 MB."""
KEPT_AT_ONCE = 1 << 24
"""Of circle functions that are kept from the first time on."""


class GridTable:
    """The basis on the grid x × y (m), or on its fundamental part if the grid has the mirrors."""

    def __init__(self, basis: Basis, mirrors: Mirrors, x: FloatArray, y: FloatArray) -> None:
        self.x, self.y = x, y
        self._basis = basis
        self.grid = MirroredGrid(x, y, mirrors.shared_with(x, y))
        part_x, part_y = self.grid.part_x, self.grid.part_y
        self._along_x = basis.along_x.evaluate(part_x)
        self._along_y = basis.along_y.evaluate(part_y)
        self._by_class: dict[Parity, FloatArray] = {}
        self._circles: FloatArray | None = None
        self._values = (basis.size - basis.polynomials) * part_x.size * part_y.size
        self._times_asked = 0

    @property
    def kept_values(self) -> int:
        """How many values of circle functions it holds, now or once it is asked again."""
        return self._values if self._values <= MOST_VALUES else 0

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
        """The same class by class on the fundamental part, shape (fields, *part_shape) each.

        Memory that is new takes longer to get than to fill: a large table is kept from the second
        time on only, and until then worked out in blocks that use the same memory again.
        """
        self._times_asked += 1
        most = MOST_VALUES if self._times_asked > 1 else KEPT_AT_ONCE
        if self._circles is None and self._values <= most:
            self._circles = self._circles_on(slice(None))
        return {
            parity.oddness: self.share(parity, own)
            for parity, own in zip(parities, columns, strict=True)
        }

    def clear_cut_out(self, values: NDArray[Any]) -> None:
        """Set fields to zero where a screw holds the plate or a hole leaves none, in place."""
        rows, columns = self._cut_out
        values[..., rows, columns] = 0.0

    def clear_corners(self, values: NDArray[Any]) -> None:
        """Set fields to zero where round corners leave no plate, in place."""
        if self._basis.geometry.corner_radius > 0.0:
            values[..., self._corners()] = 0.0

    def _corners(self) -> NDArray[np.bool_]:
        return self._basis.geometry.is_cut_off(self.x[:, None], self.y[None])

    @cached_property
    def _cut_out(self) -> tuple[IntArray, IntArray]:
        """Indices of the points where there is no plate to move."""
        cut = np.zeros((self.x.size, self.y.size), dtype=bool)
        for x, y, radius in self._basis.geometry.cut_out:
            cut |= np.hypot(self.x[:, None] - x, self.y - y) <= radius
        cut |= self._corners()
        rows, columns = np.nonzero(cut)
        return rows, columns

    def share(self, parity: ParityBasis, columns: FloatArray) -> FloatArray:
        """The fundamental part of a class's fields: (class size, fields) to (fields, nx, ny).

        Fields without a share in this class are left out.
        """
        used = np.flatnonzero(columns.any(axis=0))
        own = np.ascontiguousarray(columns[:, used].T)
        p = parity.polynomials
        along_x = self._along_x[:, parity.degrees_x]
        along_y = np.ascontiguousarray(self._along_y[:, parity.degrees_y].T)
        grid = own[:, :p].reshape(used.size, along_x.shape[1], along_y.shape[0])
        part = along_x @ (grid @ along_y)
        for block in self._blocks():
            on_circles = own[:, p:] @ self._class_circles(parity, block)
            part[:, block] += on_circles.reshape(part[:, block].shape)
        if used.size == columns.shape[1]:
            return np.asarray(part)
        values = np.zeros((columns.shape[1], *self.grid.part_shape))
        values[used] = part
        return values

    def _blocks(self) -> list[slice]:
        """Lines of the fundamental part whose circle functions are worked out together."""
        if self._circles is not None:
            return [slice(None)]
        lines = self.grid.part_shape[0]
        count = max(1, BLOCK_VALUES * lines // max(self._values, 1))
        return [slice(k, k + count) for k in range(0, lines, count)]

    def _circles_on(self, rows: slice) -> FloatArray:
        """All circle functions on some lines of the fundamental part; (points, functions)."""
        x, y = np.meshgrid(self.grid.part_x[rows], self.grid.part_y, indexing="ij")
        return self._basis.enrichment_values(x.ravel(), y.ravel(), (0, 0))

    def _class_circles(self, parity: ParityBasis, rows: slice) -> FloatArray:
        """Those of a class, (members, points): kept for next time where all fit at once."""
        if self._circles is None:
            return parity.combine(self._circles_on(rows)).T
        key = parity.parity
        if key not in self._by_class:
            self._by_class[key] = np.ascontiguousarray(parity.combine(self._circles).T)
        return self._by_class[key]
