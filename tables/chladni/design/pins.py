"""Which GPIOs a design's coils get, and what of its electronics goes with which driver."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from chladni.design.variables import Document
from chladni.sim.board.electronics import ONLY_OF
from chladni.sim.board.gpio import CHIPS, MOST_BRIDGES, Chip, more_than_bridges
from chladni.sim.errors import InputError


def chip_of(electronics: Mapping[str, Any]) -> Chip:
    """The chip that is named, or the default; a board file's own check refuses what is none."""
    name = electronics.get("chip")
    return CHIPS.get(name, CHIPS["esp32"]) if isinstance(name, str) else CHIPS["esp32"]


def with_pins(electronics: Document, panel: object) -> Document:
    """Electronics with GPIOs for as many coils as there may be, where none are given.

    Of gates those come first that nothing pulls up at reset; with bridges those that can be no
    signs.
    """
    if electronics.get("pwm_pins", "free") != "free":
        return electronics
    chip, lines = chip_of(electronics), panel if isinstance(panel, dict) else {}
    taken = [pin for key, pin in lines.items() if key.endswith("_pin")]
    free = [pin for pin in chip.gates if pin not in taken]
    # A gate's pull-down keeps straps low; still they come where others are used up.
    gates = sorted(free, key=lambda pin: (pin in chip.pulled_up, pin not in chip.bus))
    if not _may_be_bridges(electronics):
        return electronics | {"pwm_pins": gates[: chip.channels]}
    gates = sorted(gates, key=lambda pin: pin in chip.signs)
    signs = [pin for pin in chip.signs if pin not in taken]
    # Pins that are pulled up are fine for signs, and no one misses them as gates.
    signs = sorted(
        signs, key=lambda pin: (pin not in chip.pulled_up, pin not in chip.bus, pin in gates)
    )
    most = max(
        count
        for count in range(MOST_BRIDGES + 1)
        if len([pin for pin in signs if pin not in gates[:count]]) >= count <= len(gates)
    )
    gates = gates[:most]
    own = [pin for pin in signs if pin not in gates][:most]
    return electronics | {"pwm_pins": gates, "sign_pins": own}


def of_its_driver(electronics: Document, coils: int, *, is_open: bool) -> Document:
    """Electronics of a board with so many coils.

    Parameters
    ----------
    is_open
        Whether the SPEC leaves the driver open: then what only the other one has is left out.
    """
    own = dict(electronics)
    for key in ("pwm_pins", "sign_pins"):
        if own.get(key):
            own[key] = own[key][:coils]
    if not is_open:
        return own
    drive = own.get("drive", "switch")
    return {
        key: value for key, value in own.items() if key not in ONLY_OF or ONLY_OF[key][0] == drive
    }


def _may_be_bridges(electronics: Mapping[str, Any]) -> bool:
    drive = electronics.get("drive", "switch")
    options = drive.get("any", []) if isinstance(drive, dict) else [drive]
    return isinstance(options, list) and "bridge" in options


def with_derived(board: Document) -> Document:
    """What follows from the rest where it is left out: the image's points, and the GPIOs."""
    own: Document = {"electronics": {}} | board
    electronics = own["electronics"]
    if isinstance(electronics, dict):
        own["electronics"] = with_pins(electronics, own.get("panel"))
    if "image" not in own:
        own["image"] = {"points": None}
    return own


def check_pins(electronics: object, most: int) -> None:
    """Raise `InputError` for more GPIOs than a SPEC's largest number of coils needs.

    Which of them are meant would be a guess: a board file has one of each for a coil, too.
    """
    own = electronics if isinstance(electronics, dict) else {}
    for key in ("pwm_pins", "sign_pins"):
        pins = own.get(key)
        if isinstance(pins, list) and len(pins) > most:
            hint = "leave the key out, and GPIOs are chosen"
            expected = f"{most} {'pin' if most == 1 else 'pins'}, one per coil"
            raise InputError(f"electronics.{key}", pins, expected, hint=hint)


def check_coils(count: Any, most: int, channels: int) -> None:
    """Raise `InputError` for a number of coils that a board of so many channels cannot have."""
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= most:
        why = ", one for each PWM channel with a pin" if most <= channels else ""
        hint = more_than_bridges() if most == MOST_BRIDGES else ""
        raise InputError("design.coils", count, f"1 to {most} coils{why}", hint=hint)
