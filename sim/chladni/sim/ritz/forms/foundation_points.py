"""Where a plate lies on its foundation: points whose signed weights add strips and take cut-outs.

The energy form of a foundation on the whole plate is that of the plate's own mass without what
rides on it (overlap.py). What is left to do are discs that are cut out and strips.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.geometry import FoundationLayer, Inclusion
from chladni.sim.plate.mirrors import SAME_PLACE
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.quadrature import DiscRule, Points, corner_offcuts, gauss_points, join
from chladni.sim.ritz.forms.discs import degree_on, orders_and_degree

FloatArray = NDArray[np.float64]

MORE_AROUND = 4
"""Angles beyond twice the highest order of a disc's functions."""
ACROSS_RING = 5
"""Gauss points between a magnet and its cut-out, where functions fall as ρ to minus their order:
six leave 2e-9 of a field whose magnets of 3 mm stand in holes of 5."""
IN_STRIP = 12
"""Gauss points across a strip at least. Along a side as many as the plate's own area has."""
ALONG_SIDE = 30
OFFCUT_POINTS = 16
"""Points each way on half a rounded corner's offcut; bounded by one arc and straight lines."""
ACROSS_AN_EDGE = (48, 192)
"""Points along the radius and around of a disc that an edge of a strip goes through: they leave
1e-3 of the disc's share."""


def signed_points(basis: Basis) -> Points:
    """Strips with positive weights, what is cut out with negative ones; over the whole plate.

    A foundation without strips is everywhere, which these points leave out.
    """
    geometry = basis.geometry
    layer = geometry.foundation
    if layer is None:
        return join([])
    taken = [_ring(basis, *disc) for disc in layer.cut_outs]
    if geometry.corner_radius > 0.0:
        corner = (geometry.width, geometry.length, geometry.corner_radius)
        taken.append(corner_offcuts(*corner, OFFCUT_POINTS))
    out = join(taken)
    keep = _is_under(layer, out)
    less = Points(out.x[keep], out.y[keep], -out.weights[keep])
    lies = join([*(_strip(basis, strip) for strip in layer.strips), less])
    return Points(lies.x, lies.y, lies.weights * layer.ratio(lies.x, lies.y))


def _is_under(layer: FoundationLayer, points: Points) -> np.ndarray:
    """Whether the foundation would be there if nothing were cut out."""
    if not layer.strips:
        return np.ones(points.x.shape, dtype=bool)
    return np.asarray(
        np.any(
            [
                (points.x >= x0) & (points.x <= x1) & (points.y >= y0) & (points.y <= y1)
                for x0, x1, y0, y1 in layer.strips
            ],
            axis=0,
        )
    )


def is_left_out(layer: FoundationLayer, disc: Inclusion) -> bool:
    """Whether there is no foundation under a disc: a hole, or the middle of a cut-out.

    Functions are known as polynomials on such discs, so that points only make up the rest.
    """
    if not _is_wholly_under(layer, disc.x, disc.y, disc.radius):
        return False
    return disc.is_hole or any(
        np.hypot(disc.x - x, disc.y - y) < SAME_PLACE and disc.radius <= radius
        for x, y, radius in layer.cut_outs
    )


def _is_wholly_under(layer: FoundationLayer, x: float, y: float, radius: float) -> bool:
    """Whether the foundation would be under all of a disc if nothing were cut out."""
    angles = 2.0 * np.pi * np.arange(64) / 64.0
    px, py = x + radius * np.cos(angles), y + radius * np.sin(angles)
    return bool(np.all(_is_under(layer, Points(px, py, np.zeros(64)))))


def _ring(basis: Basis, x: float, y: float, radius: float) -> Points:
    """Quadrature over a cut-out, less the disc in its middle if there is one."""
    middle = [
        circle for circle in basis.inclusions if np.hypot(circle.x - x, circle.y - y) < SAME_PLACE
    ]
    around, degree = (
        orders_and_degree(basis, middle[0]) if middle else (0, degree_on(basis, radius))
    )
    inner = middle[0].radius if middle and middle[0].radius <= radius else 0.0
    layer = basis.geometry.foundation
    if inner and layer is not None and not _is_wholly_under(layer, x, y, inner):
        # A strip's edge goes through the disc: points tell what of it lies under the strip.
        return DiscRule(*ACROSS_AN_EDGE).on(x, y, radius)
    across = ACROSS_RING if inner else degree // 2 + 3
    around = max(around, degree)
    return DiscRule(across, 4 * -(-(around + MORE_AROUND) // 2)).on(x, y, radius, inner=inner)


def _strip(basis: Basis, strip: tuple[float, float, float, float]) -> Points:
    geometry, resolution = basis.geometry, basis.resolution
    lines = []
    for begin, end, side, count in (
        (*strip[:2], geometry.width, resolution.nx),
        (*strip[2:], geometry.length, resolution.ny),
    ):
        share = (end - begin) / side
        points = max((ALONG_SIDE + 3 * count) * share, IN_STRIP + 3 * count * share)
        nodes, weights = gauss_points(end - begin, 2 * int(np.ceil(points / 2)))
        lines.append((nodes + (begin + end) / 2.0, weights))
    (x, by_x), (y, by_y) = lines
    gx, gy = np.meshgrid(x, y, indexing="ij")
    return Points(gx.ravel(), gy.ravel(), np.outer(by_x, by_y).ravel())
