"""The enriched basis: Legendre polynomials over the rectangle and functions on every circle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.geometry import PlateGeometry
from chladni.sim.ritz.basis.quadrature import gauss_points
from chladni.sim.ritz.basis.resolution import Resolution, crowding, order_beside
from chladni.sim.ritz.circles.derivatives import Derivative
from chladni.sim.ritz.circles.functions import Circle, evaluate_circles
from chladni.sim.ritz.circles.held_edges import HeldEdge
from chladni.sim.ritz.circles.terms import RIM_KINDS, FunctionSet

FloatArray = NDArray[np.float64]


POINT_RADIUS = 1e-4
"""A point's reaction acts on a circle of this radius, in widths; its field differs by R² ln R."""


NEAR_EDGE = 1.0 / 4.0
"""Distance of a circle's centre, by the plate's short side, within which it is near an edge."""
EDGE_ZONE = 0.02
"""A point this near to an edge, in widths, is taken to lie on it."""


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

    def gram(self, left: int, right: int) -> FloatArray:
        """∫ of the `left`-th derivative of each polynomial times the `right`-th of each, exact."""
        return _gram(self.count, left, right) * (2.0 / self.length) ** (left + right)


@lru_cache(maxsize=128)  # of 0.2 MB each at most
def _gram(count: int, left: int, right: int) -> FloatArray:
    """The same on [−1, 1], which all plates have in common."""
    line = IntervalBasis(2.0, count)
    x, weights = gauss_points(line.length, count)
    return np.asarray((line.evaluate(x, left).T * weights) @ line.evaluate(x, right))


class Basis:
    """Functions of one geometry at one resolution: nx·ny polynomials, then circle by circle.

    Rims come before inclusions, inclusions before points. `size` counts the functions,
    `polynomials` the polynomials; polynomial (i, j) stands at i·ny + j.
    """

    def __init__(self, geometry: PlateGeometry, resolution: Resolution) -> None:
        self.geometry = geometry
        self.resolution = resolution
        self.along_x = IntervalBasis(geometry.width, resolution.nx)
        self.along_y = IntervalBasis(geometry.length, resolution.ny)
        sets = _FunctionSets(resolution, crowding(geometry))
        self.rims = [
            Circle(
                r.x,
                r.y,
                r.radius,
                sets.of(k, resolution.rim_orders, -1),
                held_edge(geometry, r.x, r.y, r.radius),
            )
            for k, r in enumerate(geometry.rims)
        ]
        self.inclusions = [
            # Nothing bends inside a hole, so there is nothing to resolve.
            Circle(
                i.x,
                i.y,
                i.radius,
                sets.of(
                    k,
                    resolution.inclusion_orders,
                    -1 if i.is_hole else resolution.inclusion_bubbles,
                ),
                held_edge(geometry, i.x, i.y, i.radius),
            )
            for k, i in enumerate(geometry.inclusions, start=len(geometry.rims))
        ]
        # Discs have a quadrature of their own, which takes up what is kinked on their rims.
        self.smoothed = [
            circle
            for circle in self.inclusions
            if geometry.distance_to_edge(circle.x, circle.y) >= circle.radius
        ]
        point_radius = POINT_RADIUS * geometry.width
        # On an edge the reaction has no circle to act on; polynomials alone converge there.
        of_point = FunctionSet(0, -1, RIM_KINDS[:1])
        self.points = [
            Circle(p.x, p.y, point_radius, of_point)
            for p in geometry.points
            if geometry.distance_to_edge(p.x, p.y) > EDGE_ZONE * geometry.width
        ]
        self.circles = self.rims + self.inclusions + self.points
        counts = [len(circle.members) for circle in self.circles]
        self.polynomials = resolution.nx * resolution.ny
        self.offsets = [self.polynomials + sum(counts[:k]) for k in range(len(counts) + 1)]
        self.size = self.offsets[-1]

    def columns(self, circle: int) -> slice:
        """Where the functions of a circle stand in the basis."""
        return slice(self.offsets[circle], self.offsets[circle + 1])

    def polynomial_values(self, x: FloatArray, y: FloatArray, derivative: Derivative) -> FloatArray:
        """Polynomials at scattered points, shape (points, nx·ny)."""
        along_x = self.along_x.evaluate(x, derivative[0])
        along_y = self.along_y.evaluate(y, derivative[1])
        return np.asarray((along_x[:, :, None] * along_y[:, None, :]).reshape(x.size, -1))

    def enrichment_values(
        self, x: FloatArray, y: FloatArray, derivative: Derivative, *, smooth: bool = False
    ) -> FloatArray:
        """Circle functions at scattered points, shape (points, size − nx·ny).

        `smooth` ones have no kink on the rims of the discs in `smoothed`.
        """
        smoothed = [smooth and circle in self.smoothed for circle in self.circles]
        return evaluate_circles(self.circles, x, y, derivative, smoothed)

    def kinks(self, x: FloatArray, y: FloatArray, inclusion: NDArray[np.intp]) -> FloatArray:
        """Circle functions less their smooth continuations, each at the points of its inclusion.

        Shape (points, size − nx·ny); everywhere else they are the same.
        """
        result = np.zeros((x.size, self.size - self.polynomials))
        for k, circle in enumerate(self.inclusions):
            if circle in self.smoothed:
                own = np.flatnonzero(inclusion == k)
                columns = self.columns(len(self.rims) + k)
                at = (x[own], y[own], (0, 0))
                result[own, columns.start - self.polynomials : columns.stop - self.polynomials] = (
                    circle.evaluate(*at) - circle.evaluate(*at, smooth=True)
                )
        return result

    def values(self, x: FloatArray, y: FloatArray, derivative: Derivative = (0, 0)) -> FloatArray:
        """All functions (or a derivative) at scattered points, shape (points, size)."""
        polynomials = self.polynomial_values(x, y, derivative)
        return np.concatenate((polynomials, self.enrichment_values(x, y, derivative)), axis=1)


def held_edge(geometry: PlateGeometry, x: float, y: float, radius: float) -> HeldEdge | None:
    """The nearest held edge of a circle on the plate, if one is near.

    Farther circles are smooth along it, and polynomials follow that with less work.
    """
    near = NEAR_EDGE * min(geometry.width, geometry.length)
    found = []
    for axis, place in enumerate((x, y)):
        for side in (-1.0, 1.0):
            at = side * (geometry.width, geometry.length)[axis] / 2.0
            kind = geometry.edges.of(axis, side)
            if kind != "free" and abs(at - place) < near:
                found.append((abs(at - place), HeldEdge(axis, at, kind == "clamped")))
    nearest = min(found, key=lambda pair: pair[0], default=None)
    return nearest[1] if nearest and nearest[0] >= radius else None


class _FunctionSets:
    """Sets of functions for circles, one for all that bring the same."""

    def __init__(self, resolution: Resolution, crowded: FloatArray) -> None:
        self._left = resolution.crowded
        self._decay = crowded
        self._made: dict[tuple[int, int], FunctionSet] = {}

    def of(self, circle: int, orders: int, bubbles: int) -> FunctionSet:
        """Those of a circle: `orders` orders at least, more where others are near."""
        key = max(orders, order_beside(float(self._decay[circle]), self._left)), bubbles
        if key not in self._made:
            self._made[key] = FunctionSet(*key, RIM_KINDS)
        return self._made[key]
