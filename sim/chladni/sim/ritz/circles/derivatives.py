"""Derivatives by x and y of sums of terms zᵖ z̄^q ln|z|, at points on either side of a rim."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import comb
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.circles.terms import RadialFunction, Term, falling

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

Derivative = tuple[int, int]
"""How often a function is differentiated by x and by y."""
Wirtinger = tuple[tuple[int, int, complex], ...]
"""(j, k, coefficient) of every ∂_z^j ∂_z̄^k in an operator."""


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
            return differentiate(function.outside, self.outside, operator)
        result = np.zeros(self.is_inside.shape, dtype=np.complex128)
        if function.inside and self.inside.z.size:
            result[self.is_inside] = differentiate(function.inside, self.inside, operator)
        if function.outside and self.outside.z.size:
            result[~self.is_inside] = differentiate(function.outside, self.outside, operator)
        return result


def differentiate(terms: tuple[Term, ...], powers: Powers, operator: Wirtinger) -> ComplexArray:
    """An operator on a sum of terms, at the points of `powers`."""
    total: ComplexArray | None = None
    for p, q, plain, by_log in _monomials(terms, operator):
        value = powers.of(p, q)
        if by_log:
            value = value * (plain + by_log * powers.log)
        elif plain != 1.0:
            value = value * plain
        total = value if total is None else total + value
    return np.zeros(powers.z.shape, dtype=np.complex128) if total is None else total


def vanishes(terms: tuple[Term, ...], operator: Wirtinger) -> bool:
    """Whether an operator makes zero of a sum of terms."""
    return not _monomials(terms, operator)


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
