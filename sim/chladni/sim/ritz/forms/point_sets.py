"""Quadrature points of a plate: on edges, rims, corners and its area, images left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis import quadrature
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.basis_values import FunctionTable
from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.basis.quadrature import Points, gauss_points
from chladni.sim.ritz.circles.derivatives import Derivative
from chladni.sim.ritz.circles.functions import Circle
from chladni.sim.ritz.forms.foundation_points import OFFCUT_POINTS, signed_points

FloatArray = NDArray[np.float64]

RIM_POINTS = 32
"""Points on a rim, at least, and `BEYOND` twice its order where that is more: the error falls as
(radius / distance to the next feature)^(points − order)."""
BEYOND = 16
EDGE_POINTS = 96
"""Points on an edge beyond two per polynomial; a load disc that overhangs it makes a kink there."""


@dataclass(frozen=True)
class Edge:
    """Points on one edge whose outward normal is `normal` (±1) along `axis` (0 is x)."""

    points: Points
    axis: int
    normal: float

    @property
    def derivatives(self) -> tuple[Derivative, Derivative, Derivative, Derivative]:
        """nn, ss, nnn and nss: across the edge and along it."""
        if self.axis == 0:
            return (2, 0), (0, 2), (3, 0), (1, 2)
        return (0, 2), (2, 0), (0, 3), (2, 1)


@dataclass(frozen=True)
class Rim:
    """Evenly spaced points on a circle, with their angles."""

    circle: Circle
    angle: FloatArray
    points: Points

    def values(self, table: FunctionTable, parity: ParityBasis) -> tuple[FloatArray, FloatArray]:
        """W and R ∂w/∂r at the points; each of shape (points, functions)."""
        value = table.values(parity, (0, 0))
        radial_x, radial_y = np.cos(self.angle)[:, None], np.sin(self.angle)[:, None]
        slope = self.circle.radius * (
            radial_x * table.values(parity, (1, 0)) + radial_y * table.values(parity, (0, 1))
        )
        return value, slope

    def moments(self, table: FunctionTable, parity: ParityBasis) -> tuple[FloatArray, FloatArray]:
        """Fourier moments of w and of R ∂w/∂r; each of shape (2·orders + 1, functions).

        The first axis runs over 1, cos θ, sin θ, cos 2θ, …
        """
        value, slope = self.values(table, parity)
        orders = np.arange(1, self.circle.own.orders + 1)[:, None] * self.angle
        waves = np.stack((np.cos(orders), np.sin(orders)), axis=1).reshape(-1, self.angle.size)
        projector = np.concatenate((np.ones((1, self.angle.size)), 2.0 * waves))
        projector *= self.points.weights
        return projector @ value, projector @ slope


@dataclass(frozen=True)
class PointSets:
    """All quadrature points in the fundamental part of the plate; weights count the images.

    `offcuts` is what rounded corners take away. `corners.weights` holds the sign of u_xy,
    `points.weights` the number of images of each point feature in `point_index`. `foundation` is
    what strips of a foundation add and cut-outs take away.
    """

    edges: list[Edge]
    corners: Points
    offcuts: Points
    point_index: NDArray[np.intp]
    area: Points
    gauss_x: tuple[FloatArray, FloatArray]
    gauss_y: tuple[FloatArray, FloatArray]
    rims: dict[int, Rim]
    points: Points
    foundation: Points


def point_sets(basis: Basis, mirrors: Mirrors, area_points: tuple[int, int]) -> PointSets:
    """Quadrature for a basis; `area_points` are Gauss points along x and y (even numbers)."""
    geometry = basis.geometry
    images = float(len(mirrors.images))
    edges = []
    edge_points = EDGE_POINTS + 2 * max(basis.resolution.nx, basis.resolution.ny)
    centres = np.array([(circle.x, circle.y) for circle in basis.circles]).reshape(-1, 2)
    orders = np.array([circle.own.orders for circle in basis.circles], dtype=np.float64)
    for axis, side, whole in quadrature.edges(
        geometry.width, geometry.length, edge_points, centres, orders
    ):
        points = _fundamental(whole, mirrors, images)
        if points.x.size:
            edges.append(Edge(points, axis, side))
    corners = _fundamental(quadrature.corners(geometry.width, geometry.length), mirrors, images)
    offcuts = quadrature.join(
        [
            quadrature.corner_offcuts(
                geometry.width, geometry.length, geometry.corner_radius, OFFCUT_POINTS
            )
        ]
        if geometry.corner_radius > 0.0
        else []
    )
    point_index, features = _point_features(basis, mirrors)
    gauss_x = _half(gauss_points(geometry.width, area_points[0]), mirrors.x)
    gauss_y = _half(gauss_points(geometry.length, area_points[1]), mirrors.y)
    gx, gy = np.meshgrid(gauss_x[0], gauss_y[0], indexing="ij")
    area = Points(gx.ravel(), gy.ravel(), np.outer(gauss_x[1], gauss_y[1]).ravel())
    rims = {
        k: _rim(circle)
        for k, circle in enumerate(basis.circles)
        if mirrors.holds(np.array(circle.x), np.array(circle.y))
    }
    return PointSets(
        edges=edges,
        corners=corners,
        offcuts=_fundamental(offcuts, mirrors, images),
        point_index=point_index,
        points=features,
        area=area,
        gauss_x=gauss_x,
        gauss_y=gauss_y,
        rims=rims,
        foundation=_fundamental(signed_points(basis), mirrors, images),
    )


def _point_features(basis: Basis, mirrors: Mirrors) -> tuple[NDArray[np.intp], Points]:
    """Point features in the fundamental part, with the number of images of each as weight."""
    features = basis.geometry.points
    x, y = np.array([p.x for p in features]), np.array([p.y for p in features])
    index = np.flatnonzero(mirrors.holds(x, y))
    images = np.array([float(mirrors.orbit(x[k], y[k])) for k in index])
    return index, Points(x[index], y[index], images)


def _fundamental(points: Points, mirrors: Mirrors, images: float) -> Points:
    keep = mirrors.holds(points.x, points.y)
    return Points(points.x[keep], points.y[keep], points.weights[keep] * images)


def _half(rule: tuple[FloatArray, FloatArray], mirrored: bool) -> tuple[FloatArray, FloatArray]:
    """The positive half of a symmetric rule, its weights doubled, where a mirror allows it."""
    if not mirrored:
        return rule
    keep = rule[0] > 0.0
    return rule[0][keep], 2.0 * rule[1][keep]


def points_around(circle: Circle) -> int:
    """How many evenly spaced points see the functions of a circle; a multiple of four."""
    return 4 * -(-(2 * circle.own.orders + BEYOND) // 4)


def _rim(circle: Circle) -> Rim:
    count = max(RIM_POINTS, points_around(circle))
    angle = 2.0 * np.pi * np.arange(count) / count
    x = circle.x + circle.radius * np.cos(angle)
    y = circle.y + circle.radius * np.sin(angle)
    return Rim(circle, angle, Points(x, y, np.full(count, 1.0 / count)))
