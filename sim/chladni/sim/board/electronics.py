"""What drives a board and what senses the finger: PWM outputs, touch panel, coils."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from chladni.sim.board.quantity import MM, quantity
from chladni.sim.magnetics.windings import RoundWinding

CLOCK_HZ = 80e6
"""Of the ESP32's LEDC; 2^bits of it are a carrier period."""
NOT_WIRED = 255
"""In place of a GPIO number: the line is not connected."""
PanelKind = Literal["find", "ft6x36", "gt911"]
ChipName = Literal["esp32", "esp32s3"]
DriverKind = Literal["switch", "bridge"]
DRIVER_KINDS: tuple[DriverKind, ...] = ("switch", "bridge")
ONLY_OF: dict[str, tuple[DriverKind, str]] = {
    "diode_v": ("switch", "a bridge's current passes no diode"),
    "least_duty": ("switch", "a bridge's current never stops"),
    "min_on_ns": ("switch", "of a bridge it is lost_ns"),
    "sign_pins": ("bridge", "a switch drives one way"),
    "lost_ns": ("bridge", "of a switch it is min_on_ns"),
    "bridge_ohm": ("bridge", "a switch counts as without resistance"),
}
"""Keys that mean nothing with the other kind of driver, and why."""
MOST_LEAST_DUTY = 0.5
"""Above the middle of all duties nothing swings."""
PanelPlace = Literal["", "on", "in", "beside"]
PANEL_SIDES = ("top", "under")
Area = tuple[tuple[float, float], tuple[float, float]]
"""A rectangle: its ends along x, and along y, m."""
PANEL_KINDS: tuple[PanelKind, ...] = ("find", "ft6x36", "gt911")


@dataclass(frozen=True)
class Electronics:
    """PWM outputs and the limits the firmware keeps. Times in the unit of their name.

    `chip` is what makes the PWM. `pwm_pins` is empty on a board that is only computed. The carrier
    is 80 MHz / 2^pwm_bits (LEDC of either chip). `max_duty` is the ceiling of every duty.
    `supply_limit_ma` holds for what the supply delivers to all coils, as a mean over any 64 ms. A
    coil's rise above the air is that of one thermal resistance and one time constant: 60 K/W and
    30 s are estimates for a coil of 15 mm in still air, 60 K the rise that class A enamel (105 °C)
    leaves at 45 °C.

    `drive` says what stands between a pin and its coil. A "switch" to ground drives the current one
    way, so a wave is a sine on a bias. A pulse shorter than `min_on_ns` does not switch the
    transistor; every wave stays above it, and above `least_duty`, which keeps a coil's current
    flowing through its flyback diode, of which `diode_v` is the drop. A full "bridge" drives the
    current both ways and needs no bias: the PWM pin has the magnitude of the duty, a pin of
    `sign_pins` its sign (empty where `pwm_pins` is). Each pulse loses `lost_ns` to dead time and
    slow edges: 40 ns is an estimate. `bridge_ohm` is the resistance of the two transistors in the
    current's way: 0.28 Ω is typical of a DRV8838 (TI, SLVSBA4).
    """

    pwm_pins: tuple[int, ...] = quantity(
        "pwm_pins", 1.0, 0, 48, count=0, integer=True, default=(), is_written=True
    )
    pwm_bits: int = quantity("pwm_bits", 1.0, 10, 12, integer=True, default=10, is_written=True)
    ramp_ms: float = quantity("ramp_ms", 1.0, 0.5, 1000.0, default=4.0, is_written=True)
    touch_timeout_ms: float = quantity(
        "touch_timeout_ms", 1.0, 30.0, 5000.0, default=100.0, is_written=True
    )
    max_on_s: float = quantity("max_on_s", 1.0, 0.1, 60.0, default=10.0, is_written=True)
    supply_v: float = quantity("supply_v", 1.0, 0.5, 48.0, default=5.0)
    supply_limit_ma: float = quantity("supply_limit_ma", 1.0, 1.0, 20000.0, default=1000.0)
    max_duty: float = quantity("max_duty", 1.0, 0.05, 1.0, default=1.0)
    min_on_ns: float = quantity("min_on_ns", 1.0, 0.0, 5000.0, default=100.0)
    coil_ohm: float = quantity("coil_ohm", 1.0, 0.5, 1e4, default=15.0)
    coil_k_per_w: float = quantity("coil_k_per_w", 1.0, 0.1, 1000.0, default=60.0)
    coil_heating_s: float = quantity("coil_heating_s", 1.0, 0.1, 3600.0, default=30.0)
    coil_limit_k: float = quantity("coil_limit_k", 1.0, 1.0, 300.0, default=60.0)
    diode_v: float = quantity("diode_v", 1.0, 0.0, 5.0, default=0.25)
    least_duty: float = quantity("least_duty", 1.0, 0.0, MOST_LEAST_DUTY, default=0.0)
    chip: ChipName = "esp32"
    drive: DriverKind = "switch"
    sign_pins: tuple[int, ...] = quantity(
        "sign_pins", 1.0, 0, 48, count=0, integer=True, default=()
    )
    lost_ns: float = quantity("lost_ns", 1.0, 0.0, 500.0, default=40.0)
    bridge_ohm: float = quantity("bridge_ohm", 1.0, 0.0, 20.0, default=0.28)

    @property
    def is_bridge(self) -> bool:
        """Whether each coil has a full bridge, which drives its current both ways."""
        return self.drive == "bridge"

    @property
    def driver_ohm(self) -> float:
        """Resistance in a coil's way, besides its own: a switch counts as without."""
        return self.bridge_ohm if self.is_bridge else 0.0

    @property
    def full_current_a(self) -> float:
        """What a coil draws at a duty of 1."""
        return self.supply_v / (self.coil_ohm + self.driver_ohm)

    @property
    def full_heat_w(self) -> float:
        """What it then heats with: all of it but what a bridge takes itself."""
        return self.full_current_a**2 * self.coil_ohm

    @property
    def shortest_on_ns(self) -> float:
        """What no pulse of a wave is shorter than, by switch and diode; 0 of a bridge."""
        if self.is_bridge:
            return 0.0
        return max(self.min_on_ns, self.least_duty * (1 << self.pwm_bits) / CLOCK_HZ * 1e9)


@dataclass(frozen=True)
class Sensing:
    """Coils that measure each other: the GPIO of the chip's converter 1 where they are listened to.

    What chooses a coil, a port expander, is on the panel's bus (docs/hardware.md).
    """

    pin: int = quantity("pin", 1.0, 0, 48, integer=True)


@dataclass(frozen=True)
class Panel:
    """The touch panel over the board. Metres; pixels; GPIO numbers, 255 for a line not wired.

    Seen in the panel's own directions its active area measures `size` and has `pixels`. It is
    mirrored (along its own x) first, then turned by `rotation_deg` (90° takes its +x to the
    board's +y), and its centre put at `offset` from the board's centre.

    `place` says where its electrodes are: "on" the plate, on a layer that bends with it (`film` or
    `glass`, glued over all of it), "in" it, as copper of the sheet itself, or "beside" it, where
    they move nothing; "" where it is not given. The layer's numbers are those of `material` ("pet"
    or "glass" unless named) where they are None. `glue` is a layer without stiffness that does not
    slip.
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
    place: PanelPlace = ""
    side: str = "top"
    film: float = quantity("film_mm", MM, 0.0, 10.0, default=0.0)
    glass: float = quantity("glass_mm", MM, 0.0, 10.0, default=0.0)
    glue: float = quantity("glue_mm", MM, 0.0, 5.0, default=0.0)
    material: str = ""
    youngs_modulus: float | None = quantity("youngs_modulus_gpa", 1e9, 1e-4, 1500.0, default=None)
    poissons_ratio: float | None = quantity("poissons_ratio", 1.0, -0.9, 0.49, default=None)
    density: float | None = quantity("density_kg_m3", 1.0, 1.0, 30000.0, default=None)
    loss_factor: float | None = quantity("loss_factor", 1.0, 0.0, 2.0, default=None)

    @property
    def area(self) -> Area:
        """What it senses, in the board's directions."""
        along_x, along_y = self.size if self.rotation_deg % 180 == 0 else self.size[::-1]
        x, y = self.offset
        return ((x - along_x / 2.0, x + along_x / 2.0), (y - along_y / 2.0, y + along_y / 2.0))

    @property
    def layer_thickness(self) -> float:
        """Of what is glued to the plate, glue aside, m; 0 for nothing."""
        return self.film or self.glass

    @property
    def layer_material(self) -> str:
        """What that is."""
        return self.material or ("glass" if self.glass else "pet")

    @property
    def pins(self) -> dict[str, int]:
        """GPIO numbers by line, as `gpio.pin_fault` takes them."""
        return {
            "sda": self.sda_pin,
            "scl": self.scl_pin,
            "interrupt": self.interrupt_pin,
            "reset": self.reset_pin,
        }

    @property
    def most_fingers(self) -> int:
        """How many it hears of at once."""
        return 2 if self.controller == "ft6x36" else 5


@dataclass(frozen=True)
class Latch:
    """A coil's own resonator (the paper's section II), which the plate's model does not have.

    Attributes
    ----------
    moving_mass
        The magnet with its share of the board, kg.
    resonance_hz
        Of that mass on the latch.
    mechanical_q
        Without what the coil's resistance damps.
    """

    moving_mass: float
    resonance_hz: float
    mechanical_q: float


@dataclass(frozen=True)
class Coil:
    """One actuator: what makes its force, and the latch that it moves on, if any. SI units.

    `rms_voltage` is that of the paper's waves; 1.8 V is 5 V unipolar at full amplitude. The latch's
    three values go together. `motion_acts_back` is false on a board whose coils are to be plain
    forces, as in the paper.
    """

    resistance: float = quantity("resistance_ohm", 1.0, 0.01, 1e5)
    inductance: float = quantity("inductance_mh", 1e-3, 0.0, 1e4)
    force_factor: float = quantity("force_factor_n_per_a", 1.0, 1e-4, 1e4)
    moving_mass: float | None = quantity("moving_mass_g", 1e-3, 1e-3, 1e6, default=None)
    resonance_hz: float | None = quantity("resonance_hz", 1.0, 1.0, 20000.0, default=None)
    mechanical_q: float | None = quantity("mechanical_q", 1.0, 0.5, 1e5, default=None)
    rms_voltage: float = quantity("rms_voltage", 1.0, 1e-3, 1e3, default=1.8, is_written=True)
    motion_acts_back: bool = True

    @property
    def latch(self) -> Latch | None:
        """What the coil moves on, apart from the plate; None where there is none."""
        mass, resonance, quality = self.moving_mass, self.resonance_hz, self.mechanical_q
        if mass is None or resonance is None or quality is None:
            return None
        return Latch(mass, resonance, quality)


@dataclass(frozen=True)
class Winding:
    """How every coil is wound, round and about its magnet's axis. Metres.

    `wire` is the bare copper's diameter, `inner` and `outer` are the winding's. `gap` is from the
    winding's end to the magnet's face, negative where the magnet dips into the bore.
    """

    turns: int = quantity("turns", 1.0, 1, 100_000, integer=True)
    wire: float = quantity("wire_mm", MM, 0.01, 5.0)
    inner: float = quantity("inner_mm", MM, 0.0, 500.0)
    outer: float = quantity("outer_mm", MM, 0.1, 500.0)
    height: float = quantity("height_mm", MM, 0.05, 500.0)
    gap: float = quantity("gap_mm", MM, -500.0, 500.0)

    @property
    def round(self) -> RoundWinding:
        """The winding without its magnet."""
        return RoundWinding(self.turns, self.wire, self.inner, self.outer, self.height)
