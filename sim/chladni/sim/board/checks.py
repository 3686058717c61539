"""What a board may be, each fault named by its key: values, sizes, and room on the plate."""

from __future__ import annotations

import datetime
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.catalogue import LABEL_PATTERN
from chladni.sim.board.coil_checks import check_actuators, check_coil, check_driver, check_pins
from chladni.sim.board.panel_layer import check_panel
from chladni.sim.board.parts import EDGE_KINDS, FEATURES, BoardParts
from chladni.sim.board.quantity import CENTIMETRES, MM, check_ranges, in_mm
from chladni.sim.board.support_checks import (
    check_foundation,
    check_supports,
    is_rounded_off,
    said_of_corners,
)
from chladni.sim.errors import Faults, InputError, MissingError

FloatArray = NDArray[np.float64]
NEIGHBOURS = 8
"""Of a feature that are looked at for the closest one; a small one has no more that are close."""
SOLVABLE_GAP = 0.6e-3
"""Gap between features, m, at which every pair that was tried could be followed."""
FILLED = 0.3
"""Of half a side: at least so far out are the outer coils of a board."""
NAME_PATTERN = re.compile(r"[A-Za-z0-9_-]{1,15}")
"""A board's name goes into 16 bytes of the table, with an ending zero."""


def check_board(board: BoardParts) -> None:
    """Raise `InputError` that names all wrong values of a board; without any, what does not fit."""
    for checks in (_OF_VALUES, (_check_unit,), _OF_THE_WHOLE):
        faults = Faults()
        for check in checks:
            with faults.kept():
                check(board)
        faults.tell()


def _check_name(board: BoardParts) -> None:
    if not isinstance(board.name, str) or not NAME_PATTERN.fullmatch(board.name):
        raise InputError("name", board.name, "1 to 15 letters, digits, '-' or '_'")


def _check_plate(board: BoardParts) -> None:
    """Refuse edges that are held in no way there is, and a material with no name for a list."""
    for edge, kind in board.plate.edges.kinds().items():
        if kind not in EDGE_KINDS:
            expected = "one of: " + ", ".join(map(repr, EDGE_KINDS))
            raise InputError(f"plate.edges.{edge}", kind, expected)
    material = board.plate.material
    if not isinstance(material, str) or not LABEL_PATTERN.fullmatch(material):
        raise InputError("plate.material", material, "up to 40 letters, digits, spaces or .,+-/()")


def _check_ranges(board: BoardParts) -> None:
    faults = Faults()
    for section in (
        "plate",
        "magnet",
        "coil",
        "winding",
        "panel",
        "sensing",
        "foundation",
        "finger",
        "drive",
        "image",
        "regions",
        "electronics",
        "focus",
        "active",
        "fingers",
    ):
        part = getattr(board, section)
        if part is not None:
            with faults.kept():
                check_ranges(part, section)
    for section in (*FEATURES, "actuators"):
        for index, feature in enumerate(getattr(board, section)):
            with faults.kept():
                check_ranges(feature, f"{section}[{index}]")
    faults.tell()


def _check_unit(board: BoardParts) -> None:
    """Ask about centimetres where most coils lie off the plate and fill one ten times as large.

    All that follows from so small a plate would only hide it.
    """
    if 2 * sum(board.contains(*own.at) for own in board.actuators) >= len(board.actuators):
        return
    if _lie_on_the_turned_plate(board):
        return
    shares = np.abs([own.at for own in board.actuators]) / (5.0 * np.array(board.plate.size))
    if FILLED <= np.max(shares) <= 1.0:
        size = [side / MM for side in board.plate.size]
        raise InputError("plate.size_mm", size, "a plate that the coils lie on", hint=CENTIMETRES)


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


def _lie_on_the_turned_plate(board: BoardParts) -> bool:
    half = np.array(board.plate.size[::-1]) / 2.0
    return bool(np.all(np.abs([own.at for own in board.actuators]) < half))


def _check_places(board: BoardParts) -> None:
    half = np.array(board.plate.size) / 2.0
    off = [k for k, own in enumerate(board.actuators) if not board.contains(*own.at)]
    hint = "are plate.size_mm millimetres?" if len(off) > 1 else ""
    if len(off) > 1 and _lie_on_the_turned_plate(board):
        hint = "are the sides of plate.size_mm swapped? x comes first"
    faults = Faults()
    for index in off:
        with faults.kept():
            raise InputError(
                f"actuators[{index}].at_mm",
                in_mm(board.actuators[index].at),
                f"a place on the plate: |x| up to {half[0] / MM:g}, |y| up to {half[1] / MM:g}",
                hint=hint,
            )
    faults.tell()
    discs = _discs(board)
    if not discs:
        return
    centres, radii = _centres_and_radii(discs)
    # A third of a second of SciPy, which a device without parts on its plate does not need.
    from scipy.spatial import cKDTree  # noqa: PLC0415

    tree, largest = cKDTree(centres), float(radii.max())
    for index, (name, at, radius) in enumerate(discs):
        inside = np.abs(at) + radius < half if radius > 0.0 else np.abs(at) <= half + 1e-9
        rounded_off = is_rounded_off(board.plate, at, radius)
        if not np.all(inside) or rounded_off:
            what = "magnet" if name.startswith("actuators") else name.split("[")[0].rstrip("s")
            to, (x, y) = "below" if radius > 0.0 else "up to", (half - radius) / MM
            raise InputError(
                f"{name}.at_mm",
                in_mm(at),
                f"a place where the whole {what} is on the plate: |x| {to} {x:g}, |y| {to} {y:g}",
                hint=said_of_corners(board.plate) if rounded_off else "",
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
    _check_origin(own.by, own.date, "measured")
    for index, value in enumerate(own.values):
        where = f"measured.values[{index}]"
        check_ranges(value, where)
        by, date = value.by, value.date
        _check_origin(own.by if by is None else by, own.date if date is None else date, where)
        if not isinstance(value.name, str) or not value.name:
            raise InputError(f"{where}.name", value.name, "a text")
        if not value.low <= value.ratio <= value.high:
            raise InputError(f"{where}.ratio", value.ratio, f"{value.low:g} to {value.high:g}")
    pair = {"before": own.before, "after": own.after}
    for key, isolation in pair.items():
        if isolation is not None:
            check_ranges(isolation, f"measured.{key}")
        elif any(pair.values()):
            raise MissingError(f"measured.{key}", "before goes with after")


def _check_origin(by: object, date: object, where: str) -> None:
    for key, text in (("by", by), ("date", date)):
        if not isinstance(text, str) or not text:
            raise InputError(f"{where}.{key}", text, "a text")
    try:
        datetime.date.fromisoformat(str(date))
    except ValueError:
        raise InputError(f"{where}.date", date, "a day, such as 2026-11-26") from None


_OF_VALUES = (_check_name, _check_plate, _check_ranges)
_OF_THE_WHOLE = (
    check_coil, check_supports, check_panel, _check_focus, check_actuators, _check_driver,
    check_pins, _check_places, _check_foundation, _check_sizes, _check_measured,
)  # fmt: skip


def named(document: dict[str, Any], file: str) -> dict[str, Any]:
    """A board called like its file, where it has no name of its own and that can be one."""
    stem = Path(file).stem
    return {"name": stem} | document if NAME_PATTERN.fullmatch(stem) else document
