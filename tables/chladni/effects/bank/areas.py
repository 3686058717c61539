"""Areas of a board with the effects of what fingers do there, and the bank that keeps both.

An area's effects are named, and the bank knows them by that name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

from chladni.effects.bank.layout import (
    ALONG,
    MAX_AREAS,
    MAX_CORNERS,
    MAX_EFFECTS,
    MAX_EVERY_UM,
    MAX_HYSTERESIS_UM,
    MAX_PLACE_UM,
    NAME_BYTES,
    OCCASIONS,
)
from chladni.sim.errors import ArgumentError

if TYPE_CHECKING:
    from chladni.effects.effect import Effect

Point = tuple[float, float]
MOST_MM = MAX_PLACE_UM / 1e3
LEAST_LEVEL_DB = -60.0
LEAST_UM, MOST_UM = 0.01, 655.35
"""As a bank has it in 16 bits."""
LEAST_MM = 0.5
"""Of a circle's radius, and of a polygon along its longer side."""


@dataclass(frozen=True)
class Everywhere:
    """All places that no other area has."""


@dataclass(frozen=True)
class Circle:
    """Of a radius about a centre, mm from the board's centre."""

    centre_mm: Point
    radius_mm: float

    def __post_init__(self) -> None:
        _check_places((self.centre_mm,))
        if not LEAST_MM <= self.radius_mm <= MOST_MM:
            raise ArgumentError("circle_mm", self.radius_mm, f"a radius of {LEAST_MM} mm or more")


@dataclass(frozen=True)
class Polygon:
    """Corners in order, mm from the board's centre; the last one is joined to the first."""

    corners_mm: tuple[Point, ...]

    def __post_init__(self) -> None:
        if not 3 <= len(self.corners_mm) <= MAX_CORNERS:
            expected = f"3 to {MAX_CORNERS} corners"
            raise ArgumentError("polygon_mm", f"{len(self.corners_mm)} corners", expected)
        _check_places(self.corners_mm)
        x, y = zip(*self.corners_mm, strict=True)
        if max(max(x) - min(x), max(y) - min(y)) < LEAST_MM:
            raise ArgumentError("polygon_mm", "a speck", f"{LEAST_MM} mm at least")
        if (crossing := _crossing(self.corners_mm)) is not None:
            expected = "sides that do not cross"
            raise ArgumentError("polygon_mm", f"sides {crossing[0]} and {crossing[1]}", expected)

    @classmethod
    def rectangle(cls, x0: float, y0: float, x1: float, y1: float) -> Polygon:
        """Between two corners, mm."""
        return cls(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))


Shape = Everywhere | Circle | Polygon


@dataclass(frozen=True)
class Area:
    """A shape, and what plays there.

    Attributes
    ----------
    press, enter, hold, release
        Names of effects: when a finger comes down here; when it comes from another area; while it
        stays; when it leaves the board from here.
    level_db
        Of all of them, against the loudest that a place allows, or against `level_um`.
    level_um
        The most that they move a finger by, peak: as much everywhere, where that is less than the
        place allows and the device's table has responses. None: whatever the place allows.
    every_mm
        `hold` plays once after so much movement; at 0 again and again, by time.
    along
        What movement is measured along: the finger's path, or x or y of the board, where it plays
        at the same places each time.
    """

    name: str
    shape: Shape = field(default_factory=Everywhere)
    press: str | None = None
    enter: str | None = None
    hold: str | None = None
    release: str | None = None
    level_db: float = 0.0
    level_um: float | None = None
    every_mm: float = 0.0
    along: str = "path"

    def __post_init__(self) -> None:
        check_name("area", self.name)
        if not LEAST_LEVEL_DB <= self.level_db <= 0.0:
            raise ArgumentError("level_db", self.level_db, f"{LEAST_LEVEL_DB:g} to 0")
        if self.level_um is not None and not LEAST_UM <= self.level_um <= MOST_UM:
            raise ArgumentError("level_um", self.level_um, f"{LEAST_UM:g} to {MOST_UM:g}")
        most_mm = MAX_EVERY_UM / 1e3
        if self.every_mm != 0.0 and not 0.2 <= self.every_mm <= most_mm:
            raise ArgumentError("every_mm", self.every_mm, f"0, or 0.2 to {most_mm:g}")
        if self.along not in ALONG:
            raise ArgumentError("along", self.along, f"one of {', '.join(ALONG)}")
        if self.along != ALONG[0] and self.every_mm == 0.0:
            raise ArgumentError("along", self.along, "every_mm beside it: how far between two")
        if self.every_mm > 0.0 and self.hold is None:
            raise ArgumentError("every_mm", self.every_mm, "an effect for hold beside it")

    @property
    def effects(self) -> dict[str, str]:
        """Names of its effects, by occasion."""
        own = {occasion: getattr(self, occasion) for occasion in OCCASIONS}
        return {occasion: name for occasion, name in own.items() if name is not None}


@dataclass(frozen=True)
class Bank:
    """What a device plays without a host.

    Attributes
    ----------
    effects
        By name, in their order in the bank.
    areas
        The first that has a finger's place counts, so `Everywhere` comes last.
    hysteresis_mm
        A finger leaves its area so far outside of it.
    """

    name: str
    effects: Mapping[str, Effect]
    areas: tuple[Area, ...] = ()
    hysteresis_mm: float = 1.0

    def __post_init__(self) -> None:
        check_name("bank", self.name)
        most_mm = MAX_HYSTERESIS_UM / 1e3
        if not 0.0 <= self.hysteresis_mm <= most_mm:
            raise ArgumentError("hysteresis_mm", self.hysteresis_mm, f"0 to {most_mm:g}")
        _check_number("effects", len(self.effects), MAX_EFFECTS)
        _check_number("areas", len(self.areas), MAX_AREAS)
        for name in self.effects:
            check_name("effect", name)
        for k, area in enumerate(self.areas):
            if area.name in (other.name for other in self.areas[:k]):
                raise ArgumentError("area", area.name, "names that differ")
            for occasion, effect in area.effects.items():
                if effect not in self.effects:
                    place = f"area {area.name}.{occasion}"
                    raise ArgumentError(place, effect, f"one of {', '.join(self.effects)}")
            if isinstance(area.shape, Everywhere) and area is not self.areas[-1]:
                raise ArgumentError(f"area {area.name}", "no shape", "a shape, or the last place")

    def check_on(self, width_mm: float, length_mm: float) -> None:
        """Raise `ArgumentError` for an area that lies off a board of this size, if only in part."""
        for area in self.areas:
            for x, y in reach_mm(area.shape):
                if abs(x) > 0.5 * width_mm + 1e-6 or abs(y) > 0.5 * length_mm + 1e-6:
                    expected = f"within the board, {width_mm:g} × {length_mm:g} mm about its centre"
                    hint = "give it areas of this board; of a shipped bank, in a copy of its .toml"
                    raise ArgumentError(
                        f"area {area.name}", f"{x:g}, {y:g} mm", expected, hint=hint
                    )


def reach_mm(shape: Shape) -> tuple[Point, ...]:
    """Corners of the box about a shape, or none of `Everywhere`."""
    if isinstance(shape, Circle):
        (x, y), r = shape.centre_mm, shape.radius_mm
        return ((x - r, y - r), (x + r, y + r))
    if isinstance(shape, Polygon):
        across, up = zip(*shape.corners_mm, strict=True)
        return ((min(across), min(up)), (max(across), max(up)))
    return ()


def check_name(what: str, name: str) -> None:
    """Raise `ArgumentError` unless a device can keep a name."""
    if not (name.isascii() and name.isprintable() and 0 < len(name) < NAME_BYTES):
        expected = f"1 to {NAME_BYTES - 1} printable ASCII letters"
        raise ArgumentError(f"{what} name", name[:40], expected)


def level_of(level_db: float) -> float:
    """A share of 1."""
    return float(10.0 ** (level_db / 20.0))


def _check_number(what: str, number: int, most: int) -> None:
    if number > most:
        raise ArgumentError(what, number, f"{most} at most")


def _check_places(points: tuple[Point, ...]) -> None:
    for point in points:
        for value in point:
            if not (math.isfinite(value) and abs(value) <= MOST_MM):
                raise ArgumentError("place", f"{value:g} mm", f"-{MOST_MM:g} to {MOST_MM:g} mm")


def _crossing(corners: tuple[Point, ...]) -> tuple[int, int] | None:
    """Two sides that have a point in common though they are no neighbours, from 0."""
    sides = list(zip(corners, corners[1:] + corners[:1], strict=True))
    for k, one in enumerate(sides):
        for m in range(k + 1, len(sides)):
            if m == k + 1 or (k == 0 and m == len(sides) - 1):
                # Neighbours cross where one lies on the other.
                if _folds_back(one, sides[m]) or _folds_back(sides[m], one):
                    return k, m
            elif _do_cross(one, sides[m]):
                return k, m
    return None


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _folds_back(one: tuple[Point, Point], following: tuple[Point, Point]) -> bool:
    (a, b), (c, d) = one, following
    if b != c:
        return False
    ahead = (b[0] - a[0]) * (d[0] - c[0]) + (b[1] - a[1]) * (d[1] - c[1])
    return a == b or (_turn(a, b, d) == 0.0 and ahead < 0.0)


def _do_cross(one: tuple[Point, Point], other: tuple[Point, Point]) -> bool:
    (a, b), (c, d) = one, other
    if not all(
        min(a[k], b[k]) <= max(c[k], d[k]) and min(c[k], d[k]) <= max(a[k], b[k]) for k in (0, 1)
    ):
        return False
    return _turn(a, b, c) * _turn(a, b, d) <= 0.0 and _turn(c, d, a) * _turn(c, d, b) <= 0.0


assert {*OCCASIONS} <= {one.name for one in fields(Area)}


def level_within(level_db: float) -> float:
    """A level from 0 to 1 by its dB, which are 0 or less."""
    if not level_db <= 0.0:
        raise ArgumentError("level_db", level_db, "0 or less")
    return level_of(level_db)
