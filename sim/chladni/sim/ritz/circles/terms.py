"""The functions of one circle as terms zᵖ z̄^q ln|z|: rim fields, bubbles, smooth continuations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RIM_KINDS = (0, 1)
"""Rim forces and rim moments."""
JOINED = 4
"""Derivatives that a smooth continuation shares with the function outside."""


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


class FunctionSet:
    """Functions of circles that bring the same ones: made once for all of them by their basis.

    Parameters
    ----------
    orders
        Highest angular order with rim functions, or −1 for none.
    bubbles
        Highest angular order with a bubble, or −1 for none.
    kinds
        Rim forces (0), rim moments (1) or both.
    """

    def __init__(self, orders: int, bubbles: int, kinds: tuple[int, ...]) -> None:
        self.orders, self.bubbles = orders, bubbles
        self.functions = [rim_function(m, kind) for m in range(orders + 1) for kind in kinds]
        self.functions += [bubble_function(m) for m in range(bubbles + 1)]
        self.continued = [continued(function) for function in self.functions]
        self.members = [
            (function, sine)
            for function in self.functions
            for sine in ((False, True) if function.order > 0 else (False,))
        ]


def rim_function(order: int, kind: int) -> RadialFunction:
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


def bubble_function(order: int) -> RadialFunction:
    """ρᵐ(1 − ρ²)² inside, nothing outside: value and slope vanish on the rim."""
    terms = (Term(1.0, 0, order), Term(-2.0, 1, order + 1), Term(1.0, 2, order + 2))
    return RadialFunction(order, (), terms)


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


def radial_derivative(terms: tuple[Term, ...], count: int) -> float:
    """d^count f/dρ^count at ρ = 1 of the radial profile of `terms`."""
    total = 0.0
    for term in terms:
        power = term.p + term.q
        plain, offset = falling(power, count)
        total += term.factor * (offset if term.log else plain)
    return total


def falling(power: int, count: int) -> tuple[float, float]:
    """(a, c) with d^count (s^power ln s) = s^(power − count) (a ln s + c); a alone without ln."""
    a, c = 1.0, 0.0
    for step in range(count):
        a, c = (power - step) * a, (power - step) * c + a
    return a, c
