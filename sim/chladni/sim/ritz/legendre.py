"""Orthonormal Legendre polynomials on a centred interval, with derivatives up to the third."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MAX_DERIVATIVE = 3


@dataclass(frozen=True)
class IntervalBasis:
    """Polynomials of degree 0 … `count` − 1, orthonormal in L² on [−length/2, length/2].

    Even degrees are even functions and odd degrees odd ones, so a mirror symmetry of the
    board shows up as a choice of degrees.

    Parameters
    ----------
    length
        Interval length, m.
    count
        Number of polynomials.
    """

    length: float
    count: int

    def evaluate(self, x: FloatArray, derivative: int = 0) -> FloatArray:
        """Values (or a derivative) of every polynomial.

        Parameters
        ----------
        x
            Points, shape (points,), m.
        derivative
            0 … 3.

        Returns
        -------
        FloatArray
            Shape (points, count), m^(−1/2 − derivative).
        """
        if not 0 <= derivative <= MAX_DERIVATIVE:
            raise ValueError(f"derivative must be 0 to {MAX_DERIVATIVE}, got {derivative}")
        xi = np.asarray(x, dtype=np.float64) * (2.0 / self.length)
        tables = np.zeros((derivative + 1, self.count, xi.size))
        tables[0, 0] = 1.0
        if self.count > 1:
            tables[0, 1] = xi
        for n in range(1, self.count - 1):
            # Bonnet: (n+1) P[n+1] = (2n+1) x P[n] − n P[n−1]
            tables[0, n + 1] = ((2 * n + 1) * xi * tables[0, n] - n * tables[0, n - 1]) / (n + 1)
        for k in range(1, derivative + 1):
            if self.count > 1:
                tables[k, 1] = 1.0 if k == 1 else 0.0
            for n in range(1, self.count - 1):
                # P'[n+1] = P'[n−1] + (2n+1) P[n], and so for every derivative of it
                tables[k, n + 1] = tables[k, n - 1] + (2 * n + 1) * tables[k - 1, n]
        norm = np.sqrt((2.0 * np.arange(self.count) + 1.0) / self.length)
        return np.asarray(tables[derivative].T * norm * (2.0 / self.length) ** derivative)

    @cached_property
    def _rule(self) -> tuple[FloatArray, FloatArray]:
        return gauss_points(self.length, self.count)

    def gram(self, left: int, right: int) -> FloatArray:
        """∫ of the `left`-th derivative of each polynomial times the `right`-th of each, exact."""
        x, weights = self._rule
        return np.asarray((self.evaluate(x, left).T * weights) @ self.evaluate(x, right))


def gauss_points(length: float, count: int) -> tuple[FloatArray, FloatArray]:
    """Gauss–Legendre points and weights on [−length/2, length/2], each of shape (count,), m."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return nodes * (length / 2.0), weights * (length / 2.0)
