"""Ritz fields on a rectangular grid, at the cost of a quarter of it where both mirrors hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis import Basis
from chladni.sim.ritz.symmetry import SAME_PLACE, Mirrors, ParityBasis

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
            total += self._unfold(parity, self._part(parity, own))
        return total

    def clear_screws(self, values: ComplexArray) -> None:
        """Set fields to zero where a screw holds the plate, in place."""
        for clamp in self._basis.geometry.clamps:
            distance = np.hypot(self.x[:, None] - clamp.x, self.y - clamp.y)
            values[:, distance <= clamp.radius] = 0.0

    def _part(self, parity: ParityBasis, coefficients: ComplexArray) -> ComplexArray:
        p = parity.polynomials
        shape = (parity.degrees_x.size, parity.degrees_y.size, -1)
        along_x = self._along_x[:, parity.degrees_x]
        along_y = self._along_y[:, parity.degrees_y]
        grid = coefficients[:p].reshape(shape).transpose(2, 0, 1)
        circles = self._circles @ (parity.combine @ coefficients[p:])
        return np.asarray(along_x @ grid @ along_y.T + circles.T.reshape(-1, *self._shape))

    def _unfold(self, parity: ParityBasis, part: ComplexArray) -> ComplexArray:
        for axis, folded, odd, count in (
            (1, self._fold_x, parity.parity.odd_x, self.x.size),
            (2, self._fold_y, parity.parity.odd_y, self.y.size),
        ):
            if folded:
                mirrored = np.flip(part, axis=axis) * (-1.0 if odd else 1.0)
                keep = count - part.shape[axis]
                mirrored = np.take(mirrored, np.arange(keep), axis=axis)
                part = np.concatenate((mirrored, part), axis=axis)
        return part


def _is_mirrored(points: FloatArray) -> bool:
    return bool(np.all(np.abs(points + points[::-1]) < SAME_PLACE))
