"""What the supports of a plate hold, as conditions on functions: rims, pins and edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.circles.derivatives import Derivative
from chladni.sim.ritz.forms.point_sets import Edge
from chladni.sim.ritz.forms.samples import Samples, Tables

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SupportConditions:
    """What must vanish for the supports to hold.

    Attributes
    ----------
    moments
        Of the basis, shape (conditions, size); see `support_moments`.
    is_finest
        Whether a condition is of the highest angular order of its rim, shape (conditions,).
    edges
        How many conditions are an edge's: the last ones.
    """

    moments: FloatArray
    is_finest: NDArray[np.bool_]
    edges: int


def support_conditions(samples: Samples, parity: ParityBasis) -> SupportConditions:
    """The conditions on the basis of a class."""
    moments = support_moments(samples, parity, samples.own)
    finest: list[bool] = []
    for k, support in enumerate(samples.basis.geometry.rims):
        if k in samples.sets.rims:
            orders = samples.basis.rims[k].own.orders
            own = [*([False] * (2 * orders - 1)), True, True]
            finest += own * (int(support.holds_deflection) + int(support.holds_slope))
    is_finest = np.array(finest + [False] * (len(moments) - len(finest)), dtype=bool)
    degrees = (parity.degrees_y.size, parity.degrees_x.size)
    kinds = {"free": 0, "simply supported": 1, "clamped": 2}
    held = samples.basis.geometry.edges
    edges = sum(
        kinds[held.of(edge.axis, edge.normal)] * degrees[edge.axis] for edge in samples.sets.edges
    )
    return SupportConditions(moments, is_finest, edges)


def support_moments(samples: Samples, parity: ParityBasis, tables: Tables) -> FloatArray:
    """What of functions must vanish for the supports to hold; shape (conditions, functions).

    Fourier moments of w and R ∂w/∂r on rims, w at pins, Legendre moments of w and ∂w/∂n on
    edges (as many as the basis has polynomials along the edge).
    """
    geometry, sets = samples.basis.geometry, samples.sets
    rows = [np.zeros((0, tables.corners.values(parity, (0, 0)).shape[1]))]
    for k, support in enumerate(geometry.rims):
        if k in sets.rims:
            value, slope = sets.rims[k].moments(tables.rims[k], parity)
            rows += [value] if support.holds_deflection else []
            rows += [slope] if support.holds_slope else []
    pinned = [geometry.points[k].is_pinned for k in sets.point_index]
    rows.append(tables.points.values(parity, (0, 0))[np.array(pinned, dtype=bool)])
    for edge, table in zip(sets.edges, tables.edges, strict=True):
        kind = geometry.edges.of(edge.axis, edge.normal)
        if kind == "free":
            continue
        along = _legendre_along(samples, parity, edge)
        rows.append(along @ table.values(parity, (0, 0)))
        if kind == "clamped":
            slope_of: Derivative = (1, 0) if edge.axis == 0 else (0, 1)
            # In units of the board's width, as deflections are in units of themselves.
            rows.append(geometry.width * along @ table.values(parity, slope_of))
    return np.concatenate(rows)


def _legendre_along(samples: Samples, parity: ParityBasis, edge: Edge) -> FloatArray:
    """Weighted Legendre polynomials of the class along an edge; shape (degrees, points)."""
    line = (samples.basis.along_y, samples.basis.along_x)[edge.axis]
    degrees = (parity.degrees_y, parity.degrees_x)[edge.axis]
    along = (edge.points.y, edge.points.x)[edge.axis]
    return np.asarray((line.evaluate(along)[:, degrees] * edge.points.weights[:, None]).T)
