"""What a design's coils are kept out of: rectangles of a plate, and its feet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from chladni.sim.board.catalogue import FEET
from chladni.sim.board.quantity import MM, in_mm, quantity
from chladni.sim.errors import InputError


@dataclass(frozen=True)
class KeepOut:
    """A rectangle that no coil's centre may lie in, m."""

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    size: tuple[float, float] = quantity("size_mm", MM, 0.0, 5000.0, count=2)

    def depth(self, place: tuple[float, float]) -> float:
        """How far a place lies within, m; 0 outside."""
        own = [
            side / 2.0 - abs(along - middle)
            for along, middle, side in zip(place, self.at, self.size, strict=True)
        ]
        return max(min(own), 0.0)


@dataclass(frozen=True)
class KeptFoot:
    """A foot of a known size, and how far from its middle a coil's has to be, m."""

    at: tuple[float, float]
    apart: float

    def depth(self, place: tuple[float, float]) -> float:
        """How far a place lies within, m; 0 outside."""
        far = math.hypot(place[0] - self.at[0], place[1] - self.at[1])
        return max(self.apart - far, 0.0)


def kept_feet(document: dict[str, Any]) -> list[KeptFoot]:
    """Of a board's document: a foot's radius and that of a magnet or winding, the wider one."""
    winding, magnet = document.get("winding", {}), document.get("magnet", {})
    coil_mm = max(winding.get("outer_mm", 0.0) / 2.0, magnet.get("radius_mm", 0.0))
    return [
        KeptFoot(
            (MM * own["at_mm"][0], MM * own["at_mm"][1]),
            MM * (FEET[own["part"]].outer / 2.0 + coil_mm),
        )
        for own in document.get("springs", [])
        if coil_mm and own.get("part") in FEET
    ]


def check_keep_outs(areas: Sequence[KeepOut], sides: Sequence[float]) -> None:
    """Refuse a rectangle of which nothing lies on the plate, whose sides are given in m.

    Raises
    ------
    InputError
        Names the first.
    """
    half_x, half_y = (side / 2.0 for side in sides)
    for index, area in enumerate(areas):
        x, y = (abs(at) - side / 2.0 for at, side in zip(area.at, area.size, strict=True))
        if x >= half_x or y >= half_y:
            raise InputError(
                f"design.keep_out[{index}].at_mm",
                in_mm(area.at),
                "a rectangle that lies on the plate, or a part of it: "
                f"|x| up to {half_x / MM:g}, |y| up to {half_y / MM:g}",
                hint="it is its middle, from the plate's middle",
            )
