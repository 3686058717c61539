"""What each GPIO of an ESP32 (WROOM-32) can be used for, and why not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.sim.board.electronics import NOT_WIRED

GATES = (2, 4, 5, 12, 13, 14, 15, 16, 17, 18, 19, 23, 25, 26, 27, 32, 33)
"""Seventeen that can drive a gate with a pull-down, beside UART0 and one I²C bus on 21 and 22."""
OUTPUTS = (*GATES, 21, 22)
"""And those of a bus, a panel's reset among them."""
INPUTS = (*OUTPUTS, 34, 35, 36, 37, 38, 39)
"""And those that sense a line; the last six have no output and no pull-up."""
BUS = tuple(pin for pin in OUTPUTS if pin not in (2, 12))
"""Without straps that the bus's pull-ups would hold the wrong way."""

RESET_PULL_UPS = (5, 14, 15)
"""Gates that something inside the chip pulls up before any firmware runs: the straps 5 and 15 by
the data sheet, 14 (JTAG's TMS) by reports of boards on which it is high at start."""
NOT_BESIDE_PSRAM = (16, 17)
"""The PSRAM's on a WROVER, the flash's on a PICO-D4."""

REASONS = {
    0: "it must be high at reset, where a gate's pull-down holds it low",
    1: "it is UART0's, the link's own line",
    3: "it is UART0's, the link's own line",
    **dict.fromkeys(range(6, 12), "it is the flash chip's"),
    20: "this chip has no such pin",
    24: "this chip has no such pin",
    **dict.fromkeys(range(28, 32), "this chip has no such pin"),
    **dict.fromkeys(range(34, 40), "it is an input only"),
}
STRAPS = {
    2: "it is a strap that the bus's pull-up would hold high",
    12: "it is a strap that selects 1.8 V flash when it is high at reset",
    21: "it is left for the panel's bus",
    22: "it is left for the panel's bus",
}
"""Of pins that some roles may have and others not."""


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
    def expected(self) -> str:
        """For an error: what the pin must be."""
        return f"a GPIO that can be the {self.role}"

    @property
    def hint(self) -> str:
        """For an error: why this pin is none, and which would do."""
        return f"{self.why}, free are {', '.join(map(str, self.others))}"


def pin_fault(
    gates: Sequence[int],
    *,
    sda: int | None = None,
    scl: int | None = None,
    interrupt: int = NOT_WIRED,
    reset: int = NOT_WIRED,
) -> PinFault | None:
    """The first pin that its role cannot have; None if there is none.

    Parameters
    ----------
    gates
        Of the channels in use, in order.
    sda, scl
        Of the panel's bus; None where there is no panel, whose other pins do not count then.
    """
    roles: list[tuple[str, int, tuple[int, ...]]] = [
        (f"gate of channel {k}", pin, GATES) for k, pin in enumerate(gates)
    ]
    if sda is not None and scl is not None:
        roles += [("panel's data line", sda, BUS), ("panel's clock", scl, BUS)]
        if interrupt != NOT_WIRED:
            roles.append(("panel's interrupt line", interrupt, INPUTS))
        if reset != NOT_WIRED:
            roles.append(("panel's reset line", reset, OUTPUTS))
    taken = [pin for _, pin, _ in roles]
    for k, (role, pin, allowed) in enumerate(roles):
        free = tuple(one for one in allowed if one not in taken)
        if pin == NOT_WIRED:
            return PinFault(role, pin, "no pin is given", free)
        if pin not in allowed:
            why = REASONS.get(pin, STRAPS.get(pin, "this chip has no such pin"))
            return PinFault(role, pin, why, free)
        if pin in taken[:k]:
            other = roles[taken.index(pin)][0]
            return PinFault(role, pin, f"the {other} has it", free)
    return None
