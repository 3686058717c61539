"""A round winding and a magnet on its axis: force per ampere, resistance and inductance.

The magnet is a cylinder magnetised along its axis, with a permeability of 1 (NdFeB has 1.05).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chladni.sim.magnetics.constants import MU_0
from chladni.sim.magnetics.loops import shared_flux

COPPER_OHM_M = 1.68e-8
"""Resistivity of copper at 20 °C."""
COPPER_KG_M3 = 8960.0
WHEELER = 0.8e-6 / 0.0254
"""H/m: Wheeler's 0.8 µH with lengths in inches."""
STROKE = 1e-4
"""m, either way: far more than a board vibrates, less than a finger presses."""
GAUSS_POINTS = 24
"""Each way over the winding's cross-section. Where the magnet keeps a third of its height away they
leave 2e-9 of the force, at a tenth 2e-5, and 1e-3 where both touch."""


@dataclass(frozen=True)
class RoundWinding:
    """Turns spread evenly over a rectangle that is turned about the axis. Metres.

    `wire` is the diameter of the bare copper, `inner` and `outer` are diameters.
    """

    turns: int
    wire: float
    inner: float
    outer: float
    height: float

    @property
    def mean(self) -> float:
        """Mean diameter, m."""
        return (self.inner + self.outer) / 2.0

    @property
    def length(self) -> float:
        """Of the wire, m."""
        return float(self.turns * np.pi * self.mean)

    @property
    def copper(self) -> float:
        """Cross-section of the wire, m²."""
        return float(np.pi * self.wire**2 / 4.0)

    @property
    def fill(self) -> float:
        """Copper's share of the winding's cross-section."""
        return self.turns * self.copper / ((self.outer - self.inner) / 2.0 * self.height)

    @property
    def resistance(self) -> float:
        """Of the wire at 20 °C, Ω."""
        return COPPER_OHM_M * self.length / self.copper

    @property
    def mass(self) -> float:
        """Of the copper, kg."""
        return COPPER_KG_M3 * self.length * self.copper

    @property
    def inductance(self) -> float:
        """L = 0.8 µH N² a²/(6a + 9b + 10c), lengths in inches; H.

        With a the mean radius, b the height and c the depth of the winding. Within 1 % where the
        three terms are about alike, within 5 % on the windings of a test.

        References
        ----------
        H. A. Wheeler, Simple inductance formulas for radio coils, Proc. IRE 16, 1928, 1398-1400.
        """
        radius, depth = self.mean / 2.0, (self.outer - self.inner) / 2.0
        below = 6.0 * radius + 9.0 * self.height + 10.0 * depth
        return WHEELER * self.turns**2 * radius**2 / below


def force_per_ampere(
    winding: RoundWinding, *, remanence: float, radius: float, height: float, gap: float
) -> float:
    """Axial force between a winding and a magnet on its axis, N/A.

    A magnet is two discs of magnetic charge ±Br/μ₀, so each turn pulls with Br/μ₀ times the
    difference of its fluxes through the magnet's end faces:
    F/I = N Br/μ₀ ⟨Φ(near face) − Φ(far face)⟩, the mean over the winding's cross-section.

    Parameters
    ----------
    remanence
        Br, T.
    radius, height
        Of the magnet, m.
    gap
        From the winding's end to the magnet's near face, m; negative where the magnet dips in.

    References
    ----------
    Jackson, Classical Electrodynamics, 3rd edition, section 5.9, has magnets' surface charges.
    """
    node, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    turn = (winding.mean + node * (winding.outer - winding.inner) / 2.0) / 2.0
    down = (1.0 + node) / 2.0 * winding.height
    near, far = (
        weight @ shared_flux(turn[:, None], radius, down + gap + beyond) @ weight / 4.0
        for beyond in (0.0, height)
    )
    return float(winding.turns * remanence / MU_0 * (near - far))


@dataclass(frozen=True)
class ForceOverStroke:
    """How force per ampere changes as the magnet moves along its axis by `STROKE`.

    Attributes
    ----------
    force_factor
        In the middle, N/A.
    nearer, farther
        By what share it is more at the ends of the stroke.
    """

    force_factor: float
    nearer: float
    farther: float


def force_over_stroke(
    winding: RoundWinding, *, remanence: float, radius: float, height: float, gap: float
) -> ForceOverStroke:
    """Force per ampere at a gap and `STROKE` to either side of it.

    Parameters
    ----------
    winding, remanence, radius, height, gap
        As of `force_per_ampere`.
    """
    nearer, middle, farther = (
        force_per_ampere(winding, remanence=remanence, radius=radius, height=height, gap=gap + off)
        for off in (-STROKE, 0.0, STROKE)
    )
    return ForceOverStroke(middle, nearer / middle - 1.0, farther / middle - 1.0)
