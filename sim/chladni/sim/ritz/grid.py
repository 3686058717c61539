"""Ritz fields on a rectangular grid, at the cost of a quarter of it where both mirrors hold."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis import Basis
from chladni.sim.ritz.symmetry import SAME_PLACE, Mirrors, Parity, ParityBasis

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]


class GridTable:
    """The basis on the grid x × y (m), or on its fundamental part if the grid has the mirrors."""

    def __init__(self, basis: Basis, mirrors: Mirrors, x: FloatArray, y: FloatArray) -> None:
        self.x, self.y = x, y
        self._basis = basis
        self._fold_x = mirrors.x and is_mirrored(x)
        self._fold_y = mirrors.y and is_mirrored(y)
        part_x = x[x.size // 2 :] if self._fold_x else x
        part_y = y[y.size // 2 :] if self._fold_y else y
        self._shape = (part_x.size, part_y.size)
        self._along_x = basis.along_x.evaluate(part_x)
        self._along_y = basis.along_y.evaluate(part_y)
        px, py = np.meshgrid(part_x, part_y, indexing="ij")
        self._by_class: dict[Parity, tuple[FloatArray, FloatArray, FloatArray]] = {}
        self._circles = basis.enrichment_values(px.ravel(), py.ravel(), (0, 0))

    def fields(self, parities: list[ParityBasis], coefficients: list[ComplexArray]) -> ComplexArray:
        """Sum over classes of the fields of coefficients (class size, loads).

        Returns
        -------
        ComplexArray
            Shape (loads, nx, ny).
        """
        parts = {
            (parity.parity.odd_x, parity.parity.odd_y): self._part(parity, own)
            for parity, own in zip(parities, coefficients, strict=True)
        }
        loads = coefficients[0].shape[1]
        total = np.empty((loads, self.x.size, self.y.size), dtype=np.complex128)
        for flip_x in (False, True) if self._fold_x else (False,):
            # First over the parities in x, then over those in y: half the sums of all four.
            in_x: dict[bool, FloatArray] = {}
            for (odd_x, odd_y), part in parts.items():
                sign = -1.0 if flip_x and odd_x else 1.0
                in_x[odd_y] = in_x[odd_y] + sign * part if odd_y in in_x else sign * part
            for flip_y in (False, True) if self._fold_y else (False,):
                own = _even_and_odd(in_x, -1.0 if flip_y else 1.0)
                self._place(total.real, own[:loads], flip_x=flip_x, flip_y=flip_y)
                self._place(total.imag, own[loads:], flip_x=flip_x, flip_y=flip_y)
        return total

    def clear_cut_out(self, values: NDArray[Any]) -> None:
        """Set fields to zero where a screw holds the plate or a hole leaves none, in place."""
        rows, columns = self._cut_out
        values[:, rows, columns] = 0.0

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

    def _part(self, parity: ParityBasis, coefficients: ComplexArray) -> FloatArray:
        """The fundamental part of the fields, real parts then imaginary: (2 · loads, nx, ny).

        They go through as separate loads: the tables are real, and a complex product would cost
        four times as much. Loads without a share in this class are left out.
        """
        along_x, along_y, circles = self._class_tables(parity)
        whole = np.concatenate((coefficients.real, coefficients.imag), axis=1).T
        used = np.flatnonzero(whole.any(axis=1))
        own = whole[used]
        p = parity.polynomials
        grid = own[:, :p].reshape(used.size, along_x.shape[1], along_y.shape[0])
        part = (own[:, p:] @ circles).reshape(used.size, *self._shape)
        part += along_x @ (grid @ along_y)
        if used.size == len(whole):
            return np.asarray(part)
        values = np.zeros((len(whole), *self._shape))
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

    def _place(self, total: FloatArray, part: FloatArray, *, flip_x: bool, flip_y: bool) -> None:
        """Write the fundamental part, or a mirror image of it, to where it belongs."""
        nx, ny = part.shape[1:]
        # An odd count has its middle line in the part, and the image leaves it out.
        left, below = self.x.size - nx, self.y.size - ny
        rows = slice(0, left) if flip_x else slice(left, None)
        columns = slice(0, below) if flip_y else slice(below, None)
        own = part[:, :: -1 if flip_x else 1, :: -1 if flip_y else 1]
        own = own[:, : left if flip_x else nx, : below if flip_y else ny]
        total[:, rows, columns] = own


def _even_and_odd(in_x: dict[bool, FloatArray], sign: float) -> FloatArray:
    """The even part plus `sign` times the odd one, either of which may be missing."""
    if True not in in_x:
        return in_x[False]
    odd = in_x[True] if sign > 0 else -in_x[True]
    return in_x[False] + odd if False in in_x else odd


def is_mirrored(points: FloatArray) -> bool:
    """Whether points along a line are their own mirror image about zero."""
    return bool(np.all(np.abs(points + points[::-1]) < SAME_PLACE))
