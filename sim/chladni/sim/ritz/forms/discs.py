"""Energy of glued discs and holes, from what functions do on each disc.

On a disc every function of the basis is smooth, so its values at a few points tell a polynomial
of the disc that it is, and the energies of those polynomials are known beforehand. A disc then
costs as many rows as it has polynomials, not three second derivatives at every point.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from chladni.sim.plate.geometry import Inclusion
from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.quadrature import DiscRule, Points, join
from chladni.sim.ritz.circles.derivatives import Derivative, SplitPoints
from chladni.sim.ritz.circles.functions import Circle
from chladni.sim.ritz.circles.terms import RadialFunction, Term

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

MORE_ORDERS, MORE_DEGREES = 4, 10
"""Angular orders beyond those of a disc's own functions, and degrees beyond those that the plate's
polynomials have on it: what neighbours and products of polynomials add."""
LEAST_PER_ORDER = 3
"""Powers of ρ² with each order: ρᵐ and ρᵐ⁺² of fields without load, one more for bubbles."""


class DiscPolynomials:
    """Orthonormal polynomials of the unit disc, up to an angular order and a degree.

    Attributes
    ----------
    rule
        Points at which functions are to be known.
    projector
        Of a function's values at those points onto the polynomials; (polynomials, points).
    slope
        R with RᵀR ∫ of the products of the polynomials' gradients; (polynomials, polynomials).
    """

    def __init__(self, orders: int, degree: int) -> None:
        self.rule = DiscRule(radial=degree // 2 + 3, angular=2 * orders + 4)
        points = self.rule.on(0.0, 0.0, 1.0)
        functions = [
            RadialFunction(m, (), (Term(1.0, s, m + s),))
            for m in range(orders + 1)
            for s in range(max(LEAST_PER_ORDER, (degree - m) // 2 + 1))
        ]
        split = SplitPoints.at(points.x + 1j * points.y)
        root = np.sqrt(points.weights)[:, None]

        def sampled(derivative: Derivative) -> FloatArray:
            columns = []
            for function in functions:
                value = split.evaluate(function, derivative)
                columns += [value.real, -value.imag] if function.order else [value.real]
            return np.asarray(root * np.stack(columns, axis=1))

        orthonormal, triangle = qr(sampled((0, 0)), mode="economic")
        self.projector = np.asarray((orthonormal * root).T)

        def derived(derivative: Derivative) -> FloatArray:
            return np.asarray(solve_triangular(triangle, sampled(derivative).T, trans="T").T)

        self._second = [derived(d) for d in ((2, 0), (1, 1), (0, 2))]
        self.slope = _root(np.concatenate((derived((1, 0)), derived((0, 1)))))

    def bending(self, poisson: float) -> FloatArray:
        """R with RᵀR the bending energy form by D, of shape (polynomials, polynomials)."""
        xx, xy, yy = self._second
        return _root(bending_rows(xx, xy, yy, poisson))


@dataclass(frozen=True)
class _Disc:
    """One disc of the plate's fundamental part, which stands for `orbit` images."""

    circle: int
    inclusion: Inclusion
    polynomials: DiscPolynomials
    bending: FloatArray
    points: slice
    orbit: float


@dataclass(frozen=True)
class OnDisc:
    """Functions as polynomials of one disc, and their bending; each (polynomials, functions)."""

    values: FloatArray
    bending: FloatArray


class Discs:
    """All discs of a basis, the images of mirrored ones left out.

    Attributes
    ----------
    points
        Quadrature over them, one after the other; weights count the images.
    inclusion
        Which inclusion each point belongs to, shape (points,).
    """

    def __init__(self, basis: Basis, mirrors: Mirrors) -> None:
        geometry = basis.geometry
        made: dict[tuple[int, int], DiscPolynomials] = {}
        bending: dict[tuple[int, int], FloatArray] = {}
        self._own: list[_Disc] = []
        points: list[Points] = []
        inclusion: list[int] = []
        count = 0
        for k, (disc, circle) in enumerate(zip(geometry.inclusions, basis.inclusions, strict=True)):
            if not mirrors.holds(np.array(disc.x), np.array(disc.y)):
                continue
            key = orders_and_degree(basis, circle)
            if key not in made:
                made[key] = DiscPolynomials(*key)
                bending[key] = made[key].bending(geometry.poisson)
            orbit = float(mirrors.orbit(disc.x, disc.y))
            own = made[key].rule.on(disc.x, disc.y, disc.radius)
            points.append(Points(own.x, own.y, orbit * own.weights))
            span = slice(count, count + own.x.size)
            self._own.append(_Disc(len(basis.rims) + k, disc, made[key], bending[key], span, orbit))
            inclusion += [k] * own.x.size
            count = span.stop
        self.points = join(points)
        self.inclusion = np.array(inclusion, dtype=np.intp)

    def spans(self) -> list[tuple[int, slice]]:
        """(circle, its rows among the points) of every disc."""
        return [(disc.circle, disc.points) for disc in self._own]

    def project(self, values: FloatArray) -> list[OnDisc]:
        """Functions, given at the points, as polynomials of each disc."""
        result = []
        for disc in self._own:
            own = disc.polynomials.projector @ values[disc.points]
            result.append(OnDisc(own, disc.bending @ own))
        return result

    def added_stiffness(self, left: list[OnDisc], right: list[OnDisc]) -> FloatArray | float:
        """Strain energy by D that discs add to two sets of functions; (functions, functions)."""
        factors = [
            disc.orbit * (disc.inclusion.stiffness_ratio - 1.0) / disc.inclusion.radius**2
            for disc in self._own
        ]
        return _sum_of_products([d.bending for d in left], [d.bending for d in right], factors)

    def added_inertia(self, left: list[OnDisc], right: list[OnDisc]) -> FloatArray | float:
        """Kinetic energy that discs add to two sets of functions; (functions, functions)."""
        moved = self.overlap(left, right, lambda disc: disc.areal_mass)
        one = self._slopes(left)
        other = one if left is right else self._slopes(right)
        turned = [disc.orbit * disc.inclusion.rotary for disc in self._own]
        return moved + _sum_of_products(one, other, turned)

    def _slopes(self, functions: list[OnDisc]) -> list[FloatArray]:
        return [
            disc.polynomials.slope @ own.values
            for disc, own in zip(self._own, functions, strict=True)
        ]

    def overlap(
        self, left: list[OnDisc], right: list[OnDisc], weight: Callable[[Inclusion], float]
    ) -> FloatArray | float:
        """∫ of the functions' products over discs, each with a weight; (functions, functions)."""
        factors = [
            disc.orbit * weight(disc.inclusion) * disc.inclusion.radius**2 for disc in self._own
        ]
        return _sum_of_products([d.values for d in left], [d.values for d in right], factors)

    def bending_of(self, circle: int, own: IntArray, basis: list[OnDisc]) -> FloatArray:
        """Strain energy by D on one circle's disc of columns `own` with all; (own, functions)."""
        ((disc, on_it),) = (
            pair for pair in zip(self._own, basis, strict=True) if pair[0].circle == circle
        )
        factor = disc.orbit / disc.inclusion.radius**2
        return np.asarray(factor * (on_it.bending[:, own].T @ on_it.bending))


def _root(rows: FloatArray) -> FloatArray:
    """R with RᵀR = rowsᵀ · rows, as many rows as columns."""
    return np.asarray(qr(rows, mode="r")[0][: rows.shape[1]])


def bending_rows(xx: FloatArray, xy: FloatArray, yy: FloatArray, poisson: float) -> FloatArray:
    """B with BᵀB the bending energy form by D of second derivatives, (3 · points, functions)."""
    # ν(Δu)² + (1 − ν)(u_xx² + 2u_xy² + u_yy²) as three squares
    return np.concatenate(
        (
            np.sqrt((1.0 + poisson) / 2.0) * (xx + yy),
            np.sqrt((1.0 - poisson) / 2.0) * (xx - yy),
            np.sqrt(2.0 * (1.0 - poisson)) * xy,
        )
    )


def orders_and_degree(basis: Basis, circle: Circle) -> tuple[int, int]:
    """Angular order and degree up to which a disc's polynomials have to go."""
    degree = degree_on(basis, circle.radius)
    orders = max(circle.own.orders, circle.own.bubbles)
    return max(orders + MORE_ORDERS, degree - LEAST_PER_ORDER), degree


def degree_on(basis: Basis, radius: float) -> int:
    """Degree that the plate's polynomials have on a disc of a radius."""
    resolution, geometry = basis.resolution, basis.geometry
    waves = max(resolution.nx / geometry.width, resolution.ny / geometry.length)
    return MORE_DEGREES + int(np.ceil(2.0 * radius * waves))


def _sum_of_products(
    left: list[FloatArray], right: list[FloatArray], factors: list[float]
) -> FloatArray | float:
    """Σ factor · leftᵀ · right, in one product of all rows."""
    if not left:
        return 0.0
    rows = np.repeat(factors, [len(own) for own in left])
    one = np.concatenate(left)
    other = one if all(a is b for a, b in zip(left, right, strict=True)) else np.concatenate(right)
    return signed_product(one, other, rows)


def signed_product(left: FloatArray, right: FloatArray, weights: FloatArray) -> FloatArray:
    """leftᵀ · weights · right of values at points, weights of either sign."""
    if left is not right:
        return np.asarray(left.T * weights @ right)
    total = np.zeros((left.shape[1], right.shape[1]))
    for sign in (1.0, -1.0):
        rows = sign * weights > 0.0
        if rows.any():
            # A matrix by its own transpose takes half the time.
            rooted = np.sqrt(np.abs(weights[rows]))[:, None] * left[rows]
            total += sign * (rooted.T @ rooted)
    return total
