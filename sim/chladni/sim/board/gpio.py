"""What each chip has for a board: PWM channels, and what each GPIO can be used for, or why not.

From the chips' data sheets and ESP-IDF's pages on GPIO of each target.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from chladni.sim.board.electronics import NOT_WIRED, ChipName


@dataclass(frozen=True)
class Chip:
    """What a chip has for a board, in the module it is bought in.

    Attributes
    ----------
    module
        By its maker's name.
    channels
        PWM outputs of the LEDC.
    gates
        GPIOs that can drive a gate with a pull-down, beside the link and one I²C bus.
    signs
        GPIOs that can tell a bridge the sign of its duty. All signs are set by one write to a
        register, which reaches GPIO 0 to 31. A bridge holds the line low while no one drives it.
    outputs
        And those of a bus, a panel's reset among them.
    inputs
        And those that sense a line.
    converters
        And those of converter 1, the one that a radio leaves alone.
    bus
        Those whose pull-ups hold no strap the wrong way.
    pulled_up
        Gates that something inside the chip pulls up before any firmware runs.
    not_beside_psram
        Gates that a module with PSRAM has no pins for.
    reasons
        Why a GPIO can be nothing here, or not all that others can.
    panel
        GPIOs of a panel's data line, clock and interrupt line where a board file names none.
    link
        The link's lines, as they stand on a wiring drawing.
    """

    module: str
    channels: int
    gates: tuple[int, ...]
    signs: tuple[int, ...]
    outputs: tuple[int, ...]
    inputs: tuple[int, ...]
    converters: tuple[int, ...]
    bus: tuple[int, ...]
    pulled_up: tuple[int, ...]
    not_beside_psram: tuple[int, ...]
    reasons: Mapping[int, str]
    panel: tuple[int, int, int]
    link: tuple[str, str]


_ABSENT = "this chip has no such pin"
_FLASH = "it is the flash chip's"
_LINK = "it is UART0's, the link's own line"
_BUS = "it is left for the panel's bus"
_NO_CONVERTER = "converter 1 does not reach it"
_BEYOND = "all signs are set by one write, which reaches GPIO 0 to 31"
MOST_BRIDGES = 8
"""On either chip: an ESP32-S3 has eight PWM channels, and an ESP32's 17 gates, two for each bridge,
are enough for eight."""
SIGNS_BELOW = 32
"""GPIOs that one write reaches."""

_ESP32_GATES = (2, 4, 5, 12, 13, 14, 15, 16, 17, 18, 19, 23, 25, 26, 27, 32, 33)
_ESP32_OUTPUTS = (*_ESP32_GATES, 21, 22)
# 5 and 15 are straps that the data sheet pulls up, 14 is JTAG's TMS: high at start on boards, by
# report. 16 and 17 are the PSRAM's on a WROVER and the flash's on a PICO-D4.
_ESP32 = Chip(
    module="ESP32-WROOM-32",
    channels=16,
    gates=_ESP32_GATES,
    signs=tuple(pin for pin in _ESP32_GATES if pin < SIGNS_BELOW),
    outputs=_ESP32_OUTPUTS,
    inputs=(*_ESP32_OUTPUTS, 34, 35, 36, 37, 38, 39),
    converters=tuple(range(32, 40)),
    bus=tuple(pin for pin in _ESP32_OUTPUTS if pin not in (2, 12)),
    pulled_up=(5, 14, 15),
    not_beside_psram=(16, 17),
    reasons={
        0: "it must be high at reset, where a pull-down holds it low",
        1: _LINK,
        2: "it is a strap that the bus's pull-up would hold high",
        3: _LINK,
        **dict.fromkeys(range(6, 12), _FLASH),
        12: "it is a strap that selects 1.8 V flash when it is high at reset",
        **dict.fromkeys((21, 22), _BUS),
        **dict.fromkeys(range(34, 40), "it is an input only"),
    },
    panel=(21, 22, 34),
    link=("GPIO 1 (TXD0)", "GPIO 3 (RXD0)"),
)

# Of 45 pins those are left out as gates that some module or board of the maker has no use of or
# moves at power-on: there are more than eight without them.
_S3_GATES = (1, 2, 4, 5, 6, 7, 10, 11, 12, 13, 14, 15, 16, 17, 38)
# A sign that is high for a moment at power-on moves nothing: its bridge's gate is low.
_S3_SIGNS = (*(pin for pin in _S3_GATES if pin < SIGNS_BELOW), 18, 21)
_S3_OUTPUTS = (*_S3_GATES, 8, 9, 18, 21, 39, 40, 41, 42)
_ESP32S3 = Chip(
    module="ESP32-S3-WROOM-1",
    channels=8,
    gates=_S3_GATES,
    signs=_S3_SIGNS,
    outputs=_S3_OUTPUTS,
    inputs=(*_S3_OUTPUTS, 3),
    converters=tuple(range(1, 11)),
    bus=_S3_OUTPUTS,
    pulled_up=(),
    not_beside_psram=(),
    reasons={
        0: "it must be high at reset, where a pull-down holds it low",
        3: "it is a strap that says where JTAG is",
        **dict.fromkeys((8, 9), _BUS),
        **dict.fromkeys((18, 21), "it may be high for a moment at power-on"),
        **dict.fromkeys((19, 20), "it is USB's, the link's own line"),
        **dict.fromkeys(range(26, 33), _FLASH),
        **dict.fromkeys(range(33, 38), "it is the PSRAM's on modules with eight lines to it"),
        **dict.fromkeys(range(39, 43), "it is JTAG's"),
        **dict.fromkeys((43, 44), "it is UART0's, on which the chip's ROM writes"),
        45: "it is a strap that selects the flash's voltage",
        46: "it is a strap that must be low where firmware is loaded",
        **dict.fromkeys((47, 48), "it has 1.8 V on modules with 16 MB of PSRAM"),
    },
    panel=(8, 9, 3),
    link=("GPIO 20 (USB D+)", "GPIO 19 (USB D−)"),
)

CHIPS: Mapping[str, Chip] = MappingProxyType({"esp32": _ESP32, "esp32s3": _ESP32S3})
"""By the name that a board file has it; their order is the device's (core/generated/gpio.hpp)."""


@dataclass(frozen=True)
class PinFault:
    """A pin that a role cannot have.

    Attributes
    ----------
    role
        "gate 3", "data line", …
    pin
        GPIO number.
    why
        In words.
    others
        Pins that would do, free ones first.
    """

    role: str
    pin: int
    why: str
    others: tuple[int, ...]

    @property
    def key(self) -> str:
        """What board files and devices call it."""
        if self.role.startswith("sign"):
            return "sign_pins"
        keys = {
            "panel's data line": "sda_pin",
            "panel's clock": "scl_pin",
            "panel's interrupt line": "interrupt_pin",
            "panel's reset line": "reset_pin",
            "sensing pin": "sense_pin",
        }
        return keys.get(self.role, "pwm_pins")

    @property
    def expected(self) -> str:
        """For an error: what the pin must be."""
        return f"a GPIO that can be the {self.role}"

    @property
    def hint(self) -> str:
        """For an error: why this pin is none, and which would do."""
        free = ", ".join(map(str, self.others))
        return f"{self.why}, free are {free}" if free else self.why


def pin_fault(
    gates: Sequence[int],
    *,
    signs: Sequence[int] = (),
    chip: ChipName = "esp32",
    sda: int | None = None,
    scl: int | None = None,
    interrupt: int = NOT_WIRED,
    reset: int = NOT_WIRED,
    sense: int = NOT_WIRED,
) -> PinFault | None:
    """The first pin that its role cannot have on a chip; None if there is none.

    Parameters
    ----------
    gates
        Of the channels in use, in order.
    signs
        Of the same channels' bridges; empty with switches.
    sda, scl
        Of the panel's bus; None where there is no panel, whose other pins do not count then.
    sense
        Where coils are listened to.
    """
    own = CHIPS[chip]
    if len(gates) > own.channels:
        why = f"{chip} has {own.channels} PWM channels"
        return PinFault(f"gate of channel {own.channels}", gates[own.channels], why, ())
    if len(signs) > MOST_BRIDGES:
        why = f"{chip} has pins for {MOST_BRIDGES} bridges"
        return PinFault(f"sign of channel {MOST_BRIDGES}", signs[MOST_BRIDGES], why, ())
    roles: list[tuple[str, int, tuple[int, ...]]] = [
        (f"gate of channel {k}", pin, own.gates) for k, pin in enumerate(gates)
    ]
    roles += [(f"sign of channel {k}", pin, own.signs) for k, pin in enumerate(signs)]
    if sda is not None and scl is not None:
        roles += [("panel's data line", sda, own.bus), ("panel's clock", scl, own.bus)]
        if interrupt != NOT_WIRED:
            roles.append(("panel's interrupt line", interrupt, own.inputs))
        if reset != NOT_WIRED:
            roles.append(("panel's reset line", reset, own.outputs))
    if sense != NOT_WIRED:
        roles.append(("sensing pin", sense, own.converters))
    taken = [pin for _, pin, _ in roles]
    for k, (role, pin, allowed) in enumerate(roles):
        free = tuple(one for one in allowed if one not in taken)
        if pin == NOT_WIRED:
            return PinFault(role, pin, "no pin is given", free)
        if pin not in allowed:
            is_beyond = allowed is own.signs and pin in own.gates
            why = _BEYOND if is_beyond else own.reasons.get(pin, _ABSENT)
            if allowed is own.converters and pin in own.inputs:
                why = _NO_CONVERTER
            return PinFault(role, pin, why, free)
        if pin in taken[:k]:
            other = roles[taken.index(pin)][0]
            return PinFault(role, pin, f"the {other} has it", free)
    return None


def more_than_bridges() -> str:
    """The way to more coils than either chip has bridges or an ESP32-S3 has channels for."""
    return (
        "an ESP32-S3 has eight PWM channels, an ESP32 has 17 pins, two for each bridge: "
        f"take {MOST_BRIDGES} coils, or drive = 'switch' on an ESP32, which has "
        f"{CHIPS['esp32'].channels}"
    )
