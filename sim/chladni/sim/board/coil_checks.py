"""What of a coil follows from its winding and its magnet, and whether what is given agrees."""

from __future__ import annotations

import numpy as np

from chladni.sim.board.electronics import Coil, Winding
from chladni.sim.board.foundation_checks import SAME_PLACE
from chladni.sim.board.parts import BoardParts, Magnet
from chladni.sim.board.quantity import METRES, MM, are_metres, check_ranges, in_mm, quantities
from chladni.sim.errors import InputError, MissingError
from chladni.sim.magnetics.windings import force_per_ampere

SAME_WINDING = 0.25
"""Share by which a coil's values may differ, given twice: a warm coil has a quarter more Ω than a
cold one, and a gap that is off by some tenths of a millimetre makes as much of the force."""
ROUNDED = 1e-9
"""m that places in a file may be off by rounding."""
MOST_FILL = 0.75
"""Copper's share of a winding. Round wires side by side cover 0.91, and enamel takes a fifth."""
DIGITS = 4
"""Of what follows from a winding: more than the model knows, and written into a file without
loss."""


def winding_makes(
    winding: Winding, magnet: Magnet | None, *, force: bool = True
) -> dict[str, float]:
    """A coil's values as they follow from its winding, by their keys of `[coil]`.

    Parameters
    ----------
    force
        Whether the force is asked for, which takes a magnet whose remanence is known.

    Raises
    ------
    InputError
        No such winding can be, or the magnet that it acts on is not known.
    """
    check_ranges(winding, "winding")
    _check_shape(winding, magnet)
    own = winding.round
    made = {"resistance_ohm": own.resistance, "inductance_mh": own.inductance / 1e-3}
    if magnet is None or not magnet.remanence:
        if force:
            what = "the force of a [winding] takes it, or coil.force_factor_n_per_a"
            raise MissingError("magnet.remanence_t", what)
    else:
        check_ranges(magnet, "magnet")
        made["force_factor_n_per_a"] = force_per_ampere(
            own,
            remanence=magnet.remanence,
            radius=magnet.radius,
            height=magnet.height,
            gap=winding.gap,
        )
        if made["force_factor_n_per_a"] <= 0.0:
            expected = "a gap with the magnet's middle above the winding's, where it is pushed"
            raise InputError("winding.gap_mm", winding.gap / MM, expected)
    return {key: float(f"{value:.{DIGITS}g}") for key, value in made.items()}


def _check_shape(winding: Winding, magnet: Magnet | None) -> None:
    if winding.inner >= winding.outer:
        expected = f"less than winding.outer_mm, {winding.outer / MM:g}"
        raise InputError("winding.inner_mm", winding.inner / MM, expected)
    if winding.round.fill > MOST_FILL:
        most = int(winding.turns * MOST_FILL / winding.round.fill)
        raise InputError("winding.turns", winding.turns, f"at most {most}, which fill it with wire")
    if magnet is not None and magnet.remanence and not magnet.height:
        hint = "a remanence takes a magnet with a height"
        raise InputError("magnet.height_mm", 0.0, "above 0", hint=hint)
    if magnet is not None and winding.gap <= 0.0 and winding.inner <= 2.0 * magnet.radius:
        raise InputError(
            "winding.gap_mm",
            winding.gap / MM,
            "above 0",
            hint=f"a magnet of {2.0 * magnet.radius / MM:g} mm does not dip into a bore of "
            f"{winding.inner / MM:g} mm",
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
    """Refuse a coil where an earlier one is, or whose winding overlaps an earlier one's."""
    actuator, winding = board.actuators[index], board.winding
    need = winding.outer if winding is not None else SAME_PLACE
    for other in board.actuators[:index]:
        apart = float(np.hypot(*np.subtract(actuator.at, other.at)))
        if apart >= need - ROUNDED:
            continue
        field, given = f"actuators[{index}].at_mm", in_mm(actuator.at)
        if apart < SAME_PLACE:
            hint = f"{other.name!r} is there already"
            raise InputError(field, given, "a place of its own", hint=hint)
        raise InputError(
            field,
            given,
            f"a place {need / MM:.4g} mm or more from {other.name!r}",
            hint=f"windings of {need / MM:.4g} mm overlap at {apart / MM:.4g}",
        )
