"""The deflection of an endless plate under a uniform disc load, in closed form."""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def disc_load_deflection(u: FloatArray, v: FloatArray, derivative: tuple[int, int]) -> FloatArray:
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
