"""A haptic board as data: plate, screws, magnets, actuators, and what drives them."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.quantity import quantities, quantity
from chladni.sim.ritz.geometry import EdgeKind

FloatArray = NDArray[np.float64]

MM = 1e-3
ScrewSupport = Literal["clamped", "pinned", "sprung"]
NOT_WIRED = 255
"""In place of a GPIO number: the line is not connected."""
PanelKind = Literal["find", "ft6x36", "gt911"]
PANEL_KINDS: tuple[PanelKind, ...] = ("find", "ft6x36", "gt911")
SCREW_SUPPORTS: tuple[ScrewSupport, ...] = ("clamped", "pinned", "sprung")
NAME_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,15}")
"""A board's name goes into 16 bytes of the table, with an ending zero."""
SAME_PLACE = 1e-6
"""Two actuators closer than this, in metres, are at one place: drives cannot tell them apart."""


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


@dataclass(frozen=True)
class Plate:
    """A thin rectangular plate of one material. SI units.

    `size` is (along x, along y); `loss_factor` is η in D(1 + iη).
    """

    size: tuple[float, float] = quantity("size_mm", MM, 1.0, 5000.0, count=2)
    thickness: float = quantity("thickness_mm", MM, 0.01, 100.0)
    youngs_modulus: float = quantity("youngs_modulus_gpa", 1e9, 1e-4, 1500.0)
    poissons_ratio: float = quantity("poissons_ratio", 1.0, -0.9, 0.49)
    density: float = quantity("density_kg_m3", 1.0, 1.0, 30000.0)
    loss_factor: float = quantity("loss_factor", 1.0, 0.0, 2.0)
    edges: Edges = Edges()
    corner_radius: float = quantity("corner_radius_mm", MM, 0.0, 2500.0, default=0.0)

    @property
    def bending_stiffness(self) -> float:
        """D = Eh³/(12(1 − ν²)), N·m."""
        return self.youngs_modulus * self.thickness**3 / (12.0 * (1.0 - self.poissons_ratio**2))

    @property
    def areal_mass(self) -> float:
        """ρh, kg/m²."""
        return self.density * self.thickness

    def wavelength(self, frequency_hz: float) -> float:
        """Bending wavelength λ = 2π (D/ρhω²)^(1/4) of the endless plate, m."""
        omega = 2.0 * np.pi * frequency_hz
        return float(2.0 * np.pi * (self.bending_stiffness / self.areal_mass / omega**2) ** 0.25)


@dataclass(frozen=True)
class Screw:
    """Holds the plate on a rim. Metres, N/m, N·m/rad.

    `clamped` holds deflection and slope on the circle, `pinned` the deflection alone, `sprung`
    neither: there `stiffness` (in all) acts against deflection and `rotational_stiffness` (in all)
    against the slope.
    """

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    radius: float = quantity("radius_mm", MM, 0.0, 100.0)
    support: ScrewSupport = "clamped"
    stiffness: float = quantity("stiffness_n_per_mm", 1e3, 0.0, 1e9, default=0.0)
    rotational_stiffness: float = quantity("rotational_n_mm_per_rad", MM, 0.0, 1e12, default=0.0)


@dataclass(frozen=True)
class Pin:
    """Holds one point of the plate: no deflection. It cannot hold a slope. Metres."""

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)


@dataclass(frozen=True)
class Spring:
    """An elastic support of one point. Metres, N/m."""

    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)
    stiffness: float = quantity("stiffness_n_per_mm", 1e3, 0.0, 1e9)
    rotational_stiffness: float = quantity("rotational_n_mm_per_rad", MM, 0.0, 1e12, default=0.0)


@dataclass(frozen=True)
class Mass:
    """Something that rides on the plate: a point (radius 0), or a glued disc. SI units.

    A disc's rotary inertia about its own middle is that of a cylinder of the given height;
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
    """The disc glued to the plate under every actuator. SI units."""

    radius: float = quantity("radius_mm", MM, 0.05, 500.0)
    height: float = quantity("height_mm", MM, 0.0, 500.0)
    density: float = quantity("density_kg_m3", 1.0, 0.0, 30000.0)
    stiffness_ratio: float = quantity("stiffness_ratio", 1.0, 1.0, 1e6)

    @property
    def areal_mass(self) -> float:
        """Mass per area, kg/m²."""
        return self.density * self.height


@dataclass(frozen=True)
class Actuator:
    """One coil, by name and place (m)."""

    name: str
    at: tuple[float, float] = quantity("at_mm", MM, -5000.0, 5000.0, count=2)


@dataclass(frozen=True)
class Drive:
    """What the table is made for: a frequency, and the largest gain of an actuator."""

    frequency_hz: float = quantity("frequency_hz", 1.0, 1.0, 20000.0)
    max_gain: float = quantity("max_gain", 1.0, 1e-6, 1e6)


@dataclass(frozen=True)
class Image:
    """Points of the energy image along x and y, from edge to edge."""

    points: tuple[int, int] = quantity("points", 1.0, 7, 5000, count=2, integer=True)


@dataclass(frozen=True)
class Regions:
    """The places a table tells apart: cells of about `pitch`, m."""

    pitch: float = quantity("pitch_mm", MM, 0.5, 500.0)


@dataclass(frozen=True)
class Electronics:
    """PWM outputs and the limits the firmware keeps. Times in the unit of their name.

    `pwm_pins` is empty on a board that is only computed. The carrier is 80 MHz / 2^pwm_bits
    (ESP32 LEDC). `max_duty` is the ceiling of every duty. A pulse shorter than `min_on_ns` does not
    switch the transistor; every wave stays above it. `supply_limit_ma` holds for the sum of the
    channels' mean currents. A coil's rise above the air is that of one thermal resistance and one
    time constant: 60 K/W and 30 s are estimates for a coil of 15 mm in still air, 60 K the rise
    that class A enamel (105 °C) leaves at 45 °C.
    """

    pwm_pins: tuple[int, ...] = quantity("pwm_pins", 1.0, 0, 48, count=0, integer=True)
    pwm_bits: int = quantity("pwm_bits", 1.0, 10, 12, integer=True)
    ramp_ms: float = quantity("ramp_ms", 1.0, 0.5, 1000.0)
    touch_timeout_ms: float = quantity("touch_timeout_ms", 1.0, 30.0, 5000.0)
    max_on_s: float = quantity("max_on_s", 1.0, 0.1, 60.0)
    supply_v: float = quantity("supply_v", 1.0, 0.5, 48.0, default=5.0)
    supply_limit_ma: float = quantity("supply_limit_ma", 1.0, 1.0, 20000.0, default=1000.0)
    max_duty: float = quantity("max_duty", 1.0, 0.05, 1.0, default=1.0)
    min_on_ns: float = quantity("min_on_ns", 1.0, 0.0, 5000.0, default=100.0)
    coil_ohm: float = quantity("coil_ohm", 1.0, 0.5, 1e4, default=15.0)
    coil_k_per_w: float = quantity("coil_k_per_w", 1.0, 0.1, 1000.0, default=60.0)
    coil_heating_s: float = quantity("coil_heating_s", 1.0, 0.1, 3600.0, default=30.0)
    coil_limit_k: float = quantity("coil_limit_k", 1.0, 1.0, 300.0, default=60.0)


@dataclass(frozen=True)
class Panel:
    """The touch panel over the board. Metres; pixels; GPIO numbers, 255 for a line not wired.

    Seen in the panel's own directions its active area measures `size` and has `pixels`. It is
    mirrored (along its own x) first, then turned by `rotation_deg` (90° takes its +x to the
    board's +y), and its centre put at `offset` from the board's centre.
    """

    pixels: tuple[int, int] = quantity("pixels", 1.0, 16, 4096, count=2, integer=True)
    size: tuple[float, float] = quantity("size_mm", MM, 1.0, 500.0, count=2)
    controller: PanelKind = "find"
    offset: tuple[float, float] = quantity(
        "offset_mm", MM, -500.0, 500.0, count=2, default=(0.0, 0.0)
    )
    rotation_deg: int = quantity("rotation_deg", 1.0, 0, 270, integer=True, default=0)
    mirrored: bool = False
    report_ms: int = quantity("report_ms", 1.0, 2, 100, integer=True, default=10)
    sda_pin: int = quantity("sda_pin", 1.0, 0, 48, integer=True, default=21)
    scl_pin: int = quantity("scl_pin", 1.0, 0, 48, integer=True, default=22)
    interrupt_pin: int = quantity("interrupt_pin", 1.0, 0, 255, integer=True, default=255)
    reset_pin: int = quantity("reset_pin", 1.0, 0, 255, integer=True, default=255)


@dataclass(frozen=True)
class Coil:
    """One actuator as an electro-mechanical resonator (the paper's section II). SI units.

    The moving part is the magnet with its share of the board on the latch; `mechanical_q` leaves
    out what the coil's resistance damps.
    """

    resistance: float = quantity("resistance_ohm", 1.0, 0.01, 1e5)
    inductance: float = quantity("inductance_mh", 1e-3, 0.0, 1e4)
    force_factor: float = quantity("force_factor_n_per_a", 1.0, 1e-4, 1e4)
    moving_mass: float = quantity("moving_mass_g", 1e-3, 1e-3, 1e6)
    resonance_hz: float = quantity("resonance_hz", 1.0, 1.0, 20000.0)
    mechanical_q: float = quantity("mechanical_q", 1.0, 0.5, 1e5)
    rms_voltage: float = quantity("rms_voltage", 1.0, 1e-3, 1e3)


@dataclass(frozen=True)
class Board:
    """Everything the chain needs to know about a board; validated when made.

    Raises
    ------
    InputError
        A value out of range, an actuator or screw off the plate, two actuators at one place, …
    """

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
    panel: Panel | None = None

    def __post_init__(self) -> None:
        # Here, because the checks need the classes above.
        from chladni.sim.board.checks import check_board  # noqa: PLC0415

        check_board(self)

    @property
    def x(self) -> FloatArray:
        """Image points along x, m."""
        return _axis(self.plate.size[0], self.image.points[0])

    @property
    def y(self) -> FloatArray:
        """Image points along y, m."""
        return _axis(self.plate.size[1], self.image.points[1])

    def fingerprint(self) -> int:
        """64 bits of the SHA-256 of what drives depend on: plate, actuators, frequency, regions."""
        physical = {
            key: value
            for key, value in to_document(self).items()
            if key not in ("name", "electronics", "image", "coil", "panel")
        }
        text = json.dumps(physical, sort_keys=True, separators=(",", ":"))
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")

    def contains(self, x: float, y: float) -> bool:
        """Whether a place (m) lies on the board, its edges included."""
        # The slack lets a target typed as the very edge, 35.75 mm of 71.5, count as on the board.
        half_x, half_y = self.plate.size[0] / 2.0 + 1e-9, self.plate.size[1] / 2.0 + 1e-9
        return abs(x) <= half_x and abs(y) <= half_y


def _axis(length: float, count: int) -> FloatArray:
    """`count` points from −length/2 to length/2, exactly symmetric."""
    half = (np.arange(count) - (count - 1) / 2.0) / (count - 1)
    return np.asarray(half * length)


FEATURES = ("screws", "pins", "springs", "masses", "holes")
"""Blocks a board may have any number of, or none."""


def to_document(board: Board) -> dict[str, Any]:
    """A board as the document its file would hold, in the file's units."""

    def table(part: Any) -> dict[str, Any]:
        specs = quantities(part)
        result = {}
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            spec = specs.get(field.name)
            if spec is None and dataclasses.is_dataclass(value):
                result[field.name] = table(value)
            elif field.default is dataclasses.MISSING or value != field.default:
                result[spec.key if spec else field.name] = spec.from_si(value) if spec else value
        return result

    document: dict[str, Any] = {"name": board.name, "plate": table(board.plate)}
    for section in FEATURES:
        if getattr(board, section):
            document[section] = [table(feature) for feature in getattr(board, section)]
    if board.magnet:
        document["magnet"] = table(board.magnet)
    for section in ("coil", "panel"):
        if getattr(board, section):
            document[section] = table(getattr(board, section))
    document["actuators"] = [table(actuator) for actuator in board.actuators]
    for section in ("drive", "image", "regions", "electronics"):
        document[section] = table(getattr(board, section))
    return document
