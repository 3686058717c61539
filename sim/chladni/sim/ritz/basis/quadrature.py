"""Points and weights on the edges, the corners and the discs of a plate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

EXPONENT = 30.0
"""Of what a line of Gauss points may leave of a singular function: 1e-13."""
STEEP = 6.0
"""Order up to which a function is no steeper than its distance says."""
PANEL, PANEL_POINTS = 3.0, 24
"""Length of a panel by its distance to the nearest singular place, and its points at least."""


@dataclass(frozen=True)
class Points:
    """Scattered points with weights, each of shape (points,): m, m, and m or m²."""

    x: FloatArray
    y: FloatArray
    weights: FloatArray


def gauss_points(length: float, count: int) -> tuple[FloatArray, FloatArray]:
    """Gauss–Legendre points and weights on [−length/2, length/2], each of shape (count,), m."""
    nodes, weights = _legendre(count)
    return nodes * (length / 2.0), weights * (length / 2.0)


@lru_cache(maxsize=256)
def _legendre(count: int) -> tuple[FloatArray, FloatArray]:
    """On [−1, 1]. A dozen to a plate were a twelfth of its work, and are the next one's too."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return np.asarray(nodes), np.asarray(weights)


def join(groups: Sequence[Points]) -> Points:
    """Several sets of points as one."""
    if not groups:
        return Points(np.zeros(0), np.zeros(0), np.zeros(0))
    return Points(
        np.concatenate([group.x for group in groups]),
        np.concatenate([group.y for group in groups]),
        np.concatenate([group.weights for group in groups]),
    )


def edges(
    width: float, length: float, count: int, singular: FloatArray, orders: FloatArray
) -> list[tuple[int, float, Points]]:
    """(axis, side, points) of the four edges of a centred rectangle, `count` Gauss points or more.

    Functions are singular at places (x, y), shape (places, 2), m, and fall from there as ρ to minus
    their order; edges near one have more points there.
    """
    result = []
    for axis in (0, 1):
        for side in (-1.0, 1.0):
            at = side * (width, length)[axis] / 2.0
            # A high order is as steep as a lower one that stands nearer.
            away = np.abs(singular[:, axis] - at) * np.minimum(1.0, STEEP / np.maximum(orders, 1))
            along, weights = _line((length, width)[axis], count, singular[:, 1 - axis], away)
            fixed = np.full(along.size, at)
            x, y = (fixed, along) if axis == 0 else (along, fixed)
            result.append((axis, side, Points(x, y, weights)))
    return result


def _line(
    length: float, count: int, places: FloatArray, away: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Gauss points on a line, panel by panel where singular places stand near it.

    A panel of k points, h long and d away from the place, leaves exp(−4kd/h).
    """
    if not away.size or 4.0 * count * float(away.min()) >= EXPONENT * length:
        return gauss_points(length, count)
    panels, done = [(-length / 2.0, length / 2.0)], []
    while panels:
        begin, end = panels.pop()
        beyond = np.maximum(np.maximum(begin - places, places - end), 0.0)
        if end - begin > PANEL * float(np.hypot(beyond, away).min()) and end - begin > 1e-5:
            middle = (begin + end) / 2.0
            panels += [(begin, middle), (middle, end)]
        else:
            done.append((begin, end))
    rules = []
    for begin, end in sorted(done):
        more = int(np.ceil(count * (end - begin) / length))
        nodes, weights = gauss_points(end - begin, PANEL_POINTS + more)
        rules.append((nodes + (begin + end) / 2.0, weights))
    return np.concatenate([r[0] for r in rules]), np.concatenate([r[1] for r in rules])


def corners(width: float, length: float) -> Points:
    """The four corners; the weight is the sign of u_xy v in Green's identity."""
    sign_x, sign_y = np.array([-1.0, -1.0, 1.0, 1.0]), np.array([-1.0, 1.0, -1.0, 1.0])
    return Points(sign_x * width / 2.0, sign_y * length / 2.0, sign_x * sign_y)


def corner_offcuts(width: float, length: float, radius: float, count: int) -> Points:
    """What rounding the corners cuts off: between each corner and its arc.

    In polar coordinates about the arc's centre the offcut lies between the arc and the two edges,
    so `count` × `count` Gauss points on either side of its diagonal see a smooth region.
    """
    nodes, weights = gauss_points(1.0, count)
    share, angle = nodes + 0.5, (nodes + 0.5) * (np.pi / 4.0)
    reach = radius / np.cos(angle)[:, None]
    distance = radius + (reach - radius) * share
    area = distance * (reach - radius) * weights * (weights * np.pi / 4.0)[:, None]
    along, across = distance * np.cos(angle)[:, None], distance * np.sin(angle)[:, None]
    u = np.concatenate((along.ravel(), across.ravel())) + width / 2.0 - radius
    v = np.concatenate((across.ravel(), along.ravel())) + length / 2.0 - radius
    single = Points(u, v, np.tile(area.ravel(), 2))
    signs = [(sx, sy) for sx in (1.0, -1.0) for sy in (1.0, -1.0)]
    return join([Points(sx * single.x, sy * single.y, single.weights) for sx, sy in signs])


class DiscRule:
    """Gauss × trapezoid points on a disc, exact up to degree min(4·radial − 2, angular − 1)."""

    def __init__(self, radial: int, angular: int) -> None:
        # In ρ², of which the mean around a circle is a polynomial.
        nodes, weights = gauss_points(1.0, radial)
        self._share, self._weights = nodes + 0.5, weights / 2.0
        self._angle = 2.0 * np.pi * (np.arange(angular) + 0.5) / angular

    def on(self, x: float, y: float, radius: float, *, inner: float = 0.0) -> Points:
        """The points of one disc, or of the ring of it from the radius `inner` on."""
        area = radius**2 - inner**2
        reach = np.sqrt(inner**2 + area * self._share)
        px = x + np.outer(reach, np.cos(self._angle))
        py = y + np.outer(reach, np.sin(self._angle))
        around = np.full(self._angle.size, 2.0 * np.pi / self._angle.size)
        return Points(px.ravel(), py.ravel(), area * np.outer(self._weights, around).ravel())
