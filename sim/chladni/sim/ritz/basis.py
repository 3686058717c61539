"""The enriched basis: Legendre polynomials over the rectangle and functions on every circle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.geometry import PlateGeometry, Resolution
from chladni.sim.ritz.legendre import IntervalBasis
from chladni.sim.ritz.rings import Circle, Derivative

FloatArray = NDArray[np.float64]


class Basis:
    """Functions of one geometry at one resolution: nx·ny polynomials, then circle by circle.

    Clamps come before inclusions. `size` is the number of functions, `polynomials` that of the
    polynomials; polynomial (i, j) stands at i·ny + j.
    """

    def __init__(self, geometry: PlateGeometry, resolution: Resolution) -> None:
        self.geometry = geometry
        self.resolution = resolution
        self.along_x = IntervalBasis(geometry.width, resolution.nx)
        self.along_y = IntervalBasis(geometry.length, resolution.ny)
        self.clamps = [Circle(c.x, c.y, c.radius, resolution.clamp_rings) for c in geometry.clamps]
        self.inclusions = [
            Circle(i.x, i.y, i.radius, resolution.inclusion_rings, resolution.inclusion_bubbles)
            for i in geometry.inclusions
        ]
        self.circles = self.clamps + self.inclusions
        counts = [len(circle.members()) for circle in self.circles]
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

    def enrichment_values(self, x: FloatArray, y: FloatArray, derivative: Derivative) -> FloatArray:
        """Circle functions at scattered points, shape (points, size − nx·ny)."""
        values = [circle.evaluate(x, y, derivative) for circle in self.circles]
        return np.concatenate(values, axis=1) if values else np.zeros((x.size, 0))

    def values(self, x: FloatArray, y: FloatArray, derivative: Derivative = (0, 0)) -> FloatArray:
        """All functions (or a derivative) at scattered points, shape (points, size)."""
        polynomials = self.polynomial_values(x, y, derivative)
        return np.concatenate((polynomials, self.enrichment_values(x, y, derivative)), axis=1)
