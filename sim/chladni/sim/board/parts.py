"""What a board is made of: its plate, what holds it, what rides on it, what is computed of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from chladni.sim.board.electronics import Coil, Electronics, Panel, Sensing, Winding
from chladni.sim.board.fingers import Active, Finger, Focus, SeveralFingers
from chladni.sim.board.foundation import CutOut, Foundation
from chladni.sim.board.quantity import MM, quantity

EdgeKind = Literal["free", "simply supported", "clamped"]
EDGE_KINDS: tuple[EdgeKind, ...] = ("free", "simply supported", "clamped")
ScrewSupport = Literal["clamped", "pinned", "sprung"]
SCREW_SUPPORTS: tuple[ScrewSupport, ...] = ("clamped", "pinned", "sprung")
FEATURES = ("screws", "pins", "springs", "masses", "holes")
"""Blocks a board may have any number of, or none."""


@dataclass(frozen=True)
class Edges:
    """How each edge is held; left and right are the ends of x, bottom and top those of y."""

    left: EdgeKind = "free"
    right: EdgeKind = "free"
    bottom: EdgeKind = "free"
    top: EdgeKind = "free"

    def kinds(self) -> dict[str, EdgeKind]:
        """Edge name to support."""
        return {"left": self.left, "right": self.right, "bottom": self.bottom, "top": self.top}

    def are_all(self, kind: EdgeKind) -> bool:
        """Whether every edge is held in this way."""
        return set(self.kinds().values()) == {kind}

    def of(self, axis: int, normal: float) -> EdgeKind:
        """The edge whose outward normal is `normal` (±1) along `axis` (0 is x)."""
        pairs = ((self.left, self.right), (self.bottom, self.top))
        return pairs[axis][0 if normal < 0 else 1]


@dataclass(frozen=True)
class Plate:
    """A thin rectangular plate of one material. SI units.

    `size` is (along x, along y); `loss_factor` is η in D(1 + iη); `material` is a name for drawings
    and parts lists.
    """

    size: tuple[float, float] = quantity("size_mm", MM, 1.0, 5000.0, count=2)
    thickness: float = quantity("thickness_mm", MM, 0.01, 100.0)
    youngs_modulus: float = quantity("youngs_modulus_gpa", 1e9, 1e-4, 1500.0)
    poissons_ratio: float = quantity("poissons_ratio", 1.0, -0.9, 0.49)
    density: float = quantity("density_kg_m3", 1.0, 100.0, 30000.0)
    loss_factor: float = quantity("loss_factor", 1.0, 0.0, 2.0, default=0.02, is_written=True)
    edges: Edges = Edges()
    corner_radius: float = quantity("corner_radius_mm", MM, 0.0, 2500.0, default=0.0)
    material: str = ""

    @property
    def bending_stiffness(self) -> float:
        """D = Eh³/(12(1 − ν²)), N·m."""
        return self.youngs_modulus * self.thickness**3 / (12.0 * (1.0 - self.poissons_ratio**2))

    @property
    def areal_mass(self) -> float:
        """ρh, kg/m²."""
        return self.density * self.thickness

    @property
    def area(self) -> float:
        """Inside its outline, holes not taken off, m²."""
        return math.prod(self.size) - (4.0 - math.pi) * self.corner_radius**2


@dataclass(frozen=True)
class Screw:
    """Holds the plate on a rim. Metres, N/m, N·m/rad.

    `clamped` holds deflection and slope on the circle, `pinned` the deflection alone, `sprung`
    neither: there `stiffness` (in all) acts against deflection and `rotational_stiffness` (in all)
    against the slope. Springs have a loss factor of their own, or the plate's. `part` names a
    grommet (`catalogue.GROMMETS`).
    """

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    radius: float = quantity("radius_mm", MM, 0.0, 100.0, default=1.5e-3, is_written=True)
    support: ScrewSupport = "clamped"
    stiffness: float = quantity("stiffness_n_per_mm", 1e3, 0.0, 1e9, default=0.0)
    rotational_stiffness: float = quantity("rotational_n_mm_per_rad", MM, 0.0, 1e12, default=0.0)
    loss_factor: float | None = quantity("loss_factor", 1.0, 0.0, 2.0, default=None)
    part: str = ""


@dataclass(frozen=True)
class Pin:
    """Holds one point of the plate: no deflection. It cannot hold a slope. Metres."""

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)


@dataclass(frozen=True)
class Spring:
    """An elastic support of one point. Metres, N/m.

    It has a loss factor of its own, or the plate's. `part` names a foot (`catalogue.FEET`).
    """

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    stiffness: float = quantity("stiffness_n_per_mm", 1e3, 0.0, 1e9)
    rotational_stiffness: float = quantity("rotational_n_mm_per_rad", MM, 0.0, 1e12, default=0.0)
    loss_factor: float | None = quantity("loss_factor", 1.0, 0.0, 2.0, default=None)
    part: str = ""


@dataclass(frozen=True)
class Mass:
    """Something that rides on the plate: a point (radius 0), or a glued disc. SI units.

    A disc's rotary inertia is that of a cylinder of the given height about its glued face;
    `stiffness_ratio` is the bending stiffness under it over the plate's own.
    """

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    mass: float = quantity("mass_g", 1e-3, 0.0, 1e6)
    radius: float = quantity("radius_mm", MM, 0.0, 500.0, default=0.0)
    height: float = quantity("height_mm", MM, 0.0, 500.0, default=0.0)
    stiffness_ratio: float = quantity("stiffness_ratio", 1.0, 1.0, 1e6, default=1.0)


@dataclass(frozen=True)
class Hole:
    """A circular hole with a free rim. Metres."""

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    radius: float = quantity("radius_mm", MM, 0.05, 500.0)


@dataclass(frozen=True)
class Magnet:
    """The disc glued to the plate under every actuator. SI units; Br in T, 0 where unknown."""

    radius: float = quantity("radius_mm", MM, 0.05, 500.0)
    height: float = quantity("height_mm", MM, 0.0, 500.0)
    density: float = quantity("density_kg_m3", 1.0, 0.0, 30000.0, default=7500.0, is_written=True)
    stiffness_ratio: float = quantity(
        "stiffness_ratio", 1.0, 1.0, 1e6, default=1000.0, is_written=True
    )
    remanence: float = quantity("remanence_t", 1.0, 0.0, 2.0, default=0.0)

    @property
    def areal_mass(self) -> float:
        """Mass per area, kg/m²."""
        return self.density * self.height


@dataclass(frozen=True)
class Actuator:
    """One coil, by name and place (m), and how it differs from the others once it is built.

    `polarity` is −1 for one that was wound or connected the other way. `trim_db` is what its drive
    needs more than drawn: 1.5 for a coil that came out 1.5 dB weak. The device makes up for both,
    so tables do not depend on them. One that `is_dead` makes no force: no drive has it play.
    """

    name: str
    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    polarity: int = quantity("polarity", 1.0, -1, 1, integer=True, default=1)
    trim_db: float = quantity("trim_db", 1.0, -12.0, 12.0, default=0.0)
    is_dead: bool = False

    @property
    def strength(self) -> float:
        """Force per newton that it is drawn with, by polarity and trim."""
        return float(self.polarity * 10.0 ** (-self.trim_db / 20.0))


@dataclass(frozen=True)
class Drive:
    """What the table is made for: a frequency, and the largest gain of an actuator."""

    frequency_hz: float = quantity(
        "frequency_hz", 1.0, 1.0, 20000.0, default=160.0, is_written=True
    )
    max_gain: float = quantity("max_gain", 1.0, 1e-6, 1e6, default=10.0, is_written=True)


POINT_MM = 0.5
"""Between image points: a finger covers 450 of them."""
LEAST_POINTS, MOST_POINTS = 7, 401
"""Along a side of such an image; a larger board has them farther apart."""


@dataclass(frozen=True)
class Image:
    """Points of the energy image along x and y, from edge to edge."""

    points: tuple[int, int] = quantity("points", 1.0, 7, 5000, count=2, integer=True)

    @classmethod
    def usual(cls, sides_mm: Sequence[float]) -> Image:
        """Where a board file does not say: `POINT_MM` apart, and no more than `MOST_POINTS`."""
        step = max(POINT_MM, max(sides_mm) / (MOST_POINTS - 1))
        along_x, along_y = (max(round(side / step) + 1, LEAST_POINTS) for side in sides_mm)
        return cls((along_x, along_y))


@dataclass(frozen=True)
class Regions:
    """The places a table tells apart: cells of about `pitch`, m.

    A focus changes over millimetres: on a strip of five coils tables of 3 mm keep 18.8 dB from
    20 mm on at nine of ten places, tables of 5 mm 11.6.
    """

    pitch: float = quantity("pitch_mm", MM, 0.5, 500.0, default=3e-3, is_written=True)


@dataclass(frozen=True)
class MeasuredValue:
    """One value and its interval of 95 %, over the drawn ones; its origin, if not the board's."""

    name: str
    ratio: float = quantity("ratio", 1.0, 1e-6, 1e6)
    low: float = quantity("low", 1.0, 0.0, 1e6)
    high: float = quantity("high", 1.0, 0.0, 1e6)
    by: str | None = None
    date: str | None = None


@dataclass(frozen=True)
class Isolation:
    """How much less others get of a finger's signal: medians over places, dB.

    Attributes
    ----------
    fingers_2_db
        Of two fingers that press.
    second_finger_20mm_db
        Of one, from 20 mm on; of boards that are made to focus.
    """

    fingers_2_db: float = quantity("fingers_2_db", 1.0, -300.0, 300.0)
    second_finger_20mm_db: float | None = quantity(
        "second_finger_20mm_db", 1.0, -300.0, 300.0, default=None
    )


@dataclass(frozen=True)
class Measured:
    """Where a board's values come from, if they were measured.

    Attributes
    ----------
    by
        What they were measured with, in words.
    date
        As 2026-11-26.
    values
        Those that the measurement tells; the others are as drawn.
    before, after
        With drives of the board as it was drawn, and of this one; both or neither.
    """

    by: str
    date: str
    values: tuple[MeasuredValue, ...] = ()
    before: Isolation | None = None
    after: Isolation | None = None


@dataclass(frozen=True)
class BoardParts:
    """Everything that a board file holds, as it stands there: not yet checked as a whole."""

    name: str
    plate: Plate
    screws: tuple[Screw, ...]
    magnet: Magnet | None
    actuators: tuple[Actuator, ...]
    drive: Drive
    image: Image
    regions: Regions
    electronics: Electronics
    pins: tuple[Pin, ...] = ()
    springs: tuple[Spring, ...] = ()
    masses: tuple[Mass, ...] = ()
    holes: tuple[Hole, ...] = ()
    coil: Coil | None = None
    winding: Winding | None = None
    panel: Panel | None = None
    sensing: Sensing | None = None
    foundation: Foundation | None = None
    finger: Finger | None = None
    focus: Focus | None = None
    active: Active | None = None
    fingers: SeveralFingers | None = None
    measured: Measured | None = None

    def contains(self, x: float, y: float) -> bool:
        """Whether a place (m) lies on the board, its edges included."""
        # The slack lets a target typed as the very edge, 35.75 mm of 71.5, count as on the board.
        half_x, half_y = self.plate.size[0] / 2.0 + 1e-9, self.plate.size[1] / 2.0 + 1e-9
        return abs(x) <= half_x and abs(y) <= half_y

    @property
    def all_cut_outs(self) -> list[CutOut]:
        """Holes in the foundation: those of the board file, and one round every actuator."""
        if self.foundation is None:
            return []
        radius = self.foundation.coil_cut_out
        round_coils = [CutOut(a.at, radius) for a in self.actuators] if radius else []
        return [*self.foundation.cut_outs, *round_coils]

    @property
    def below_plate(self) -> float:
        """How far coils reach below the plate, m: magnet, gap and winding; 0 if one is unknown."""
        if self.magnet is None or self.winding is None:
            return 0.0
        return self.magnet.height + self.winding.gap + self.winding.height

    @property
    def coils_in_foam(self) -> float:
        """How far coils, under the magnets, reach into foam whose holes are too narrow, m."""
        if self.foundation is None or self.magnet is None or self.winding is None:
            return 0.0
        below = self.magnet.height + self.winding.gap
        has_room = 2.0 * self.foundation.coil_cut_out >= self.winding.outer
        return 0.0 if has_room else max(0.0, self.foundation.thickness - below)

    @property
    def foundation_strips(self) -> tuple[tuple[float, float, float, float], ...]:
        """Rectangles (x from, x to, y from, y to), m, of foundation; none where all is."""
        if self.foundation is None or self.foundation.strips.is_none:
            return ()
        own = self.foundation.strips
        half_x, half_y = (side / 2.0 for side in self.plate.size)
        left, right = -half_x + own.left, half_x - own.right
        every = (
            (-half_x, left, -half_y, half_y),
            (right, half_x, -half_y, half_y),
            (left, right, -half_y, -half_y + own.bottom),
            (left, right, half_y - own.top, half_y),
        )
        return tuple(one for one in every if one[1] > one[0] and one[3] > one[2])
