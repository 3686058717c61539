"""Coupling of a coil to a magnet off its axis: a force along the axes, and a couple.

A magnet is two discs of magnetic charge ±Br/μ₀, so it is pulled by Br/μ₀ ∫ B dA over one face less
that over the other.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chladni.sim.magnetics.constants import MU_0
from chladni.sim.magnetics.windings import RoundWinding

FloatArray = NDArray[np.float64]

ACROSS_WINDING, ALONG_RADIUS, ROUND_FACE = 4, 4, 10
"""Points over a winding's section (each way) and a magnet's face. They leave 1e-4 of the force
where winding and magnet all but touch, and less farther off."""


def loop_field(radius: ArrayLike, at: ArrayLike, apart: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Radial and axial flux density of a loop per ampere, T/A.

    B_ρ = C z/ρ ((a² + ρ² + z²) E − α² K),  B_z = C ((a² − ρ² − z²) E + α² K),
    C = μ₀/(2π α² β), α² = (a − ρ)² + z², β² = (a + ρ)² + z², m = 1 − α²/β².

    Parameters
    ----------
    radius
        Of the loop, a, m; above 0.
    at
        Distance from the axis, ρ, m; above 0.
    apart
        Along the axis from the loop's plane, z, m.

    References
    ----------
    Smythe, Static and Dynamic Electricity, 3rd edition, section 7.10.
    """
    # scipy.special takes 0.1 s to load, which no device needs.
    from scipy.special import ellipe, ellipkm1  # noqa: PLC0415

    a, rho, z = np.broadcast_arrays(*(np.asarray(x, np.float64) for x in (radius, at, apart)))
    near, far = (a - rho) ** 2 + z**2, (a + rho) ** 2 + z**2
    first, second = ellipkm1(near / far), ellipe(1.0 - near / far)
    scale = MU_0 / (2.0 * np.pi * near * np.sqrt(far))
    radial = scale * z / rho * ((a**2 + rho**2 + z**2) * second - near * first)
    axial = scale * ((a**2 - rho**2 - z**2) * second + near * first)
    return np.asarray(radial), np.asarray(axial)


def mutual_inductance(winding: RoundWinding, apart: float) -> float:
    """Of two such windings side by side, whose axes are `apart` (m, more than their width), H.

    The flux of each turn of one through the turns of the other; negative, since it comes back
    beside a coil.
    """
    node, weight = np.polynomial.legendre.leggauss(ACROSS_WINDING)
    turn = (winding.mean + node * (winding.outer - winding.inner) / 2.0) / 2.0
    level = node * winding.height / 2.0
    near, weight_near = np.polynomial.legendre.leggauss(ALONG_RADIUS)
    angle = 2.0 * np.pi * (np.arange(ROUND_FACE) + 0.5) / ROUND_FACE
    flux = 0.0
    for other, share in zip(turn, weight / 2.0, strict=True):
        radius = other * np.sqrt((1.0 + near) / 2.0)
        rho = np.hypot(apart + np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle)))
        area = np.pi * other**2 * weight_near / 2.0 / ROUND_FACE
        away = level[:, None] - level
        _, axial = loop_field(
            turn[:, None, None, None, None], rho[None, None, None], away[:, :, None, None]
        )
        through = np.einsum("tabrn,r->tab", axial, area)
        flux += share * float(np.einsum("tab,t,a,b->", through, weight, weight, weight)) / 8.0
    return winding.turns**2 * flux


# A fit asks for the same pairs at every frequency.
@lru_cache(maxsize=4096)
def force_and_couple(
    winding: RoundWinding,
    *,
    remanence: float,
    radius: float,
    height: float,
    gap: float,
    apart: float,
) -> tuple[float, float]:
    """Axial force on a magnet whose axis is not the winding's, N/A, and couple, N·m/A.

    The couple acts on a slope of the magnet's far face (the one glued to a plate), away from
    the winding: what follows a slope s there moves up by s x and along by s times its depth.

    Parameters
    ----------
    remanence
        Br, T.
    radius, height
        Of the magnet, m.
    gap
        From the winding's end to the level of the magnet's near face, m.
    apart
        From axis to axis, m; above 0.
    """
    node, weight = np.polynomial.legendre.leggauss(ACROSS_WINDING)
    turn = (winding.mean + node * (winding.outer - winding.inner) / 2.0) / 2.0
    down = (1.0 + node) / 2.0 * winding.height
    section = np.multiply.outer(weight, weight)[..., None] / 4.0
    node, weight = np.polynomial.legendre.leggauss(ALONG_RADIUS)
    angle = 2.0 * np.pi * (np.arange(ROUND_FACE) + 0.5) / ROUND_FACE
    from_axis = radius * np.sqrt((1.0 + node) / 2.0)
    x, y = (np.outer(from_axis, trig(angle)).ravel() for trig in (np.cos, np.sin))
    area = np.repeat(weight, ROUND_FACE) / 2.0 / ROUND_FACE * np.pi * radius**2
    rho = np.hypot(apart + x, y)
    force = couple = 0.0
    for sign, depth in ((1.0, height), (-1.0, 0.0)):  # of the near face, and the glued one
        above = gap + height - depth + down
        radial, axial = (
            np.sum(section * own, axis=(0, 1))
            for own in loop_field(turn[:, None, None], rho, above[:, None])
        )
        charge = sign * remanence / MU_0 * winding.turns * area
        force += float(charge @ axial)
        couple += float(charge @ (axial * x + radial * (apart + x) / rho * depth))
    return force, couple
