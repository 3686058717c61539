"""Lévy's single series for a point force on a simply supported plate: exact where it stands.

With w = Σ Yₘ(y) sin(kₘx), kₘ = mπ/a, each Yₘ obeys (d²/dy² − s₁²)(d²/dy² − s₂²)Yₘ = pₘ δ(y − y₀),
s₁,₂² = kₘ² ± κ², κ⁴ = ρhω²/D. Partial fractions leave two Green's functions of a string on an
elastic bed,

    Yₘ = pₘ (g(s₂) − g(s₁)) / (2κ²),   g(s) = sinh(s y<) sinh(s(b − y>)) / (s sinh(sb)),

which are written in decaying exponentials, so that no order overflows. The terms fall as kₘ⁻³ even
under the force, where the double sum needs as many modes again for every one of them.
(Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, §34, for the static case.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LEAST_WAVE = 1e-3
"""Below this κ/k₁ the difference of the two Green's functions loses its digits: use the sum."""
MOST_TERMS = 200_000


def levy_terms(width: float, wave_number: float, tolerance: float) -> int:
    """Terms after which the rest is below `tolerance` of the leading one's size.

    For k > 2κ each term is at most (1 + (κ/k)⁴) times its static value 1/(4k³), and the sum of
    m⁻³ beyond M is below 1/(2M²).
    """
    needed = np.sqrt(1.0 / (2.0 * max(tolerance, 1e-12)))
    waves = 2.0 * wave_number * width / np.pi
    return int(min(max(needed, waves, 8.0) + 1.0, MOST_TERMS))


def levy_displacement(
    size: tuple[float, float],
    stiffness: complex,
    areal_mass: float,
    omega: float,
    load: tuple[float, float],
    points: FloatArray,
    tolerance: float,
) -> ComplexArray:
    """Displacement per newton of a point force, exact to `tolerance` at every point.

    Parameters
    ----------
    size
        Width and length, m; the origin is the plate's centre.
    stiffness
        D(1 + iη), N·m.
    areal_mass
        ρh, kg/m².
    omega
        rad/s, such that κ is at least `LEAST_WAVE` π / width.
    load
        Place of the force, m.
    points
        Shape (points, 2), m.
    tolerance
        Relative to the largest static deflection.

    Returns
    -------
    ComplexArray
        Shape (points,), m/N.
    """
    width, length = size
    kappa2 = np.sqrt(complex(areal_mass * omega**2 / stiffness))
    count = levy_terms(width, float(np.sqrt(abs(kappa2))), tolerance)
    k = np.arange(1, count + 1) * np.pi / width
    x0, y0 = load[0] + width / 2.0, load[1] + length / 2.0
    strength = 2.0 / (width * stiffness) * np.sin(k * x0)
    result = np.empty(len(points), dtype=np.complex128)
    for j, (x, y) in enumerate(points + np.array([width, length]) / 2.0):
        near, far = min(y, y0), max(y, y0)
        soft = _string(np.sqrt(k**2 - kappa2 + 0j), near, far, length)
        stiff = _string(np.sqrt(k**2 + kappa2 + 0j), near, far, length)
        result[j] = np.sum(strength * np.sin(k * x) * (soft - stiff) / (2.0 * kappa2))
    return result


def _string(s: ComplexArray, near: float, far: float, length: float) -> ComplexArray:
    """sinh(s near) sinh(s(b − far)) / (s sinh(sb)) without large exponentials (Re s ≥ 0)."""
    gap = far - near
    ends = np.exp(-s * gap) * -np.expm1(-2.0 * s * near) * -np.expm1(-2.0 * s * (length - far))
    return np.asarray(ends / (-2.0 * s * np.expm1(-2.0 * s * length)))
