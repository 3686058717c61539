"""The device's configuration: the one declaration from which both sides' readers come.

It lies in flash beside the tables, in two sectors written in turn, so that a cut while writing
costs the new one only. `tools/generate_headers.py` writes the C++ header. Little-endian; every
field lies on a multiple of its size.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from chladni.host.protocol.codes import numbered
from chladni.sim.board.electronics import CLOCK_HZ, DRIVER_KINDS, NOT_WIRED, ChipName
from chladni.sim.board.gpio import CHIPS, PinFault, pin_fault
from chladni.sim.coil.full_drive import lowest_duty
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import InputError
from chladni.tables.layout import BOARD_NAME_BYTES, MAX_ACTUATORS, Field, offsets

MAGIC = b"CHLC"
VERSION_MAJOR, VERSION_MINOR = 2, 3
PANELS = ("none", "find", "ft6x36", "gt911")
MOVES = ("follow", "stay")

TIMER_HZ = int(CLOCK_HZ)
"""Clock of the LEDC's timers, on either chip."""
BIAS_RAMP_MS = 40
"""Beside a finger that rests, a click on `prototype` is 23 dB weaker with it, and 14 in the table's
4 ms (simulated)."""
ID_BYTES = 8 + BOARD_NAME_BYTES
CARRIER_PERIODS_PER_FRAME = 8
"""Of a stream: two samples a frame, four periods a sample."""

HEADER_FIELDS = (
    Field("magic", "char4", 'The letters "CHLC".'),
    Field("version_major", "u8", f"{VERSION_MAJOR}. A reader refuses another."),
    Field("version_minor", "u8", f"{VERSION_MINOR}. {VERSION_MAJOR}.x may append fields, no more."),
    Field("total_bytes", "u16", "Whole record, its CRC included."),
    Field("sequence", "u32", "The record with the higher number counts."),
)


@dataclass(frozen=True)
class Setting:
    """A field of the configuration: its bytes, its range and its default."""

    field: Field
    low: int
    high: int
    default: int | tuple[int, ...]


def _setting(
    name: str, kind: str, low: int, high: int, default: int | tuple[int, ...], doc: str
) -> Setting:
    return Setting(Field(name, kind, doc), low, high, default)


def each(value: int, count: int = 5) -> tuple[int, ...]:
    """The same for so many channels, and nothing for the others."""
    return (value,) * count + (0,) * (MAX_ACTUATORS - count)


# The defaults are a board like the authors', without a panel and with no pin wired yet: pins come
# from a board file.
SETTINGS = (
    _setting("channels", "u8", 1, MAX_ACTUATORS, 5, "PWM channels in use."),
    _setting("pwm_bits", "u8", 10, 12, 10, "The carrier is 80 MHz / 2^bits."),
    _setting("panel", "u8", 0, len(PANELS) - 1, 0, "0 none, 1 find, 2 FT6x36, 3 GT911."),
    _setting("panel_turns", "u8", 0, 3, 0, "Quarter turns from the panel's to the board's x."),
    _setting("panel_mirrored", "u8", 0, 1, 0, "Along the panel's x, before it is turned."),
    _setting("waveform", "u8", 0, len(WAVEFORMS) - 1, 0, f"{numbered(WAVEFORMS)}."),
    _setting("on_move", "u8", 0, len(MOVES) - 1, 0, "0 the drive follows the finger, 1 it stays."),
    _setting("press_reports", "u8", 1, 8, 1, "Reports in a row that make a touch."),
    _setting("pwm_pins", "u8x16", 0, 255, (NOT_WIRED,) * MAX_ACTUATORS, "GPIO numbers."),
    _setting("sda_pin", "u8", 0, 48, 21, "GPIO of the panel's data line."),
    _setting("scl_pin", "u8", 0, 48, 22, "GPIO of the panel's clock."),
    _setting("interrupt_pin", "u8", 0, 255, NOT_WIRED,
             "GPIO of the panel's interrupt line; 255: polled."),
    _setting("reset_pin", "u8", 0, 255, NOT_WIRED, "GPIO of the panel's reset."),
    _setting("i2c_khz", "u16", 10, 1000, 400, "Clock of the panel's bus."),
    _setting("report_ms", "u16", 2, 100, 10, "Time between two reports."),
    _setting("panel_columns", "u16", 16, 4096, 720, "Pixels along the panel's x."),
    _setting("panel_rows", "u16", 16, 4096, 1440, "Pixels along the panel's y."),
    _setting("panel_width_um", "u32", 1000, 500_000, 66_000, "Active area along the panel's x."),
    _setting("panel_length_um", "u32", 1000, 500_000, 132_000, "Active area along the panel's y."),
    _setting("panel_x_um", "i32", -500_000, 500_000, 0, "x of its centre, from the board's."),
    _setting("panel_y_um", "i32", -500_000, 500_000, 0, "y of its centre, from the board's."),
    _setting("link_baud", "u32", 9600, 921_600, 115_200, "Bits per second of console and link."),
    _setting("level_q15", "u16", 0, 32767, 26214, "Loudness while touched; the rest is headroom."),
    _setting("attack_ms", "u16", 0, 1000, 0, "To full level at touch-down; 0: the table's ramp."),
    _setting("decay_ms", "u16", 0, 10_000, 0, "From full to sustained level; 0: none."),
    _setting("sustain_q15", "u16", 0, 32767, 32767, "Share of the level that stays."),
    _setting("release_ms", "u16", 0, 1000, 0, "To silence at lift-up; 0: the table's ramp."),
    _setting("lift_pulse_ms", "u16", 0, 1000, 0, "How long the last place plays on at lift-up."),
    _setting("lift_level_q15", "u16", 0, 32767, 26214, "Loudness of this pulse."),
    _setting("lift_hold_ms", "u16", 0, 200, 0, "A shorter lift-up does not count."),
    _setting("max_duty_q15", "u16", 1638, 32768, 32768, "Ceiling of every duty."),
    _setting("min_on_ns", "u16", 0, 5000, 100, "Shortest pulse of a switch's wave."),
    _setting("supply_ma", "u16", 1, 20_000, 1000, "Delivered to all coils in any 64 ms, a mean."),
    _setting("full_current_ma", "u16x16", 0, 4095, each(333), "A channel's at a duty of 1."),
    _setting("full_rise_dk", "u16x16", 0, 65535, each(1000), "Its coil's rise at duty 1, 0.1 K."),
    _setting("limit_rise_dk", "u16", 10, 3000, 600, "No coil may rise further, 0.1 K."),
    _setting("heating_ds", "u16", 1, 36_000, 300, "Time constant of the rise, 0.1 s."),
    _setting("coil_gain_q15", "i16x16", -32767, 32767, (32767,) * MAX_ACTUATORS,
             "Factor of a channel's drive; negative for a coil that is wound the other way."),
    _setting("wire_max_duty_q15", "u16", 1638, 32768, 32768, "The last one written by wire."),
    _setting("wire_supply_ma", "u16", 1, 20_000, 20_000, "The same."),
    _setting("wire_limit_rise_dk", "u16", 10, 3000, 3000, "The same."),
    _setting("board_id", f"u8x{ID_BYTES}", 0, 255, (0,) * ID_BYTES,
             "Board file it was set from: fingerprint and name, as in a table's header."),
    # From here on since 2.1: a shorter record has zeros, which are a switch.
    _setting("driver", "u16", 0, len(DRIVER_KINDS) - 1, 0, f"{numbered(DRIVER_KINDS)}."),
    _setting("lost_ns", "u16", 0, 500, 0, "What a bridge loses of each pulse."),
    _setting("sign_pins", "u8x16", 0, 255, (NOT_WIRED,) * MAX_ACTUATORS,
             "GPIO numbers, 0 to 31, of a bridge's directions."),
    # Since 2.2.
    _setting("bias_ramp_ms", "u16", 0, 1000, BIAS_RAMP_MS,
             "In which a switch's bias comes up beside a finger that rests; 0 is the default."),
    _setting("full_force_mn", "u16", 0, 65535, 0,
             "Peak force of a coil at the loudest; 0: unknown, and so are micrometres."),
    # Since 2.3; GPIO 0 is no converter's, so that zeros are none.
    _setting("sense_pin", "u8", 0, 255, NOT_WIRED, "GPIO where coils are listened to."),
)  # fmt: skip
CEILINGS = {
    "max_duty_q15": "wire_max_duty_q15",
    "supply_ma": "wire_supply_ma",
    "limit_rise_dk": "wire_limit_rise_dk",
}
"""What a host on a network may ask for less of; the device itself keeps the most there may be."""
HARMLESS = (
    "waveform", "on_move", "press_reports", "level_q15", "attack_ms", "decay_ms", "sustain_q15",
    "release_ms", "lift_pulse_ms", "lift_level_q15", "lift_hold_ms", "bias_ramp_ms",
)  # fmt: skip
"""What a host on a network may set as it likes: how a touch feels."""
OWN = (*CEILINGS.values(), "board_id")
"""Settings that no one writes by hand."""
FIELDS = (*HEADER_FIELDS, *(setting.field for setting in SETTINGS))
_STRUCT = struct.Struct("<" + "".join(field.code for field in FIELDS))
CRC_BYTES = 4
RECORD_BYTES = _STRUCT.size + CRC_BYTES
LEAST_RECORD_BYTES = offsets(FIELDS)["driver"] + CRC_BYTES
"""Of version 2.0."""


class DeviceConfig:
    """Values for every setting; immutable.

    Parameters
    ----------
    **values
        By a setting's name; the default for what is left out, which is no pin for any channel.

    Raises
    ------
    InputError
        No such setting, or a value out of its range.
    """

    def __init__(self, **values: Any) -> None:
        known = {setting.field.name: setting for setting in SETTINGS}
        for name, value in values.items():
            if name not in known:
                raise InputError(name, value, f"a setting: one of {', '.join(known)}")
        self.values: Mapping[str, int | tuple[int, ...]] = MappingProxyType(
            {
                name: _checked(setting, values.get(name, setting.default))
                for name, setting in known.items()
            }
        )

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, DeviceConfig) and self.values == other.values

    def __hash__(self) -> int:
        return hash(tuple(self.values.items()))

    @property
    def frame_rate_hz(self) -> float:
        """Frames a second that it plays of a stream: the carrier by eight."""
        return TIMER_HZ / float(1 << self["pwm_bits"]) / CARRIER_PERIODS_PER_FRAME

    @property
    def least_duty(self) -> float:
        """The lowest duty of a switch's wave: its bias has so much more than its amplitude."""
        return lowest_duty(self["min_on_ns"], self["pwm_bits"])

    @property
    def has_bridges(self) -> bool:
        """Whether coils are driven both ways, by signed duties."""
        return bool(self["driver"] == DRIVER_KINDS.index("bridge"))

    def pin_fault(self, chip: ChipName = "esp32") -> PinFault | None:
        """The first pin that a chip cannot use so: a device would not start with it."""
        bus = {}
        if self["panel"] != PANELS.index("none"):
            bus = {
                "sda": self["sda_pin"],
                "scl": self["scl_pin"],
                "interrupt": self["interrupt_pin"],
                "reset": self["reset_pin"],
            }
        signs = self["sign_pins"][: self["channels"]] if self.has_bridges else ()
        if self["sense_pin"]:
            bus["sense"] = self["sense_pin"]
        return pin_fault(self["pwm_pins"][: self["channels"]], signs=signs, chip=chip, **bus)

    def check_pins(self, chip: ChipName = "esp32") -> None:
        """Raise `InputError` if there is one, or if the chip has fewer PWM channels."""
        if self["channels"] > CHIPS[chip].channels:
            most = CHIPS[chip].channels
            raise InputError("channels", self["channels"], f"at most {most} on an {chip}")
        fault = self.pin_fault(chip)
        if fault is not None:
            raise InputError(fault.key, fault.pin, fault.expected, hint=fault.hint)

    @property
    def board(self) -> tuple[int, str] | None:
        """Fingerprint and name of the board that it was set from; None if from none."""
        own = bytes(self["board_id"])
        if not any(own):
            return None
        return int.from_bytes(own[:8], "little"), own[8:].rstrip(b"\0").decode("ascii", "replace")

    def by_wire(self) -> DeviceConfig:
        """As the device keeps it when it comes by wire: its limits are the most there may be."""
        return self.with_values(**{own: self[name] for name, own in CEILINGS.items()})

    def with_values(self, **changes: Any) -> DeviceConfig:
        """The same but for these settings."""
        return DeviceConfig(**{**self.values, **changes})


def _checked(setting: Setting, value: Any) -> int | tuple[int, ...]:
    name, count = setting.field.name, setting.field.count
    items = [value] if count == 1 else list(value)
    expected = f"{setting.low} to {setting.high}"
    if len(items) != count:
        raise InputError(name, value, f"{count} values")
    for item in items:
        if isinstance(item, bool) or not isinstance(item, int):
            raise InputError(name, value, f"a whole number from {expected}")
        if not setting.low <= item <= setting.high:
            raise InputError(name, value, expected)
    return int(items[0]) if count == 1 else tuple(items)


def pack_config(config: DeviceConfig, sequence: int = 1) -> bytes:
    """The record as it lies in flash."""
    head: list[Any] = [MAGIC, VERSION_MAJOR, VERSION_MINOR, RECORD_BYTES, sequence]
    for setting in SETTINGS:
        value = config[setting.field.name]
        head += [value] if setting.field.count == 1 else list(value)
    data = _STRUCT.pack(*head)
    return data + struct.pack("<I", zlib.crc32(data))


def unpack_config(data: bytes) -> tuple[DeviceConfig, int]:
    """A record's settings and its sequence number.

    Raises
    ------
    InputError
        Another magic or version, damaged bytes, a value out of its range.
    """
    if len(data) < LEAST_RECORD_BYTES:
        raise InputError("configuration", f"{len(data)} bytes", f"{LEAST_RECORD_BYTES} at least")
    places = offsets(FIELDS)
    if data[:4] != MAGIC or data[places["version_major"]] != VERSION_MAJOR:
        expected = f"a configuration of version {VERSION_MAJOR}"
        raise InputError("configuration", data[:6].hex(), expected)
    total = int.from_bytes(data[places["total_bytes"] :][:2], "little")
    if not LEAST_RECORD_BYTES <= total <= len(data):
        raise InputError("total_bytes", total, f"{LEAST_RECORD_BYTES} to {len(data)}")
    if zlib.crc32(data[: total - CRC_BYTES]) != int.from_bytes(
        data[total - CRC_BYTES : total], "little"
    ):
        raise InputError("configuration", "a wrong CRC", "undamaged bytes")
    known = data[: min(total - CRC_BYTES, _STRUCT.size)].ljust(_STRUCT.size, b"\0")
    items = list(_STRUCT.unpack(known))[len(HEADER_FIELDS) :]
    values: dict[str, Any] = {}
    for setting in SETTINGS:
        count = setting.field.count
        taken, items = items[:count], items[count:]
        values[setting.field.name] = taken[0] if count == 1 else tuple(taken)
    sequence = int.from_bytes(data[places["sequence"] :][:4], "little")
    return DeviceConfig(**values), sequence
