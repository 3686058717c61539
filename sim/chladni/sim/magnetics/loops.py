"""Circular current loops about one axis: their vector potential, and the flux that they share."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chladni.sim.magnetics.constants import MU_0

FloatArray = NDArray[np.float64]

SMALL = 1e-3
"""Of m, below which a series replaces a difference that would lose digits."""


def vector_potential(radius: ArrayLike, at: ArrayLike, apart: ArrayLike) -> FloatArray:
    """Azimuthal vector potential of a loop per ampere, Wb/(m·A).

    A = μ₀/(π k) √(a/ρ) ((1 − k²/2) K − E), m = k² = 4aρ/((a + ρ)² + z²)

    Parameters
    ----------
    radius
        Of the loop, a, m; above 0.
    at
        Distance from the axis, ρ, m; above 0.
    apart
        Distance along the axis, z, m.

    Returns
    -------
    FloatArray
        Of the parameters' common shape; infinite on the loop itself.

    References
    ----------
    Jackson, Classical Electrodynamics, 3rd edition, eq. (5.37).
    """
    # scipy.special takes 0.1 s to load, which no device needs.
    from scipy.special import ellipe, ellipkm1  # noqa: PLC0415

    a, rho, z = np.broadcast_arrays(*(np.asarray(x, np.float64) for x in (radius, at, apart)))
    farthest = (a + rho) ** 2 + z**2
    m = 4.0 * a * rho / farthest
    # 1 − m by itself, so that it keeps its digits close to the loop.
    rest = ((a - rho) ** 2 + z**2) / farthest
    whole = (1.0 - m / 2.0) * ellipkm1(rest) - ellipe(m)
    # (1 − m/2) K − E = π m²/32 (1 + 3m/4 + 75m²/128 + …): 5e-10 of it is left out at m = 1e-3.
    series = np.pi * m**2 / 32.0 * (1.0 + 0.75 * m + 75.0 / 128.0 * m**2)
    return np.asarray(MU_0 / np.pi * np.sqrt(a / (rho * m)) * np.where(m < SMALL, series, whole))


def shared_flux(radius: ArrayLike, other: ArrayLike, apart: ArrayLike) -> FloatArray:
    """Flux of a loop per ampere through a disc about the same axis, H: Φ = 2πρ A(ρ, z).

    It is the mutual inductance of the loop and the disc's rim, and the same with both exchanged.

    Parameters
    ----------
    radius, other, apart
        Of the loop and of the disc, and between their planes, m.
    """
    return 2.0 * np.pi * np.asarray(other) * vector_potential(radius, other, apart)
