"""The drive whose loudest disc is quietest, by an interior-point method, with its dual bound.

Over complex u, with Hermitian forms F (far) and Q (near),

    minimise s   subject to   Σ mₙuₙ = 1,   uᴴF_j u ≤ s,   uᴴQ_l u ≤ c,   |uₙ|² ≤ 1.

Mehrotra's predictor and corrector (SIAM J. Optim. 2, 1992, 575-601), with the second-order term of
the quadratic constraints in the corrector. Every multiplier λ ≥ 0 (Σλ = 1), μ ≥ 0, ν ≥ 0 proves a
bound, since the Lagrangian is a form of u alone (Boyd and Vandenberghe, Convex Optimization, 5.1):

    s ≥ 1/(mᵀM⁻¹m̅) − c Σμ − Σν,   M = Σ λF + Σ μQ + diag ν,

for every drive that meets the other constraints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
_Step = tuple[FloatArray, FloatArray, FloatArray]

TURNS = 60
"""Usual are 9 to 14."""
TO_BOUNDARY = 0.99
FIRST_SLACK = 0.1
"""At least, of a start that does not keep to a limit, in units of the loudest disc."""
KEPT = 1e-6
"""By which a limit may be passed: 4e-6 dB of a coil's."""
SILENT = 1e-8
"""80 dB below the finger: no closer is looked at, so that dependent fields end too."""


@dataclass(frozen=True)
class Minimum:
    """A drive and what is proved of it.

    Attributes
    ----------
    drive
        complex128, shape (N,), Σ mₙuₙ = 1.
    level
        max uᴴF_j u over the far forms it was found with.
    bound
        No drive within the other limits has a level below.
    turns
        Newton steps taken.
    """

    drive: ComplexArray
    level: float
    bound: float
    turns: int

    @property
    def gap(self) -> float:
        """What is left to prove, as a share of the level."""
        return (self.level - self.bound) / max(self.level, SILENT)


class _Constraints:
    """All inequalities f(x) ≤ 0 of x = (Re u, Im u, s), in one order: far, near, coils."""

    def __init__(self, far: ComplexArray, near: ComplexArray, cap: float) -> None:
        self.count = far.shape[1]
        self.far, self.near = len(far), len(near)
        self.forms = np.concatenate((far, near))
        self.flat = self.forms.reshape(len(self.forms), -1)
        self.cap = cap

    def images(self, u: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """R u for every form, (forms, N), and uᴴR u."""
        images = (self.forms.reshape(-1, self.count) @ u).reshape(-1, self.count)
        return images, np.asarray((images @ u.conj()).real)

    def values(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """f(x), shape (constraints,), and its derivatives, shape (constraints, 2N + 1)."""
        n = self.count
        u, s = x[:n] + 1j * x[n : 2 * n], x[-1]
        images, squares = self.images(u)
        discs = self.far + self.near
        values = np.concatenate((squares, np.abs(u) ** 2 - 1.0))
        values[: self.far] -= s
        values[self.far : discs] -= self.cap
        slopes = np.zeros((values.size, x.size))
        slopes[:discs, :n], slopes[:discs, n : 2 * n] = 2.0 * images.real, 2.0 * images.imag
        slopes[: self.far, -1] = -1.0
        coils = np.arange(n)
        slopes[discs + coils, coils], slopes[discs + coils, n + coils] = 2.0 * u.real, 2.0 * u.imag
        return values, slopes

    def second_order(self, step: FloatArray) -> FloatArray:
        """What f has beyond its tangent after a step: the forms of the step itself."""
        n = self.count
        u = step[:n] + 1j * step[n : 2 * n]
        return np.concatenate((self.images(u)[1], np.abs(u) ** 2))

    def weighted(self, multipliers: FloatArray) -> ComplexArray:
        """M = Σ λF + Σ μQ + diag ν of the multipliers of all constraints."""
        discs = self.far + self.near
        mixed = (multipliers[:discs] @ self.flat).reshape(self.count, self.count)
        mixed[np.diag_indices(self.count)] += multipliers[discs:]
        return np.asarray((mixed + mixed.conj().T) / 2.0)


def minimax(
    mean: ComplexArray,
    far: ComplexArray,
    near: ComplexArray,
    cap: float,
    *,
    tolerance: float,
    start: ComplexArray | None = None,
    enough: float = 0.0,
) -> Minimum:
    """The least loudest far disc.

    Parameters
    ----------
    mean
        m, shape (N,); Σ|mₙ| > 1, so that there is a drive within |uₙ| < 1.
    far, near
        F and Q, shapes (far, N, N) with at least one, and (near, N, N).
    cap
        c; some drive must keep to it.
    tolerance
        Relative gap between level and bound at which it ends.
    start
        A drive that keeps to the near level; without one, all coils push alike and in phase.
    enough
        It ends as soon as a drive has no higher level.
    """
    own, n = _Constraints(far, near, cap), mean.size
    u = equal_gain(mean) if start is None else start
    loudest = float(own.images(u)[1][: own.far].max())
    x = np.concatenate((u.real, u.imag, (2.0 * loudest + SILENT,)))
    cost = np.zeros(x.size)
    cost[-1] = 1.0
    equal = np.zeros((2, x.size))
    equal[0, : 2 * n] = np.concatenate((mean.real, -mean.imag))
    equal[1, : 2 * n] = np.concatenate((mean.imag, mean.real))
    slack = np.maximum(-own.values(x)[0], FIRST_SLACK * max(cap, loudest))
    # All products alike, and such that Σλ = 1.
    multipliers = 1.0 / np.sum(1.0 / slack[: own.far]) / slack
    best: Minimum | None = None
    for turn in range(1, TURNS + 1):
        values, slopes = own.values(x)
        now = _as_it_stands(own, mean, x, values, multipliers, turn)
        is_kept = bool(values[own.far :].max() <= KEPT)
        if best is None or (is_kept and now.gap < best.gap):
            best = now
        if is_kept and now.level <= enough:
            return now
        if best.gap <= tolerance:
            break
        try:
            step = _newton(own, (x, slack, multipliers, values, slopes), cost, equal)
        except np.linalg.LinAlgError:
            break
        x, slack, multipliers = (a + b for a, b in zip((x, slack, multipliers), step, strict=True))
    assert best is not None
    return best


def equal_gain(mean: ComplexArray) -> ComplexArray:
    """The drive with Σ mₙuₙ = 1 whose loudest coil is quietest: all alike, none against another."""
    sizes = np.abs(mean)
    return np.asarray(mean.conj() / np.where(sizes > 0.0, sizes, 1.0) / sizes.sum())


def _newton(
    own: _Constraints,
    state: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray],
    cost: FloatArray,
    equal: FloatArray,
) -> _Step:
    """One predictor and corrector: steps of x, of the slacks and of the multipliers."""
    x, slack, multipliers, values, slopes = state
    n, size = own.count, x.size
    mixed = own.weighted(multipliers)
    # Of the Lagrangian: 2M as a form of (Re u, Im u), and what the slacks' barrier adds.
    curved = np.zeros((size + 2, size + 2))
    curved[:n, :n] = curved[n : 2 * n, n : 2 * n] = 2.0 * mixed.real
    curved[n : 2 * n, :n], curved[:n, n : 2 * n] = 2.0 * mixed.imag, -2.0 * mixed.imag
    ratio = multipliers / slack
    curved[:size, :size] += (slopes.T * ratio) @ slopes
    curved[size:, :size], curved[:size, size:] = equal, equal.T
    unequal = np.array((1.0, 0.0)) - equal @ x
    inverse = np.linalg.inv(curved)

    def step(residual: FloatArray, products: FloatArray) -> _Step:
        """Steps towards f + w = 0 and w·y = products, for f off by `residual`."""
        pull = (products - slack * multipliers) / slack + ratio * residual
        right = np.concatenate((-(cost + slopes.T @ (multipliers + pull)), unequal))
        along = (inverse @ right)[:size]
        moved = slopes @ along
        return along, -residual - moved, pull + ratio * moved

    residual = values + slack
    mean_product = float(slack @ multipliers) / slack.size
    x1, slack1, multipliers1 = step(residual, np.zeros(slack.size))
    length = min(_longest(slack, slack1), _longest(multipliers, multipliers1))
    after = float((slack + length * slack1) @ (multipliers + length * multipliers1)) / slack.size
    centre = (after / mean_product) ** 3 * mean_product
    bent = length**2 * own.second_order(x1)
    products = centre - length**2 * slack1 * multipliers1
    found = step(residual + bent, products)
    length = TO_BOUNDARY * min(_longest(slack, found[1]), _longest(multipliers, found[2]))
    length = min(length, 1.0)
    return length * found[0], length * found[1], length * found[2]


def _longest(values: FloatArray, step: FloatArray) -> float:
    """How much of a step, at most all of it, keeps values above 0."""
    falling = step < 0.0
    return float(min(np.min(-values[falling] / step[falling], initial=np.inf), 1.0))


def _as_it_stands(
    own: _Constraints,
    mean: ComplexArray,
    x: FloatArray,
    values: FloatArray,
    multipliers: FloatArray,
    turn: int,
) -> Minimum:
    """The drive after some turns, and what the multipliers prove by then."""
    u = x[: own.count] + 1j * x[own.count : 2 * own.count]
    # Off Σ mₙuₙ = 1 by rounding.
    scale = float(abs(mean @ u))
    level = float(values[: own.far].max() + x[-1]) / scale**2
    return Minimum(u / (mean @ u), level, _dual_bound(own, mean, multipliers), turn)


def _dual_bound(own: _Constraints, mean: ComplexArray, multipliers: FloatArray) -> float:
    """What multipliers prove: no drive within the other limits has a far level below."""
    discs = own.far + own.near
    scaled = multipliers / multipliers[: own.far].sum()
    mixed = own.weighted(scaled)
    least = 1.0 / max(float((mean @ np.linalg.solve(mixed, mean.conj())).real), 1e-300)
    return least - own.cap * float(scaled[own.far : discs].sum()) - float(scaled[discs:].sum())
