"""Functions evaluated once on the quadrature points and then shared by every parity class."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.basis.quadrature import Points
from chladni.sim.ritz.circles.derivatives import Derivative

FloatArray = NDArray[np.float64]


class FunctionTable(Protocol):
    """Functions of a parity class at fixed points."""

    def values(self, parity: ParityBasis, derivative: Derivative) -> FloatArray:
        """Shape (points, functions)."""


class BasisTable:
    """The basis at fixed points; `smooth`, without the kinks on the rims of discs."""

    def __init__(self, basis: Basis, points: Points, *, smooth: bool = False) -> None:
        self._basis = basis
        self._smooth = smooth
        self._points = points
        self._circles: dict[Derivative, FloatArray] = {}
        self._lines: dict[tuple[int, int], FloatArray] = {}

    def circles(self, derivative: Derivative) -> FloatArray:
        """All circle functions, whatever their parity; shape (points, circle functions)."""
        if derivative not in self._circles:
            points = self._points
            self._circles[derivative] = self._basis.enrichment_values(
                points.x, points.y, derivative, smooth=self._smooth
            )
        return self._circles[derivative]

    def circle_values(self, parity: ParityBasis, derivative: Derivative) -> FloatArray:
        """Circle functions of a class; shape (points, members)."""
        return parity.combine(self.circles(derivative))

    def values(self, parity: ParityBasis, derivative: Derivative) -> FloatArray:
        """Polynomials of the class, then its circle functions."""
        x = self._line(0, derivative[0])[:, parity.degrees_x]
        y = self._line(1, derivative[1])[:, parity.degrees_y]
        circles = self.circle_values(parity, derivative)
        # Written where they stay: of large tables copies would take as long as products.
        values = np.empty((x.shape[0], parity.polynomials + circles.shape[1]))
        polynomials = values[:, : parity.polynomials].reshape(*x.shape, y.shape[1])
        np.multiply(x[:, :, None], y[:, None, :], out=polynomials)
        values[:, parity.polynomials :] = circles
        return values

    def sums(self, parity: ParityBasis, weights: Sequence[FloatArray]) -> FloatArray:
        """The functions of a class, summed over groups of points; shape (groups, functions).

        The groups follow one another as the weights of their points do. Polynomials are products
        of a function of x and one of y, whose sums need no table of all values.
        """
        x = self._line(0, 0)[:, parity.degrees_x]
        y = self._line(1, 0)[:, parity.degrees_y]
        circles = self.circles((0, 0))
        sums = np.empty((len(weights), parity.size))
        of_circles = np.empty((len(weights), circles.shape[1]))
        first = 0
        for row, own in enumerate(weights):
            some = slice(first, first + own.size)
            first = some.stop
            sums[row, : parity.polynomials] = ((own[:, None] * x[some]).T @ y[some]).ravel()
            of_circles[row] = own @ circles[some]
        sums[:, parity.polynomials :] = parity.combine(of_circles)
        return sums

    def _line(self, axis: int, derivative: int) -> FloatArray:
        if (axis, derivative) not in self._lines:
            line = (self._basis.along_x, self._basis.along_y)[axis]
            coordinate = (self._points.x, self._points.y)[axis]
            self._lines[axis, derivative] = line.evaluate(coordinate, derivative)
        return self._lines[axis, derivative]


Family = Callable[[FloatArray, FloatArray, Derivative], FloatArray]
"""Several functions at once: (x, y, derivative) to values of shape (points, functions)."""


class FamilyTable:
    """Functions without parity at fixed points, projected onto a class when asked."""

    def __init__(self, family: Family, points: Points, mirrors: Mirrors) -> None:
        self._family = family
        self._points = points
        self._images = mirrors.images
        self._cache: dict[Derivative, list[FloatArray]] = {}

    def values(self, parity: ParityBasis, derivative: Derivative) -> FloatArray:
        """The part of each function in the class: the character-weighted mean of its images."""
        if derivative not in self._cache:
            x, y = self._points.x, self._points.y
            self._cache[derivative] = [
                sx ** derivative[0] * sy ** derivative[1] * self._family(sx * x, sy * y, derivative)
                for sx, sy in self._images
            ]
        images = self._cache[derivative]
        total = sum(
            parity.parity.character(image) * values
            for image, values in zip(self._images, images, strict=True)
        )
        return np.asarray(total) / len(images)


class TablePart:
    """Some of the points of a table that is evaluated once for all of them."""

    def __init__(self, whole: SharedTable, rows: slice) -> None:
        self._whole = whole
        self._rows = rows

    def values(self, parity: ParityBasis, derivative: Derivative) -> FloatArray:
        """Shape (points of this part, functions)."""
        return self._whole.values(parity, derivative)[self._rows]


class SharedTable:
    """A table that keeps what it was asked last for one parity class."""

    def __init__(self, table: FunctionTable) -> None:
        self._table = table
        self._parity: ParityBasis | None = None
        self._values: dict[Derivative, FloatArray] = {}

    def values(self, parity: ParityBasis, derivative: Derivative) -> FloatArray:
        """Shape (points, functions)."""
        if parity is not self._parity:
            self._parity, self._values = parity, {}
        if derivative not in self._values:
            self._values[derivative] = self._table.values(parity, derivative)
        return self._values[derivative]
