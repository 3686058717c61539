"""Mirror symmetry of a plate, and loads that are mirror images of one another.

On a plate with its mirrors a load's image has the image of its field: it is solved once and turned
over. Five actuators of which four are images of one cost two solutions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.loads import Load

FloatArray = NDArray[np.float64]

SAME_PLACE = 1e-9
"""Two centres closer than this, in metres, are one place."""


@dataclass(frozen=True)
class Mirrors:
    """Which mirrors map a plate onto itself: x → −x, y → −y."""

    x: bool
    y: bool

    @property
    def images(self) -> list[tuple[float, float]]:
        """Signs of (x, y) of every group element, the identity first."""
        return [
            (sx, sy)
            for sx in ((1.0, -1.0) if self.x else (1.0,))
            for sy in ((1.0, -1.0) if self.y else (1.0,))
        ]

    def shared_with(self, x: FloatArray, y: FloatArray) -> Mirrors:
        """Those of them that the grid x × y has as well."""
        return Mirrors(self.x and is_mirrored(x), self.y and is_mirrored(y))

    def orbit(self, x: float, y: float) -> int:
        """How many different images a place has."""
        doubled_x = self.x and abs(x) > SAME_PLACE
        doubled_y = self.y and abs(y) > SAME_PLACE
        return (2 if doubled_x else 1) * (2 if doubled_y else 1)

    def holds(self, x: FloatArray, y: FloatArray) -> NDArray[np.bool_]:
        """Whether points lie in the fundamental part of the plate (x ≥ 0, y ≥ 0)."""
        inside_x = x >= -SAME_PLACE if self.x else np.ones(x.shape, dtype=bool)
        inside_y = y >= -SAME_PLACE if self.y else np.ones(y.shape, dtype=bool)
        return np.asarray(inside_x & inside_y)


@dataclass(frozen=True)
class Orbits:
    """The loads to solve, and for every load asked for: which of them it is, and its image."""

    distinct: list[Load]
    images: list[tuple[int, tuple[float, float]]]


def orbits_of(loads: Sequence[Load], mirrors: Mirrors) -> Orbits:
    """Sort loads by what mirrors, which plate and grid share, make of them.

    Each is taken to the fundamental part of the plate first, so that a load's field is the same to
    the bit whether it is asked for alone or with its images.
    """
    distinct: list[Load] = []
    images: list[tuple[int, tuple[float, float]]] = []
    for load in loads:
        sign_x = -1.0 if mirrors.x and load.x < -SAME_PLACE else 1.0
        sign_y = -1.0 if mirrors.y and load.y < -SAME_PLACE else 1.0
        is_turned = sign_x < 0.0 or sign_y < 0.0
        own = Load(sign_x * load.x, sign_y * load.y, load.radius) if is_turned else load
        found = (
            k
            for k, other in enumerate(distinct)
            if own.radius == other.radius
            and math.hypot(own.x - other.x, own.y - other.y) < SAME_PLACE
        )
        known = next(found, None)
        images.append((len(distinct) if known is None else known, (sign_x, sign_y)))
        if known is None:
            distinct.append(own)
    return Orbits(distinct, images)


def is_mirrored(points: FloatArray) -> bool:
    """Whether points along a line are their own mirror image about zero."""
    return bool(np.all(np.abs(points + points[::-1]) < SAME_PLACE))
