"""What a board may be: ranges, places and supports, each fault named by its key."""

from __future__ import annotations

import datetime
import re
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.catalogue import check_plate
from chladni.sim.board.coil_checks import check_actuators, check_coil
from chladni.sim.board.electronics import (
    CHIP_NAMES,
    DRIVER_KINDS,
    ONLY_OF,
    Electronics,
)
from chladni.sim.board.foundation_checks import check_foundation
from chladni.sim.board.gpio import CHIPS, MOST_BRIDGES, PinFault, pin_fault
from chladni.sim.board.panel_layer import check_panel
from chladni.sim.board.parts import FEATURES, SCREW_SUPPORTS, BoardParts
from chladni.sim.board.quantity import MM, check_ranges, in_mm
from chladni.sim.errors import ConflictError, Faults, InputError, MissingError

FloatArray = NDArray[np.float64]
NEIGHBOURS = 8
"""Of a feature that are looked at for the closest one; a small one has no more that are close."""
SOLVABLE_GAP = 0.6e-3
"""Gap between features, m, at which every pair that was tried could be followed."""
NAME_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,15}")
"""A board's name goes into 16 bytes of the table, with an ending zero."""


def check_board(board: BoardParts) -> None:
    """Raise `InputError` that names all wrong values of a board; without any, what does not fit."""
    for checks in (_OF_VALUES, _OF_THE_WHOLE):
        faults = Faults()
        for check in checks:
            with faults.kept():
                check(board)
        faults.tell()


def _check_name(board: BoardParts) -> None:
    if not isinstance(board.name, str) or not NAME_PATTERN.fullmatch(board.name):
        raise InputError("name", board.name, "1 to 15 letters, digits, '-' or '_'")


def _check_ranges(board: BoardParts) -> None:
    faults = Faults()
    for section in (
        "plate", "magnet", "coil", "winding", "panel", "foundation", "finger", "drive", "image",
        "regions", "electronics", "focus", "active", "fingers",
    ):  # fmt: skip
        part = getattr(board, section)
        if part is not None:
            with faults.kept():
                check_ranges(part, section)
    for section in (*FEATURES, "actuators"):
        for index, feature in enumerate(getattr(board, section)):
            with faults.kept():
                check_ranges(feature, f"{section}[{index}]")
    faults.tell()


def _check_sizes(board: BoardParts) -> None:
    """Thin-plate theory, and regions that the plate holds."""
    smallest = min(board.plate.size)
    if board.plate.thickness > smallest / 10.0:
        raise InputError(
            "plate.thickness_mm",
            board.plate.thickness / MM,
            f"at most {smallest / 10.0 / MM:g}, a tenth of the short side: thin-plate theory",
        )
    for field, pitch in (
        ("regions.pitch_mm", board.regions.pitch),
        ("fingers.pitch_mm", board.fingers.pitch if board.fingers else None),
    ):
        if pitch is not None and pitch > smallest:
            raise InputError(field, pitch / MM, "at most the short side")


def _check_focus(board: BoardParts) -> None:
    """The zones lie in order round the finger, and some of the board is left for it."""
    focus, active = board.focus, board.active
    if focus is not None and focus.quieter_from > focus.silent_from:
        expected = f"at most silent_from_mm, {focus.silent_from / MM:g}"
        raise InputError("focus.quieter_from_mm", focus.quieter_from / MM, expected)
    short = min(board.plate.size)
    if active is not None and 2.0 * active.margin >= short:
        expected = f"less than half the short side, {short / 2.0 / MM:g}"
        raise InputError("active.margin_mm", active.margin / MM, expected)


def check_driver(own: Electronics, given: Collection[str] = ()) -> None:
    """Refuse what only the other kind of driver has, and more bridges than a chip has pins for.

    Parameters
    ----------
    given
        Keys that stand in the board file; with those a default is refused too.
    """
    if own.drive not in DRIVER_KINDS:
        expected = "one of: " + ", ".join(map(repr, DRIVER_KINDS))
        raise InputError("electronics.drive", own.drive, expected)
    for key, (kind, why) in ONLY_OF.items():
        value = getattr(own, key)
        is_said = value != getattr(Electronics, key) or (key in given and value)
        if kind != own.drive and is_said:
            raise ConflictError(
                f"electronics.{key}", f'electronics.drive = "{own.drive}"',
                hint=f"{why}: leave it out, or set electronics.drive to '{kind}'",
            )  # fmt: skip
    if not own.is_bridge:
        return
    if len(own.pwm_pins) > MOST_BRIDGES:
        raise InputError(
            "electronics.drive",
            f"{len(own.pwm_pins)} bridges",
            f"at most {MOST_BRIDGES} bridges",
            hint="an ESP32-S3 has eight PWM channels, an ESP32 has 17 pins, two for each bridge",
        )
    if own.pwm_pins and not own.sign_pins:
        raise MissingError(
            "electronics.sign_pins",
            f"{len(own.pwm_pins)} GPIOs, one per bridge",
            hint="a bridge's PWM pin has the magnitude, another pin the sign",
        )
    if len(own.sign_pins) != len(own.pwm_pins) or len(set(own.sign_pins)) != len(own.sign_pins):
        expected = f"{len(own.pwm_pins)} different pins, one for each of pwm_pins"
        raise InputError("electronics.sign_pins", list(own.sign_pins), expected)


def _check_pins(board: BoardParts) -> None:
    """Every pin can be on the chip what the board file makes it, and is one thing only."""
    own = board.electronics
    if not own.is_bridge and own.diode_v >= own.supply_v:
        expected = f"less than supply_v, {own.supply_v:g}"
        raise InputError("electronics.diode_v", own.diode_v, expected)
    panel, gates, chip = board.panel, board.electronics.pwm_pins, board.electronics.chip
    if not isinstance(chip, str) or chip not in CHIPS:  # a list of TOML cannot be looked up
        expected = "one of: " + ", ".join(map(repr, CHIP_NAMES))
        raise InputError("electronics.chip", chip, expected)
    if gates and len(gates) > CHIPS[chip].channels:
        expected = f"a chip with {len(gates)} PWM channels"
        able = [name for name, own in CHIPS.items() if own.channels >= len(gates)]
        others = f", {' and '.join(able)} has them" if able else ""
        raise InputError(
            "electronics.chip", chip, expected, hint=f"it has {CHIPS[chip].channels}{others}"
        )
    bus = {} if panel is None else {
        "sda": panel.sda_pin, "scl": panel.scl_pin, "interrupt": panel.interrupt_pin,
        "reset": panel.reset_pin,
    }  # fmt: skip
    fault = pin_fault(gates, signs=own.sign_pins, chip=chip, **bus)
    if fault is not None:
        raise InputError(_key_of(fault), fault.pin, fault.expected, hint=fault.hint)


def _key_of(fault: PinFault) -> str:
    """Of a board file: where the pin stands."""
    if fault.role.startswith("sign"):
        return "electronics.sign_pins"
    keys = {
        "panel's data line": "panel.sda_pin",
        "panel's clock": "panel.scl_pin",
        "panel's interrupt line": "panel.interrupt_pin",
        "panel's reset line": "panel.reset_pin",
    }
    return keys.get(fault.role, "electronics.pwm_pins")


def _check_supports(board: BoardParts) -> None:
    """Refuse what has no answer on a thin plate: a slope held, or resisted, at a point."""
    for index, screw in enumerate(board.screws):
        where = f"screws[{index}]"
        if screw.support not in SCREW_SUPPORTS:
            expected = "one of: " + ", ".join(map(repr, SCREW_SUPPORTS))
            raise InputError(f"{where}.support", screw.support, expected)
        if screw.radius <= 0.0:
            raise InputError(
                f"{where}.radius_mm",
                0.0,
                "a radius above 0: a clamp at a point has no limit on a thin plate",
                hint="use a pin",
            )
        is_sprung = screw.stiffness > 0.0 or screw.rotational_stiffness > 0.0
        if is_sprung != (screw.support == "sprung"):
            raise InputError(
                f"{where}.support",
                screw.support,
                "'sprung' with a stiffness, or 'clamped' or 'pinned' without one",
            )
    radius = board.plate.corner_radius
    fits = 2.0 * radius <= min(board.plate.size) and board.plate.edges.are_all("free")
    if radius > 0.0 and not fits:
        raise InputError(
            "plate.corner_radius_mm",
            float(f"{radius / MM:.9g}"),
            "at most half the short side, and all edges free",
        )
    for index, spring in enumerate(board.springs):
        if spring.rotational_stiffness > 0.0:
            raise InputError(
                f"springs[{index}].rotational_n_mm_per_rad",
                spring.rotational_stiffness / MM,
                "nothing: a rotational spring at a point has no limit on a thin plate",
                hint="use a sprung screw, which has a rim",
            )
    for index, screw in enumerate(board.screws):
        if screw.loss_factor is not None and screw.support != "sprung":
            where, given = f"screws[{index}].loss_factor", screw.loss_factor
            expected = "nothing: what holds the plate rigidly loses nothing"
            raise InputError(where, given, expected, hint="set support to 'sprung'")
    for index, mass in enumerate(board.masses):
        if mass.radius == 0.0 and (mass.height > 0.0 or mass.stiffness_ratio != 1.0):
            raise InputError(
                f"masses[{index}].radius_mm",
                0.0,
                "a radius above 0 for a mass with a height or a stiffness: both need an area",
            )


def _check_places(board: BoardParts) -> None:
    half = np.array(board.plate.size) / 2.0
    corner = board.plate.corner_radius
    for index, actuator in enumerate(board.actuators):
        if not board.contains(*actuator.at):
            raise InputError(
                f"actuators[{index}].at_mm",
                in_mm(actuator.at),
                f"a place on the plate: |x| up to {half[0] / MM:g}, |y| up to {half[1] / MM:g}",
            )
    discs = _discs(board)
    if not discs:
        return
    centres, radii = _centres_and_radii(discs)
    # A third of a second of SciPy, which a device without parts on its plate does not need.
    from scipy.spatial import cKDTree  # noqa: PLC0415

    tree, largest = cKDTree(centres), float(radii.max())
    for index, (name, at, radius) in enumerate(discs):
        inside = np.abs(at) + radius < half if radius > 0.0 else np.abs(at) <= half + 1e-9
        beyond = np.maximum(np.abs(at) - (half - corner), 0.0)
        rounded_off = np.all(beyond > 0.0) and np.hypot(*beyond) + radius > corner
        if not np.all(inside) or rounded_off:
            what = "magnet" if name.startswith("actuators") else name.split("[")[0].rstrip("s")
            raise InputError(
                f"{name}.at_mm", in_mm(at), f"a place where the whole {what} is on the plate"
            )
        near = np.sort(tree.query_ball_point(at, (radius + largest) * (1.0 + 1e-9)))
        near = near[near < index]
        apart = np.hypot(*(centres[near] - at).T)
        touched = near[apart <= radius + radii[near]]
        if touched.size:
            other, far = discs[int(touched[0])], float(apart[apart <= radius + radii[near]][0])
            raise InputError(
                f"{name}.at_mm",
                in_mm(at),
                f"a place clear of {other[0]}",
                hint=f"their middles are {far / MM:.4g} mm apart and need more than "
                f"{(radius + other[2]) / MM:.4g}",
            )


def closest(board: BoardParts) -> str:
    """The two features, or the feature and the edge, with the smallest gap between them.

    Empty where there is nothing on the plate. In words, for messages: where a field is hard to
    follow it is mostly there.
    """
    discs = _discs(board)
    if not discs:
        return ""
    centres, radii = _centres_and_radii(discs)
    to_edge = (np.array(board.plate.size) / 2.0 - np.abs(centres)).min(axis=1) - radii
    gaps = [(float(gap), discs[k][0], "the edge") for k, gap in enumerate(to_edge)]
    count = min(NEIGHBOURS + 1, len(discs))
    from scipy.spatial import cKDTree  # noqa: PLC0415  (as above)

    apart, which = cKDTree(centres).query(centres, k=count)
    apart, which = np.reshape(apart, (-1, count)), np.reshape(which, (-1, count))
    for k, (own, others) in enumerate(zip(apart, which, strict=True)):
        gaps += [
            (float(distance - radii[k] - radii[other]), discs[k][0], discs[other][0])
            for distance, other in zip(own, others, strict=True)
            if other != k
        ]
    gap, one, other = min(gaps)
    hint = f", {SOLVABLE_GAP / MM:g} mm would do" if gap < SOLVABLE_GAP else ""
    return f"{one} and {other} are {gap / MM:.3g} mm apart{hint}"


def _discs(board: BoardParts) -> list[tuple[str, tuple[float, float], float]]:
    """Everything that sits on the plate: (key in the file, place, radius), m."""
    discs = [
        (f"{section}[{i}]", feature.at, getattr(feature, "radius", 0.0))
        for section in FEATURES
        for i, feature in enumerate(getattr(board, section))
    ]
    if board.magnet:
        magnet = board.magnet.radius
        discs += [(f"actuators[{i}]", a.at, magnet) for i, a in enumerate(board.actuators)]
    return discs


def _centres_and_radii(
    discs: list[tuple[str, tuple[float, float], float]],
) -> tuple[FloatArray, FloatArray]:
    return np.array([at for _, at, _ in discs]), np.array([radius for _, _, radius in discs])


def _check_foundation(board: BoardParts) -> None:
    check_foundation(board, [disc for disc in _discs(board) if disc[2] > 0.0])


def _check_driver(board: BoardParts) -> None:
    check_driver(board.electronics)


def _check_measured(board: BoardParts) -> None:
    own = board.measured
    if own is None:
        return
    for key, text in (("by", own.by), ("date", own.date)):
        if not isinstance(text, str) or not text:
            raise InputError(f"measured.{key}", text, "a text")
    try:
        datetime.date.fromisoformat(own.date)
    except ValueError:
        raise InputError("measured.date", own.date, "a day, such as 2026-11-26") from None
    for index, value in enumerate(own.values):
        where = f"measured.values[{index}]"
        check_ranges(value, where)
        if not isinstance(value.name, str) or not value.name:
            raise InputError(f"{where}.name", value.name, "a text")
        if not value.low <= value.ratio <= value.high:
            raise InputError(f"{where}.ratio", value.ratio, f"{value.low:g} to {value.high:g}")


_OF_VALUES = (_check_name, check_plate, _check_ranges)
_OF_THE_WHOLE = (
    check_coil, _check_supports, check_panel, _check_focus, check_actuators, _check_driver,
    _check_pins, _check_places, _check_foundation, _check_sizes, _check_measured,
)  # fmt: skip
