"""Whether coils can be as a board file has them, with their drivers and pins."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from chladni.sim.board.electronics import (
    ONLY_OF,
    Coil,
    Electronics,
)
from chladni.sim.board.gpio import CHIPS, MOST_BRIDGES, more_than_bridges, pin_fault
from chladni.sim.board.parts import BoardParts
from chladni.sim.board.quantity import (
    METRES,
    MM,
    SAME_PLACE,
    are_metres,
    check_choice,
    in_mm,
    quantities,
)
from chladni.sim.board.winding_values import SAME_WINDING, winding_makes
from chladni.sim.errors import ConflictError, Faults, InputError, MissingError

ROUNDED = 1e-9
"""m that places in a file may be off by rounding."""
CLEAR = 0.1e-3
"""m between two magnets, which may not touch."""


def check_coil(board: BoardParts) -> None:
    """Raise `InputError` unless all values of a board's coils belong to one winding."""
    coil, ohm = board.coil, board.electronics.coil_ohm
    if coil is not None and not isinstance(coil.motion_acts_back, bool):
        raise InputError("coil.motion_acts_back", coil.motion_acts_back, "true or false")
    if coil is not None:
        _check_latch(coil)
    if coil is not None and abs(coil.resistance / ohm - 1.0) > SAME_WINDING:
        raise InputError(
            "electronics.coil_ohm",
            ohm,
            f"about coil.resistance_ohm, {coil.resistance:g}: one gives current and heat, the "
            "other the force",
        )
    if board.winding is None:
        return
    made = winding_makes(board.winding, board.magnet, force=False)
    given = {"electronics.coil_ohm": (ohm, made["resistance_ohm"])}
    if coil is not None:
        own = {
            "resistance_ohm": coil.resistance,
            "inductance_mh": coil.inductance / 1e-3,
            "force_factor_n_per_a": coil.force_factor,
        }
        given |= {f"coil.{key}": (own[key], made[key]) for key in made}
    for field, (value, follows) in given.items():
        if abs(value / follows - 1.0) > SAME_WINDING:
            raise InputError(
                field,
                float(f"{value:.6g}"),
                f"about {follows:g}, as [winding] and [magnet] make it",
                hint="leave it out, or mend one of them",
            )


def _check_latch(coil: Coil) -> None:
    """A latch has all of its three values, or there is none."""
    keys = ("moving_mass", "resonance_hz", "mechanical_q")
    lacking = [key for key in keys if getattr(coil, key) is None]
    if lacking and len(lacking) < len(keys):
        own = quantities(coil)
        names = ", ".join(own[key].key for key in keys)
        raise MissingError(
            f"coil.{own[lacking[0]].key}",
            f"a latch takes all of {names}",
            hint="leave them out on a board without a latch",
        )


def check_actuators(board: BoardParts) -> None:
    """Raise `InputError` unless coils have names, places and pins of their own."""
    if not 1 <= len(board.actuators) <= 64:
        raise InputError("actuators", f"{len(board.actuators)} entries", "1 to 64 actuators")
    along = [value for actuator in board.actuators for value in in_mm(actuator.at)]
    if len(board.actuators) > 1 and are_metres(along):
        places = [in_mm(actuator.at) for actuator in board.actuators]
        raise InputError("actuators", places, "places beside each other", hint=METRES)
    names = [actuator.name for actuator in board.actuators]
    for index, actuator in enumerate(board.actuators):
        if not isinstance(actuator.name, str) or not actuator.name:
            raise InputError(f"actuators[{index}].name", actuator.name, "a name")
        if actuator.polarity not in (1, -1):
            at = f"actuators[{index}].polarity"
            raise InputError(at, actuator.polarity, "1, or -1 for the other way round")
        if not isinstance(actuator.is_dead, bool):
            raise InputError(f"actuators[{index}].is_dead", actuator.is_dead, "true or false")
        if actuator.name in names[:index]:
            raise InputError(f"actuators[{index}].name", actuator.name, "a name of its own")
        _check_apart(board, index)
    pins = board.electronics.pwm_pins
    if pins and (len(pins) != len(board.actuators) or len(set(pins)) != len(pins)):
        raise InputError(
            "electronics.pwm_pins",
            list(pins),
            f"{len(board.actuators)} different pins, one per actuator, or none",
        )


def _check_apart(board: BoardParts, index: int) -> None:
    """Refuse a coil where an earlier one is, or so close that they overlap.

    What is asked for has room for the foam's holes too, which are looked at later.
    """
    actuator = board.actuators[index]
    least, what = max(_widths(board))
    hole = board.foundation.coil_cut_out if board.foundation else 0.0
    clear = CLEAR if what == "magnets" else 0.0
    need = max(least + clear, 2.0 * hole)
    for other in board.actuators[:index]:
        apart = float(np.hypot(*np.subtract(actuator.at, other.at)))
        if apart >= least - ROUNDED:
            continue
        field, given = f"actuators[{index}].at_mm", in_mm(actuator.at)
        if apart < SAME_PLACE:
            hint = f"{other.name!r} is there already"
            raise InputError(field, given, "a place of its own", hint=hint)
        raise InputError(
            field,
            given,
            f"a place {need / MM:.4g} mm or more from {other.name!r}",
            hint=f"{what} of {least / MM:.4g} mm overlap at {apart / MM:.4g}",
        )


def _widths(board: BoardParts) -> list[tuple[float, str]]:
    """What every coil has, m across, in words."""
    widths = [(SAME_PLACE, "coils")]
    if board.winding is not None:
        widths.append((board.winding.outer, "windings"))
    if board.magnet is not None:
        widths.append((2.0 * board.magnet.radius, "magnets"))
    return widths


def check_driver(own: Electronics, given: Collection[str] = ()) -> None:
    """Refuse what only the other kind of driver has, and more bridges than a chip has pins for.

    Parameters
    ----------
    given
        Keys that stand in the board file; with those a default is refused too.
    """
    check_choice(Electronics, "drive", own.drive, "electronics.drive")
    faults = Faults()
    for key, (kind, why) in ONLY_OF.items():
        value = getattr(own, key)
        is_said = value != getattr(Electronics, key) or (key in given and value)
        if kind != own.drive and is_said:
            hint = f"{why}: leave it out, or set electronics.drive to '{kind}'"
            with faults.kept():
                raise ConflictError(
                    f"electronics.{key}", f'electronics.drive = "{own.drive}"', hint=hint
                )
    faults.tell()
    if not own.is_bridge:
        return
    _check_bridges(len(own.pwm_pins))
    if own.pwm_pins and not own.sign_pins:
        raise MissingError(
            "electronics.sign_pins",
            f"{len(own.pwm_pins)} GPIOs, one per bridge",
            hint="a bridge's PWM pin has the magnitude, another pin the sign",
        )
    if len(own.sign_pins) != len(own.pwm_pins) or len(set(own.sign_pins)) != len(own.sign_pins):
        expected = f"{len(own.pwm_pins)} different pins, one for each of pwm_pins"
        raise InputError("electronics.sign_pins", list(own.sign_pins), expected)


def _check_bridges(count: int) -> None:
    if count > MOST_BRIDGES:
        expected, hint = f"at most {MOST_BRIDGES} bridges", more_than_bridges()
        raise InputError("electronics.drive", f"{count} bridges", expected, hint=hint)


def check_pins(board: BoardParts) -> None:
    """Every pin can be on the chip what the board file makes it, and is one thing only."""
    own = board.electronics
    if own.is_bridge:
        _check_bridges(len(board.actuators))
    if not own.is_bridge and own.diode_v >= own.supply_v:
        expected = f"less than supply_v, {own.supply_v:g}"
        raise InputError("electronics.diode_v", own.diode_v, expected)
    panel, gates, chip = board.panel, board.electronics.pwm_pins, board.electronics.chip
    check_choice(Electronics, "chip", chip, "electronics.chip")
    if gates and len(gates) > CHIPS[chip].channels:
        expected = f"a chip with {len(gates)} PWM channels"
        able = [name for name, own in CHIPS.items() if own.channels >= len(gates)]
        others = f", {' and '.join(able)} has them" if able else ""
        raise InputError(
            "electronics.chip", chip, expected, hint=f"it has {CHIPS[chip].channels}{others}"
        )
    bus = {} if panel is None else dict(panel.pins)
    if board.sensing is not None:
        if panel is None:
            expected = "a board with [panel]: what chooses a coil is on its bus"
            raise InputError("sensing", "no panel", expected)
        bus["sense"] = board.sensing.pin
    fault = pin_fault(gates, signs=own.sign_pins, chip=chip, **bus)
    if fault is not None:
        section = "electronics" if fault.key.endswith("s") else "panel"
        key = "sensing.pin" if fault.key == "sense_pin" else f"{section}.{fault.key}"
        raise InputError(key, fault.pin, fault.expected, hint=fault.hint)
