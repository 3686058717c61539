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

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.circle_terms import FunctionSet, RadialFunction, Term, falling

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

AT_ONCE = 1 << 13
"""Points times circles evaluated in one go, so that they stay in the cache."""

Derivative = tuple[int, int]
"""How often a function is differentiated by x and by y."""
Wirtinger = tuple[tuple[int, int, complex], ...]
"""(j, k, coefficient) of every ∂_z^j ∂_z̄^k in an operator."""


@dataclass(frozen=True)
class HeldEdge:
    """A held edge of the plate that a circle's functions are to obey.

    Parameters
    ----------
    axis
        Across which they are mirrored: 0 for an edge along y.
    at
        Its place along that axis, m.
    is_clamped
        Whether it holds the slope as well.
    """

    axis: int
    at: float
    is_clamped: bool


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
    circles: Sequence[Circle], x: FloatArray, y: FloatArray, derivative: Derivative,
    smooth: Sequence[bool],
) -> FloatArray:  # fmt: skip
    """`Circle.evaluate` of several circles, one after the other; shape (points, functions).

    Circles of the same functions are taken together where points are few: there calls cost more
    than their work.
    """
    ends = np.cumsum([0] + [len(circle.members) for circle in circles])
    # Function by function in memory: each is written, combined and summed as a whole.
    result = np.empty((int(ends[-1]), x.size))
    alike: dict[tuple[FunctionSet, bool], list[int]] = {}
    for k, (circle, is_smooth) in enumerate(zip(circles, smooth, strict=True)):
        alike.setdefault((circle.own, is_smooth), []).append(k)
    together = max(1, AT_ONCE // max(x.size, 1))
    for (own, is_smooth), members in alike.items():
        functions = own.continued if is_smooth else own.functions
        for first in range(0, len(members), together):
            some = members[first : first + together]
            for start in range(0, x.size, AT_ONCE):
                at = slice(start, start + AT_ONCE)
                split = SplitPoints.at(np.array([circles[k].local(x[at], y[at]) for k in some]))
                rows = ends[some]
                for function in functions:
                    values = split.evaluate(function, derivative)
                    result[rows, at] = values.real
                    rows = rows + 1
                    if function.order > 0:
                        result[rows, at] = -values.imag
                        rows = rows + 1
    for k, circle in enumerate(circles):
        if circle.held is not None:
            result[ends[k] : ends[k + 1]] += _image(circle, circle.held, x, y, derivative)
    if sum(derivative) > 0:
        radii = np.repeat([circle.radius for circle in circles], np.diff(ends))
        result /= radii[:, None] ** sum(derivative)
    return result.T


def _image(
    circle: Circle, edge: HeldEdge, x: FloatArray, y: FloatArray, derivative: Derivative
) -> FloatArray:
    """What a circle's functions lack to obey a held edge; shape (functions, points).

    On an endless edge a supported plate answers with −f at the mirrored place, a clamped one with
    −f − 2s f' − s² Δf there, s being the distance from the edge along its normal axis (R. Duffin,
    Continuation of biharmonic functions by reflection, Duke Math. J. 22, 1955): biharmonic like f,
    and singular only off the plate. Lengths are in radii of the circle, derivatives' too.
    """
    place = [x, y]
    place[edge.axis] = 2.0 * edge.at - place[edge.axis]
    s = (edge.at - place[edge.axis]) / circle.radius
    points = circle.local(*place)
    answer = _answer(edge, derivative)
    result = np.empty((len(circle.members), points.size))
    for start in range(0, points.size, AT_ONCE):
        at = slice(start, start + AT_ONCE)
        # What is on the plate is mirrored to where no circle is.
        powers, weights = Powers(points[at]), [s[at] ** k for k in range(len(answer))]
        row = 0
        for function in circle.own.functions:
            values = _differentiate(function.outside, powers, answer[0])
            for weight, operator in zip(weights[1:], answer[1:], strict=True):
                values = values + weight * _differentiate(function.outside, powers, operator)
            result[row, at] = values.real
            if function.order > 0:
                result[row + 1, at] = -values.imag
            row += 2 if function.order > 0 else 1
    return result


def _answer(edge: HeldEdge, derivative: Derivative) -> list[Wirtinger]:
    """What acts on f at the mirrored place, by the power of s that it is multiplied with.

    By Leibniz s and s² are differentiated too, and a derivative across turns the sign.
    """
    n, along = derivative[edge.axis], derivative[1 - edge.axis]
    sign = (-1.0) ** n

    def by_place(across: int, factor: float) -> Wirtinger:
        operator = WIRTINGER[(across, along) if edge.axis == 0 else (along, across)]
        return tuple((j, k, factor * c) for j, k, c in operator)

    def laplacian(across: int, factor: float) -> Wirtinger:
        return tuple((j + 1, k + 1, 4.0 * c) for j, k, c in by_place(across, factor))

    if not edge.is_clamped:
        return [by_place(n, -sign)]
    answer = [
        by_place(n, sign * (2.0 * n - 1.0)),
        by_place(n + 1, -2.0 * sign),
        laplacian(n, -sign),
    ]
    # f'' and the derivatives along that come from Δf of one order less make Δf once more.
    if n >= 1:
        answer[1] += laplacian(n - 1, 2.0 * n * sign)
    if n >= 2:
        answer[0] += laplacian(n - 2, -n * (n - 1) * sign)
    return answer


class Powers:
    """Monomials of z and z̄, and ln|z|, each computed once."""

    def __init__(self, z: ComplexArray) -> None:
        self.z = z
        self._powers: dict[tuple[int, int], ComplexArray] = {
            (0, 0): np.ones(z.shape, dtype=np.complex128),
            (1, 0): z,
        }

    @cached_property
    def log(self) -> FloatArray:
        """ln|z|."""
        return np.asarray(np.log(np.abs(self.z)))

    def of(self, p: int, q: int) -> ComplexArray:
        """The monomial zᵖ z̄^q."""
        if (p, q) not in self._powers:
            if q == 0:
                step = 1 if p > 0 else -1
                value = 1.0 / self.z if p == -1 else self.of(p - step, 0) * self.of(step, 0)
            elif p == 0:
                value = self.of(q, 0).conj()
            else:
                value = self.of(p, 0) * self.of(0, q)
            self._powers[p, q] = value
        return self._powers[p, q]


@dataclass(frozen=True)
class SplitPoints:
    """Points in units of a circle's radius, told apart by the side of the rim they lie on."""

    is_inside: NDArray[np.bool_]
    inside: Powers
    outside: Powers

    @classmethod
    def at(cls, z: NDArray[Any]) -> SplitPoints:
        """Sort points z; the rim itself counts as outside."""
        is_inside = np.abs(z) < 1.0
        # Most points have most circles on one side: then nothing is sorted.
        outside = z[~is_inside] if is_inside.any() else z
        return cls(is_inside, Powers(z[is_inside]), Powers(outside))

    def evaluate(self, function: RadialFunction, derivative: Derivative) -> ComplexArray:
        """∂ₓᵃ∂ᵧᵇ of one function by z (not yet divided by Rᵃ⁺ᵇ); shape (points,)."""
        return self.apply(function, WIRTINGER[derivative])

    def apply(self, function: RadialFunction, operator: Wirtinger) -> ComplexArray:
        """A sum of derivatives by z and z̄; shape (points,)."""
        if function.outside and not self.inside.z.size:
            return _differentiate(function.outside, self.outside, operator)
        result = np.zeros(self.is_inside.shape, dtype=np.complex128)
        if function.inside and self.inside.z.size:
            result[self.is_inside] = _differentiate(function.inside, self.inside, operator)
        if function.outside and self.outside.z.size:
            result[~self.is_inside] = _differentiate(function.outside, self.outside, operator)
        return result


def _differentiate(terms: tuple[Term, ...], powers: Powers, operator: Wirtinger) -> ComplexArray:
    total: ComplexArray | None = None
    for p, q, plain, by_log in _monomials(terms, operator):
        value = powers.of(p, q)
        if by_log:
            value = value * (plain + by_log * powers.log)
        elif plain != 1.0:
            value = value * plain
        total = value if total is None else total + value
    return np.zeros(powers.z.shape, dtype=np.complex128) if total is None else total


@lru_cache(maxsize=1 << 14)
def _monomials(
    terms: tuple[Term, ...], operator: Wirtinger
) -> tuple[tuple[int, int, complex, complex], ...]:
    """(p, q, a, b) of an operator on terms, which is a sum of (a + b ln|z|) zᵖ z̄^q."""
    found: dict[tuple[int, int], ComplexArray] = {}
    for j, k, coefficient in operator:
        for term in terms:
            (a, c), (b, d) = falling(term.p, j), falling(term.q, k)
            # ln|z| = (ln z + ln z̄)/2, so each half differentiates on its own side.
            own = (0.5 * (c * b + a * d), a * b) if term.log else (a * b, 0.0)
            before = found.setdefault((term.p - j, term.q - k), np.zeros(2, dtype=np.complex128))
            before += coefficient * term.factor * np.array(own)
    return tuple((p, q, complex(a), complex(b)) for (p, q), (a, b) in found.items() if a or b)


def _wirtinger(by_x: int, by_y: int) -> Wirtinger:
    """∂ₓ^by_x ∂ᵧ^by_y = (∂_z + ∂_z̄)^by_x (i∂_z − i∂_z̄)^by_y, by ∂_z and ∂_z̄."""
    result: dict[tuple[int, int], complex] = {}
    for s in range(by_x + 1):
        for t in range(by_y + 1):
            key = (s + t, by_x - s + by_y - t)
            value = comb(by_x, s) * comb(by_y, t) * 1j**by_y * (-1.0) ** (by_y - t)
            result[key] = result.get(key, 0.0) + value
    return tuple((j, k, value) for (j, k), value in result.items() if value != 0)


MOST = 5
"""Derivatives of a function by x and y in all."""
WIRTINGER = {(a, b): _wirtinger(a, b) for a in range(MOST + 1) for b in range(MOST + 1 - a)}
