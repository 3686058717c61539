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
from functools import cache, cached_property
from math import comb, factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

AT_ONCE = 1 << 13
"""Points times circles evaluated in one go, so that they stay in the cache."""
JOINED = 4
"""Derivatives that a smooth continuation shares with the function outside."""

Derivative = tuple[int, int]
"""How often a function is differentiated by x and by y."""


@dataclass(frozen=True)
class Term:
    """factor · zᵖ z̄^q, times ln|z| if `log`."""

    factor: float
    p: int
    q: int
    log: bool = False


@dataclass(frozen=True)
class RadialFunction:
    """One function of a circle, written as terms outside and inside of it."""

    order: int
    outside: tuple[Term, ...]
    inside: tuple[Term, ...]


@dataclass(frozen=True)
class Circle:
    """A circle with the functions it brings into the basis.

    Parameters
    ----------
    x, y, radius
        Centre and radius, m.
    rings
        Highest angular order with rim functions, or −1 for none.
    bubbles
        Highest angular order with a bubble, or −1 for none.
    kinds
        Rim forces (0), rim moments (1) or both.
    """

    x: float
    y: float
    radius: float
    rings: int
    bubbles: int = -1
    kinds: tuple[int, ...] = (0, 1)

    def functions(self) -> tuple[RadialFunction, ...]:
        """Rim functions by order and kind, then bubbles by order."""
        return _functions(self.rings, self.bubbles, self.kinds, smooth=False)

    def members(self) -> tuple[tuple[RadialFunction, bool], ...]:
        """(function, is its sine) of every basis function, in the order of `evaluate`."""
        return _members(self.rings, self.bubbles, self.kinds)

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


@cache
def _functions(
    rings: int, bubbles: int, kinds: tuple[int, ...], *, smooth: bool
) -> tuple[RadialFunction, ...]:
    own = [ring_function(m, kind) for m in range(rings + 1) for kind in kinds]
    own += [bubble_function(m) for m in range(bubbles + 1)]
    return tuple(continued(function) for function in own) if smooth else tuple(own)


@cache
def _members(
    rings: int, bubbles: int, kinds: tuple[int, ...]
) -> tuple[tuple[RadialFunction, bool], ...]:
    return tuple(
        (function, sine)
        for function in _functions(rings, bubbles, kinds, smooth=False)
        for sine in ((False, True) if function.order > 0 else (False,))
    )


def evaluate_circles(
    circles: Sequence[Circle], x: FloatArray, y: FloatArray, derivative: Derivative,
    smooth: Sequence[bool],
) -> FloatArray:  # fmt: skip
    """`Circle.evaluate` of several circles, one after the other; shape (points, functions).

    Circles of the same functions are taken together where points are few: there calls cost more
    than their work.
    """
    ends = np.cumsum([0] + [len(circle.members()) for circle in circles])
    # Function by function in memory: each is written, combined and summed as a whole.
    result = np.empty((int(ends[-1]), x.size))
    alike: dict[tuple[int, int, tuple[int, ...], bool], list[int]] = {}
    for k, (circle, is_smooth) in enumerate(zip(circles, smooth, strict=True)):
        alike.setdefault((circle.rings, circle.bubbles, circle.kinds, is_smooth), []).append(k)
    together = max(1, AT_ONCE // max(x.size, 1))
    for (rings, bubbles, kinds, is_smooth), members in alike.items():
        functions = _functions(rings, bubbles, kinds, smooth=is_smooth)
        for first in range(0, len(members), together):
            some = members[first : first + together]
            split = SplitPoints.at(np.array([circles[k].local(x, y) for k in some]))
            radii = np.array([[circles[k].radius] for k in some])
            rows = ends[some]
            for function in functions:
                values = split.evaluate(function, derivative) / radii ** sum(derivative)
                result[rows] = values.real
                rows = rows + 1
                if function.order > 0:
                    result[rows] = -values.imag
                    rows = rows + 1
    return result.T


class Powers:
    """Integer powers of z and of z̄, and ln|z|, each computed once."""

    def __init__(self, z: ComplexArray) -> None:
        self.z = z
        self._powers: dict[int, ComplexArray] = {0: np.ones(z.shape, dtype=np.complex128), 1: z}

    @cached_property
    def log(self) -> FloatArray:
        """ln|z|."""
        return np.asarray(np.log(np.abs(self.z)))

    def of_z(self, exponent: int) -> ComplexArray:
        """z^exponent."""
        if exponent not in self._powers:
            if exponent == -1:
                value = 1.0 / self.z
            else:
                step = 1 if exponent > 0 else -1
                value = self.of_z(exponent - step) * self.of_z(step)
            self._powers[exponent] = value
        return self._powers[exponent]


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
        return cls(is_inside, Powers(z[is_inside]), Powers(z[~is_inside]))

    def evaluate(self, function: RadialFunction, derivative: Derivative) -> ComplexArray:
        """∂ₓᵃ∂ᵧᵇ of one function by z (not yet divided by Rᵃ⁺ᵇ); shape (points,)."""
        result = np.zeros(self.is_inside.shape, dtype=np.complex128)
        if function.inside and self.inside.z.size:
            result[self.is_inside] = _differentiate(function.inside, self.inside, derivative)
        if function.outside and self.outside.z.size:
            result[~self.is_inside] = _differentiate(function.outside, self.outside, derivative)
        return result


@cache
def ring_function(order: int, kind: int) -> RadialFunction:
    """The exterior potential of a rim force (`kind` 0) or rim moment (`kind` 1) of cos mθ."""
    if order == 0:
        outside = Term(1.0, 1, 1, True) if kind == 0 else Term(1.0, 0, 0, True)
    elif order == 1:
        outside = Term(1.0, 0, 1, True) if kind == 0 else Term(1.0, -1, 0)
    else:
        outside = Term(1.0, 1 - order, 1) if kind == 0 else Term(1.0, -order, 0)
    value = radial_derivative((outside,), 0)
    slope = radial_derivative((outside,), 1)
    beta = (slope - order * value) / 2.0
    inside = (Term(value - beta, 0, order), Term(beta, 1, order + 1))
    return RadialFunction(order, (outside,), inside)


@cache
def bubble_function(order: int) -> RadialFunction:
    """ρᵐ(1 − ρ²)² inside, nothing outside: value and slope vanish on the rim."""
    terms = (Term(1.0, 0, order), Term(-2.0, 1, order + 1), Term(1.0, 2, order + 2))
    return RadialFunction(order, (), terms)


@cache
def continued(function: RadialFunction) -> RadialFunction:
    """The same outside; inside ρᵐ times a polynomial in ρ² that joins it up to a high derivative.

    A function's own continuation keeps value and slope, and its kink is what a quadrature over the
    plate would get wrong. A bubble has nothing outside to continue.
    """
    if not function.outside:
        return RadialFunction(function.order, (), ())
    powers = [Term(1.0, k, function.order + k) for k in range(JOINED + 1)]
    rows = range(JOINED + 1)
    matrix = np.array([[radial_derivative((term,), row) for term in powers] for row in rows])
    factors = np.linalg.solve(
        matrix, np.array([radial_derivative(function.outside, row) for row in rows])
    )
    inside = tuple(
        Term(float(factor), term.p, term.q) for factor, term in zip(factors, powers, strict=True)
    )
    return RadialFunction(function.order, function.outside, inside)


def disc_load_deflection(u: FloatArray, v: FloatArray, derivative: Derivative) -> FloatArray:
    """Deflection of an endless plate under a uniform disc load, in units of R²/(8πD) per newton.

    Outside, the mean of the point solution r² ln r over the disc: ρ² ln ρ + ½ ln ρ. Inside,
    ρ⁴/8 + ρ²/2 − 5/8, which joins it up to the third derivative. (Timoshenko and
    Woinowsky-Krieger, Theory of Plates and Shells, §16, less a rigid motion.)

    Parameters
    ----------
    u, v
        Places from the disc's centre in radii, of any shape.
    derivative
        How often by u and by v, three times at most in all.

    Returns
    -------
    FloatArray
        Of the same shape.
    """
    squared = u**2 + v**2
    by_u, by_v = derivative
    total: FloatArray | float = 0.0
    # ∂ᵃf(u² + v²)/∂uᵃ = Σₖ a! / ((a − k)! (2k − a)!) (2u)²ᵏ⁻ᵃ f⁽ᵏ⁾, and so by v.
    for k in range((by_u + 1) // 2, by_u + 1):
        for j in range((by_v + 1) // 2, by_v + 1):
            count = _pairings(by_u, k) * _pairings(by_v, j)
            along = (2.0 * u) ** (2 * k - by_u) * (2.0 * v) ** (2 * j - by_v)
            total = total + count * along * _load_profile(squared, k + j)
    return np.asarray(total)


def _pairings(order: int, count: int) -> int:
    return factorial(order) // (factorial(order - count) * factorial(2 * count - order))


def _load_profile(squared: FloatArray, count: int) -> FloatArray:
    """d^count f/ds^count of that deflection as a function of s = ρ²."""
    inside = squared < 1.0
    s = np.where(inside, 1.0, squared)
    if count == 0:
        near = np.where(inside, squared, 1.0)
        return np.where(inside, (0.125 * near + 0.5) * near - 0.625, (0.5 * s + 0.25) * np.log(s))
    if count == 1:
        return np.where(inside, 0.25 * squared + 0.5, 0.5 * np.log(s) + 0.5 + 0.25 / s)
    if count == 2:
        return np.where(inside, 0.25, (0.5 - 0.25 / s) / s)
    return np.where(inside, 0.0, (0.5 / s - 0.5) / s**2)


def radial_derivative(terms: tuple[Term, ...], count: int) -> float:
    """d^count f/dρ^count at ρ = 1 of the radial profile of `terms`."""
    total = 0.0
    for term in terms:
        power = term.p + term.q
        plain, offset = _falling(power, count)
        total += term.factor * (offset if term.log else plain)
    return total


def _differentiate(terms: tuple[Term, ...], powers: Powers, derivative: Derivative) -> ComplexArray:
    total = np.zeros(powers.z.shape, dtype=np.complex128)
    for (j, k), coefficient in _wirtinger(*derivative).items():
        for term in terms:
            total += (coefficient * term.factor) * _monomial(term, powers, j, k)
    return total


def _monomial(term: Term, powers: Powers, j: int, k: int) -> ComplexArray | float:
    """∂_z^j ∂_z̄^k of zᵖ z̄^q, or of zᵖ z̄^q ln|z|."""
    a, c = _falling(term.p, j)
    b, d = _falling(term.q, k)
    factor: FloatArray | float = a * b
    if term.log:
        # ln|z| = (ln z + ln z̄)/2, so each half differentiates on its own side.
        factor = 0.5 * (c * b + a * d)
        if a * b != 0.0:
            factor = factor + a * b * powers.log
    elif a * b == 0.0:
        return 0.0
    p, q = term.p - j, term.q - k
    if q == 0:
        return np.asarray(factor * powers.of_z(p))
    if p == 0:
        return np.asarray(factor * powers.of_z(q).conj())
    return np.asarray(factor * powers.of_z(p) * powers.of_z(q).conj())


@cache
def _falling(power: int, count: int) -> tuple[float, float]:
    """(a, c) with d^count (s^power ln s) = s^(power − count) (a ln s + c); a alone without ln."""
    a, c = 1.0, 0.0
    for step in range(count):
        a, c = (power - step) * a, (power - step) * c + a
    return a, c


@cache
def _wirtinger(by_x: int, by_y: int) -> dict[tuple[int, int], complex]:
    """Coefficients of ∂_z^j ∂_z̄^k in ∂ₓ^by_x ∂ᵧ^by_y = (∂_z + ∂_z̄)^by_x (i∂_z − i∂_z̄)^by_y."""
    result: dict[tuple[int, int], complex] = {}
    for s in range(by_x + 1):
        for t in range(by_y + 1):
            key = (s + t, by_x - s + by_y - t)
            value = comb(by_x, s) * comb(by_y, t) * 1j**by_y * (-1.0) ** (by_y - t)
            result[key] = result.get(key, 0.0) + value
    return {key: value for key, value in result.items() if value != 0}
