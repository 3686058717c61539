"""Functions with the singular behaviour a circle (a screw's rim, a magnet, a load disc) causes.

Outside the circle each function is a biharmonic potential that polynomials approximate badly;
inside it continues with matching value and slope, so it may join a Ritz basis. With
z = ((x − cx) + i(y − cy)) / R every one is a sum of terms zᵖ z̄^q, some times ln|z|, of the angular
form exp(−imθ); real part and minus imaginary part are the cos mθ and sin mθ functions.

========  ==========================  =========================================
order     outside, two kinds          inside
========  ==========================  =========================================
m = 0     ρ² ln ρ,  ln ρ              α + βρ²
m = 1     ρ ln ρ,   1/ρ               αρ + βρ³
m ≥ 2     ρ²⁻ᵐ,     ρ⁻ᵐ               αρᵐ + βρᵐ⁺²
bubble    0                           ρᵐ(1 − ρ²)²
========  ==========================  =========================================

The two kinds are the fields of a line force and of a line moment spread over the rim as cos mθ.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.circles.derivatives import Derivative, SplitPoints
from chladni.sim.ritz.circles.held_edges import HeldEdge, MirrorImages
from chladni.sim.ritz.circles.terms import FunctionSet, RadialFunction

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

AT_ONCE = 1 << 13
"""Points times circles evaluated in one go, so that they stay in the cache."""


@dataclass(frozen=True)
class Circle:
    """A circle with the functions it brings into the basis.

    Parameters
    ----------
    x, y, radius
        Centre and radius, m.
    own
        What it brings; circles that share one are evaluated together.
    held
        The edge that its functions obey by a mirror image of each, which lies off the plate.
    """

    x: float
    y: float
    radius: float
    own: FunctionSet
    held: HeldEdge | None = None

    @property
    def members(self) -> list[tuple[RadialFunction, bool]]:
        """(function, is its sine) of every basis function, in the order of `evaluate`."""
        return self.own.members

    def local(self, x: FloatArray, y: FloatArray) -> ComplexArray:
        """Points as z, the offset from the centre in radii."""
        return np.asarray(((x - self.x) + 1j * (y - self.y)) / self.radius)

    def mirrored(self, x: FloatArray, y: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """Points mirrored at the held edge, and how far the edge is from there, in radii."""
        assert self.held is not None
        place = [x, y]
        place[self.held.axis] = 2.0 * self.held.at - place[self.held.axis]
        return self.local(*place), (self.held.at - place[self.held.axis]) / self.radius

    def evaluate(
        self, x: FloatArray, y: FloatArray, derivative: Derivative, *, smooth: bool = False
    ) -> FloatArray:
        """Every function (or a derivative) at points; `smooth` continues what is outside inwards.

        Returns
        -------
        FloatArray
            Shape (points, functions), m^(−derivatives).
        """
        return evaluate_circles([self], x, y, derivative, [smooth])


def evaluate_circles(
    circles: Sequence[Circle],
    x: FloatArray,
    y: FloatArray,
    derivative: Derivative,
    smooth: Sequence[bool],
) -> FloatArray:
    """`Circle.evaluate` of several circles, one after the other; shape (points, functions).

    Circles of the same functions are taken together where points are few: there calls cost more
    than their work.
    """
    ends = np.cumsum([0] + [len(circle.members) for circle in circles])
    # Function by function in memory: each is written, combined and summed as a whole.
    result = np.empty((int(ends[-1]), x.size))
    together = max(1, AT_ONCE // max(x.size, 1))
    for members, is_smooth in _alike(circles, smooth):
        for first in range(0, len(members), together):
            some = members[first : first + together]
            own = [circles[k] for k in some]
            for start in range(0, x.size, AT_ONCE):
                at = slice(start, start + AT_ONCE)
                for row, values in enumerate(_values(own, x[at], y[at], derivative, is_smooth)):
                    rows = ends[some] + row
                    # One row is a view, which is written faster.
                    result[rows if rows.size > 1 else rows[0], at] = values
    if sum(derivative) > 0:
        radii = np.repeat([circle.radius for circle in circles], np.diff(ends))
        result /= radii[:, None] ** sum(derivative)
    return result.T


def _alike(circles: Sequence[Circle], smooth: Sequence[bool]) -> Iterator[tuple[list[int], bool]]:
    """Circles of the same functions with held edges of one kind, and whether they are smooth."""
    found: dict[tuple[FunctionSet, bool, HeldEdge | None], list[int]] = {}
    for k, (circle, is_smooth) in enumerate(zip(circles, smooth, strict=True)):
        edge = circle.held and replace(circle.held, at=0.0)
        found.setdefault((circle.own, is_smooth, edge), []).append(k)
    return ((members, is_smooth) for (_, is_smooth, _), members in found.items())


def _values(
    circles: list[Circle], x: FloatArray, y: FloatArray, derivative: Derivative, is_smooth: bool
) -> Iterator[FloatArray]:
    """The cosine and the sine of one function after the other, of circles that are alike.

    Each of shape (circles, points), in units of the radii.
    """
    own = circles[0].own
    split = SplitPoints.at(np.array([circle.local(x, y) for circle in circles]))
    edge, images = circles[0].held, None
    if edge:
        z, s = (np.array(part) for part in zip(*(c.mirrored(x, y) for c in circles), strict=True))
        images = MirrorImages(edge, z, s, derivative)
    for function in own.continued if is_smooth else own.functions:
        values = split.evaluate(function, derivative)
        if images and function.outside:
            values = values + images.evaluate(function)
        yield values.real
        if function.order > 0:
            yield -values.imag
