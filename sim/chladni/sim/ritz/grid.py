"""Ritz fields on a rectangular grid, at the cost of a quarter of it where both mirrors hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis import Basis
from chladni.sim.ritz.symmetry import SAME_PLACE, Mirrors, Parity, ParityBasis

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


class GridTable:
    """The basis on the grid x × y (m), or on its fundamental part if the grid has the mirrors."""

    def __init__(self, basis: Basis, mirrors: Mirrors, x: FloatArray, y: FloatArray) -> None:
        self.x, self.y = x, y
        self._basis = basis
        self._fold_x = mirrors.x and _is_mirrored(x)
        self._fold_y = mirrors.y and _is_mirrored(y)
        part_x = x[x.size // 2 :] if self._fold_x else x
        part_y = y[y.size // 2 :] if self._fold_y else y
        self._shape = (part_x.size, part_y.size)
        self._along_x = basis.along_x.evaluate(part_x)
        self._along_y = basis.along_y.evaluate(part_y)
        px, py = np.meshgrid(part_x, part_y, indexing="ij")
        self._by_class: dict[Parity, FloatArray] = {}
        self._circles = basis.enrichment_values(px.ravel(), py.ravel(), (0, 0))

    def fields(self, parities: list[ParityBasis], coefficients: list[ComplexArray]) -> ComplexArray:
        """Sum over classes of the fields of coefficients (class size, loads).

        Returns
        -------
        ComplexArray
            Shape (loads, nx, ny).
        """
        loads = coefficients[0].shape[1]
        total = np.zeros((loads, self.x.size, self.y.size), dtype=np.complex128)
        for parity, own in zip(parities, coefficients, strict=True):
            self._add_unfolded(total, parity, self._part(parity, own))
        return total

    def clear_cut_out(self, values: ComplexArray) -> None:
        """Set fields to zero where a screw holds the plate or a hole leaves none, in place."""
        for x, y, radius in self._basis.geometry.cut_out:
            values[:, np.hypot(self.x[:, None] - x, self.y - y) <= radius] = 0.0

    def _part(self, parity: ParityBasis, coefficients: ComplexArray) -> ComplexArray:
        """The fundamental part of the fields, shape (loads, part of nx, part of ny).

        Real and imaginary parts go through as separate loads: the tables are real, and a complex
        product would cost four times as much. A part that is all zero is left out.
        """
        loads = coefficients.shape[1]
        whole = np.concatenate((coefficients.real, coefficients.imag), axis=1)
        used = np.flatnonzero(whole.any(axis=0))
        own = whole[:, used]
        p = parity.polynomials
        along_x = self._along_x[:, parity.degrees_x]
        along_y = self._along_y[:, parity.degrees_y]
        grid = own[:p].T.reshape(used.size, parity.degrees_x.size, parity.degrees_y.size)
        values = np.zeros((2 * loads, *self._shape))
        values[used] = along_x @ grid @ along_y.T
        values[used] += (own[p:].T @ self._class_circles(parity).T).reshape(-1, *self._shape)
        result = np.empty((loads, *self._shape), dtype=np.complex128)
        result.real, result.imag = values[:loads], values[loads:]
        return result

    def _class_circles(self, parity: ParityBasis) -> FloatArray:
        """Circle functions of a class on the grid, shape (points, members); kept for next time."""
        key = parity.parity
        if key not in self._by_class:
            self._by_class[key] = parity.combine(self._circles)
        return self._by_class[key]

    def _add_unfolded(self, total: ComplexArray, parity: ParityBasis, part: ComplexArray) -> None:
        """Add a class's field to `total`, its mirror images with the signs of its parity."""
        nx, ny = part.shape[1:]
        for flip_x in (False, True) if self._fold_x else (False,):
            for flip_y in (False, True) if self._fold_y else (False,):
                sign = -1.0 if (flip_x and parity.parity.odd_x) else 1.0
                sign *= -1.0 if (flip_y and parity.parity.odd_y) else 1.0
                # An odd count has its middle line in the part already.
                rows = slice(self.x.size - nx, None) if not flip_x else slice(self.x.size - nx)
                columns = slice(self.y.size - ny, None) if not flip_y else slice(self.y.size - ny)
                own = part[:, :: -1 if flip_x else 1, :: -1 if flip_y else 1]
                own = own[:, : self.x.size - nx if flip_x else nx]
                own = own[:, :, : self.y.size - ny if flip_y else ny]
                total[:, rows, columns] += sign * own


def _is_mirrored(points: FloatArray) -> bool:
    return bool(np.all(np.abs(points + points[::-1]) < SAME_PLACE))
