"""Loads that are mirror images of one another: solved once, their fields turned over.

On a plate with its mirrors a load's image has the image of its field. Five actuators of which four
are images of one cost two solutions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.loads import Load
from chladni.sim.ritz.grid import is_mirrored
from chladni.sim.ritz.symmetry import SAME_PLACE, Mirrors

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Orbits:
    """The loads to solve, and for every load asked for: which of them it is, and its image."""

    distinct: list[Load]
    images: list[tuple[int, tuple[float, float]]]

    def unfold(self, fields: ComplexArray) -> ComplexArray:
        """Fields of every load from those of the distinct ones, on a grid with the mirrors."""
        if len(self.distinct) == len(self.images):
            return fields
        return np.stack([fields[k, :: int(sx), :: int(sy)] for k, (sx, sy) in self.images])


def orbits_of(loads: Sequence[Load], mirrors: Mirrors, x: FloatArray, y: FloatArray) -> Orbits:
    """Sort loads by what the plate's mirrors make of them, as far as the grid x × y shares them."""
    shared = Mirrors(mirrors.x and is_mirrored(x), mirrors.y and is_mirrored(y))
    distinct: list[Load] = []
    images: list[tuple[int, tuple[float, float]]] = []
    for load in loads:
        found = (
            (k, image)
            for k, other in enumerate(distinct)
            for image in shared.images
            if load.radius == other.radius
            and np.hypot(image[0] * other.x - load.x, image[1] * other.y - load.y) < SAME_PLACE
        )
        known = next(found, None)
        images.append(known or (len(distinct), (1.0, 1.0)))
        if known is None:
            distinct.append(load)
    return Orbits(distinct, images)
