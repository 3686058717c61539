"""A plate that is made up: each coil moves a bump of it, which is smooth and known everywhere."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from chladni.drives.fingers.responses import Responses
from chladni.drives.problem.region_grid import RegionGrid
from chladni.tables.mirror_symmetry import NO_MIRRORS
from chladni.tables.several_fingers.section import section_of
from chladni.tables.stored_regions import StoredRegions
from chladni.tables.table import Limits, ReckonedFinger, Table
from made_up import LIMITS

SQUARE = [(-0.02, -0.03), (0.02, -0.03), (-0.02, 0.03), (0.02, 0.03)]
QUINCUNX = [*SQUARE, (0.0, 0.0)]
FINGER = ReckonedFinger(300_000, 400_000, complex(np.complex64(2000.0 + 1500.0j)))
"""0.3 N a coil, 0.4 µm that are just felt, a finger that presses."""


def plate_of_bumps(coils: Sequence[tuple[float, float]] = SQUARE) -> Responses:
    """60 by 100 mm, nodes 1 mm apart, a bump of 30 mm at each coil's place, m."""
    x, y = np.linspace(-0.03, 0.03, 61), np.linspace(-0.05, 0.05, 101)
    bumps = [
        (1.0 + 0.1j) * 1e-5 * np.exp(-((x[:, None] - a) ** 2 + (y - b) ** 2) / 0.03**2)
        for a, b in coils
    ]
    own = (1e-4 + 2e-5j) * (1.0 + (x[:, None] / 0.03) ** 2 + (y / 0.05) ** 2)
    count = range(len(coils))
    coupling = np.array([[1e3 / (1 + abs(a - b)) for a in count] for b in count])
    values = np.array(bumps, dtype=np.complex128)
    return Responses(
        x, y, values, x, y, own.astype(np.complex128), coupling.astype(np.complex128), 160.0
    )


def responses_table(
    coils: Sequence[tuple[float, float]] = QUINCUNX,
    *,
    limits: Limits = LIMITS,
    finger: ReckonedFinger = FINGER,
) -> Table:
    """Its responses at 3 mm, 16 bits, and nothing else."""
    regions = StoredRegions(RegionGrid(20, 33, 60_000, 100_000), NO_MIRRORS)
    section = section_of(plate_of_bumps(coils), finger, regions, 16)
    return Table("t", 1, regions.grid, limits, (), NO_MIRRORS, 16, (section,))
