"""How large a basis a scene needs: from its wavelength, its proportions and the tolerance."""

from __future__ import annotations

import numpy as np

from chladni.sim.ritz.geometry import PlateGeometry, Resolution

LEVELS = 7
"""Sizes that are tried, each with about four more polynomials along the short side."""
BASE, STEP = 10, 4
ASPECT_POWER = 0.6
"""A long side needs more polynomials than the short one, but the features on it are as large."""
LONGEST_FACTOR = 4.0
WAVES = 0.55
"""Polynomials per k·L: π per wavelength resolves a wave, and 0.55 · 2π = 3.5."""
FEATURELESS = 2
"""A plate without circles converges so fast that two levels fewer do."""


def resolution_for(geometry: PlateGeometry, wave_number: float, level: int) -> Resolution:
    """A basis for waves of up to `wave_number` (rad/m), the larger the higher `level` is."""
    sides = np.array([geometry.width, geometry.length])
    stretch = np.minimum((sides / sides.min()) ** ASPECT_POWER, LONGEST_FACTOR)
    counts = np.ceil(WAVES * wave_number * sides + stretch * (BASE + STEP * level))
    nx, ny = (2 * round(float(count) / 2.0) for count in counts)
    return Resolution(
        nx=nx,
        ny=ny,
        rim_rings=3 if level < 4 else 4,
        inclusion_rings=4 + level,
        inclusion_bubbles=2 + level,
    )


def first_level(geometry: PlateGeometry, tolerance: float) -> int:
    """The level that usually meets a tolerance: a factor of ten per level from 1e-1 on."""
    level = int(np.ceil(-np.log10(max(tolerance, 1e-12)) - 0.01)) - 1
    if not (geometry.rims or geometry.inclusions or geometry.points):
        level -= FEATURELESS
    return int(min(max(level, 0), LEVELS - 1))


def wave_number(geometry: PlateGeometry, omega: float) -> float:
    """Bending wave number (ρhω²/D)^(1/4) of the endless plate, rad/m."""
    return float((geometry.areal_mass * omega**2 / geometry.bending_stiffness) ** 0.25)


def wave_number_of_mode(geometry: PlateGeometry, count: int) -> float:
    """Wave number by which a plate has about `count` modes: Weyl's law, A k²/(4π) = count."""
    area = geometry.width * geometry.length
    return float(np.sqrt(4.0 * np.pi * count / area))
