"""A haptic board as data, checked: its plate, supports, coils, electronics and panel."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.checks import check_board
from chladni.sim.board.electronics import Area, Coil
from chladni.sim.board.fingers import FINGERS, LEAST_APART, USUAL, Active, Focus
from chladni.sim.board.panel_layer import PlateSection, plate_section
from chladni.sim.board.parts import FEATURES, BoardParts
from chladni.sim.board.quantity import MM, in_mm, quantities
from chladni.sim.errors import InputError, MissingError

FloatArray = NDArray[np.float64]

ROOM_APART = 0.8
"""Of an area's diagonal: in a square one pair in 200 lies as far apart, in a strip more."""


@dataclass(frozen=True)
class Board(BoardParts):
    """Everything the chain needs to know about a board; validated when made.

    Raises
    ------
    InputError
        A value out of range, an actuator or screw off the plate, two actuators at one place, …
    """

    def __post_init__(self) -> None:
        check_board(self)
        self._check_apart()

    def _check_apart(self) -> None:
        """Refuse fingers so far apart that hardly a pair of places is: none would be drawn."""
        if self.fingers_apart <= LEAST_APART:
            return
        sides = [high - low for low, high in self.active_area]
        most = ROOM_APART * math.hypot(*sides)
        if self.fingers_apart > most:
            share = f"{100 * ROOM_APART:.0f} % of the active area from corner to corner"
            area = " × ".join(f"{side / MM:.3g}" for side in sides)
            sensed = "" if self.panel is None else ", as far as the panel senses it"
            expected = f"at most {math.floor(most / MM)}, {share} ({area} mm{sensed})"
            raise InputError("fingers.apart_mm", self.fingers_apart / MM, expected)

    @property
    def x(self) -> FloatArray:
        """Image points along x, m."""
        return _axis(self.plate.size[0], self.image.points[0])

    @property
    def y(self) -> FloatArray:
        """Image points along y, m."""
        return _axis(self.plate.size[1], self.image.points[1])

    @cached_property
    def section(self) -> PlateSection:
        """The plate as it bends and moves: with the layer of a touch panel, if that is glued on."""
        return plate_section(self)

    @property
    def active_area(self) -> Area:
        """Where fingers are expected: the plate less the margin, as far as a panel senses it.

        Raises
        ------
        InputError
            The margin leaves nothing of the plate, or the panel nothing of that.
        """
        margin = (self.active or Active()).margin
        inner = [(margin - side / 2.0, side / 2.0 - margin) for side in self.plate.size]
        if any(low >= high for low, high in inner):
            half = min(self.plate.size) / 2.0 / MM
            expected = f"less than half the short side, {half:g}"
            raise InputError("active.margin_mm", margin / MM, expected)
        if self.panel is None:
            return inner[0], inner[1]
        x, y = (
            (max(own[0], sensed[0]), min(own[1], sensed[1]))
            for own, sensed in zip(inner, self.panel.area, strict=True)
        )
        if x[0] >= x[1] or y[0] >= y[1]:
            expected = "a panel that reaches over the plate's active area"
            raise InputError("panel.offset_mm", in_mm(self.panel.offset), expected)
        return x, y

    def is_active(self, x: float, y: float) -> bool:
        """Whether a place, m, lies in the active area, its border too."""
        sides = zip((x, y), self.active_area, strict=True)
        return all(low - 1e-9 <= along <= high + 1e-9 for along, (low, high) in sides)

    def wavelength(self, frequency_hz: float) -> float:
        """Bending wavelength λ = 2π (D/mω²)^(1/4) of an endless plate like this, m."""
        own, omega = self.section, 2.0 * np.pi * frequency_hz
        return float(2.0 * np.pi * (own.bending_stiffness / own.areal_mass / omega**2) ** 0.25)

    @property
    def known_coil(self) -> Coil:
        """Its `[coil]`, where there must be one.

        Raises
        ------
        MissingError
            There is none.
        """
        if self.coil is None:
            raise MissingError("[coil]", "the block of the actuator's figures")
        return self.coil

    @cached_property
    def coils_apart(self) -> FloatArray:
        """Of every pair of actuators, m, shape (actuators, actuators); endless on the diagonal."""
        places = np.array([actuator.at for actuator in self.actuators])
        apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
        np.fill_diagonal(apart, np.inf)
        return np.asarray(apart)

    @property
    def is_for_several(self) -> bool:
        """Whether it is made for several fingers, and for none alone."""
        return self.fingers is not None and self.focus is None

    @property
    def fingers_apart(self) -> float:
        """How far two of several fingers lie from each other at least, m."""
        return self.fingers.apart if self.fingers else LEAST_APART

    @property
    def known_as(self) -> str:
        """How its values are known, in words."""
        return "as drawn" if self.measured is None else "as measured"

    @property
    def has_magnetic_coupling(self) -> bool:
        """Whether it is known what coils and magnets do to those of other actuators."""
        return bool(
            len(self.actuators) > 1
            and self.winding
            and self.magnet
            and self.magnet.remanence
            and self.coil
            and self.coil.motion_acts_back
        )

    def fingerprint(self, objective: str | None = None) -> int:
        """Of what a build of tables reads from the board, and of nothing else, 64 bits.

        The lower 32 are of what drives of any objective depend on, with the limits in a table's
        header; the upper 32 of what those of `focus` depend on besides, 0 for the others. So a
        table of any objective can be told to be of a board (`is_of`). Names, pins, channels and
        what only scores depend on are in neither.

        Parameters
        ----------
        objective
            Of a table's drives; None for what any of them may read.
        """
        common = _hashed(_read_by_every_objective(self))
        own = max(_hashed(_read_by_focus(self)), 1) if objective in (None, "focus") else 0
        return own << 32 | common

    def fingerprint_of_0_2(self) -> int:
        """By which tables of 0.2.0 know their board: names are in it, and image points are not."""
        left_out = (
            "name", "electronics", "image", "coil", "winding", "panel", "active", "fingers",
            "measured", "sensing",
        )  # fmt: skip
        physical = {key: own for key, own in to_document(self).items() if key not in left_out}
        physical |= _of_layer_and_coils(self)
        for part, key in (
            ("plate", "material"),
            ("magnet", "remanence_t"),
            ("foundation", "patches"),
        ):
            physical.get(part, {}).pop(key, None)
        physical["actuators"] = [
            {key: value for key, value in actuator.items() if key not in ("polarity", "trim_db")}
            for actuator in physical["actuators"]
        ]
        return int.from_bytes(_digest(physical)[:8], "little")


def fingerprint_text(fingerprint: int) -> str:
    """For people: of a table without an objective the end alone, which its board's has too."""
    if fingerprint >> 32:
        return f"{fingerprint:#018x}"
    return f"…{fingerprint:08x}"


def is_of(one: int, other: int) -> bool:
    """Whether fingerprints of a table and of a board, or of a device's table, are of one board."""
    own, others = one >> 32, other >> 32
    return one % 2**32 == other % 2**32 and (own == others or not own or not others)


def _read_by_every_objective(board: Board) -> dict[str, Any]:
    """Numbers that decide the bytes of any table, in any order of keys."""
    document, electronics = to_document(board), board.electronics
    keys = ("plate", *FEATURES, "magnet", "drive", "image", "regions")
    numbers: dict[str, Any] = {key: document[key] for key in keys if key in document}
    numbers["plate"].pop("material", None)
    for own in (*numbers.get("screws", ()), *numbers.get("springs", ())):
        own.pop("part", None)
    numbers["actuators"] = [
        (*actuator.at, True) if actuator.is_dead else actuator.at for actuator in board.actuators
    ]
    numbers["limits"] = [electronics.ramp_ms, electronics.touch_timeout_ms, electronics.max_on_s]
    # Without a finger of its own a board is pressed by the usual one.
    numbers["finger"] = dataclasses.astuple(board.finger or FINGERS[USUAL])
    if board.magnet is not None:
        # How strong a magnet is matters to the others; that it is known, to how it tilts.
        numbers["magnet"]["remanence_t"] = bool(board.magnet.remanence)
    if board.foundation is not None:
        own = board.foundation
        numbers["foundation"] = [
            own.total_stiffness,
            own.total_loss_factor,
            own.coil_cut_out,
            dataclasses.astuple(own.strips),
            [dataclasses.astuple(cut) for cut in own.cut_outs],
        ]
        # Boards without patches have the fingerprint that they had before there were any.
        numbers["foundation"] += [dataclasses.astuple(patch) for patch in own.patches]
    return numbers | _of_layer_and_coils(board)


def _of_layer_and_coils(board: Board) -> dict[str, Any]:
    """What a panel's layer adds to the plate, and coils to each other's forces."""
    numbers: dict[str, Any] = {}
    if board.panel is not None and board.panel.layer_thickness:
        numbers["section"] = dataclasses.astuple(board.section)
    if board.has_magnetic_coupling:
        # A fingerprint is of the key, too.
        numbers["beside"] = [
            dataclasses.astuple(part) for part in (board.winding, board.magnet) if part
        ]
    if board.coil is not None and board.coil.motion_acts_back:
        numbers["coil"] = [board.coil.resistance, board.coil.inductance, board.coil.force_factor]
    return numbers


def _read_by_focus(board: Board) -> dict[str, Any]:
    """What decides drives of `focus` besides: what they keep to, and the most that coils push."""
    asked, own = board.focus or Focus(), board.electronics
    kept_to = dataclasses.astuple(dataclasses.replace(asked, foam_ratio=1.0))
    numbers: dict[str, Any] = {"focus": kept_to}
    if board.foundation is not None:
        stiffer = board.foundation.stiffer(asked.foam_ratio)
        numbers["foundation"] = [stiffer.total_stiffness, stiffer.total_loss_factor]
    if board.coil is not None:
        coil = board.coil
        numbers["full_drive"] = [
            coil.resistance, coil.inductance, coil.force_factor, own.pwm_bits, own.shortest_on_ns,
            own.max_duty, own.supply_v, own.supply_limit_ma, own.coil_ohm, own.coil_k_per_w,
            own.coil_limit_k,
        ]  # fmt: skip
        if own.is_bridge:
            numbers["full_drive"] += [own.drive, own.bridge_ohm]
    return numbers


def _hashed(numbers: dict[str, Any]) -> int:
    return int.from_bytes(_digest(numbers)[:4], "little")


def _digest(numbers: dict[str, Any]) -> bytes:
    text = json.dumps(numbers, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).digest()


def _axis(length: float, count: int) -> FloatArray:
    """`count` points from −length/2 to length/2, exactly symmetric."""
    half = (np.arange(count) - (count - 1) / 2.0) / (count - 1)
    return np.asarray(half * length)


def document_digest(board: Board) -> str:
    """Of all that a board's file says: 16 hexadecimal digits, in which two files hardly agree."""
    return _digest(to_document(board)).hex()[:16]


def to_document(board: Board) -> dict[str, Any]:
    """A board as the document its file would hold, in the file's units."""

    def table(part: Any) -> dict[str, Any]:
        specs = quantities(part)
        result: dict[str, Any] = {}
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            spec = specs.get(field.name)
            if spec is None and dataclasses.is_dataclass(value):
                result[field.name] = table(value)
            elif spec is None and isinstance(value, tuple):
                result[field.name] = [table(entry) for entry in value]
            elif (spec and spec.is_written) or value != field.default:
                result[spec.key if spec else field.name] = spec.from_si(value) if spec else value
        return result

    document: dict[str, Any] = {"name": board.name, "plate": table(board.plate)}
    for section in FEATURES:
        if getattr(board, section):
            document[section] = [table(feature) for feature in getattr(board, section)]
    if board.magnet:
        document["magnet"] = table(board.magnet)
    for section in (
        "coil",
        "winding",
        "panel",
        "sensing",
        "foundation",
        "finger",
        "focus",
        "active",
        "fingers",
        "measured",
    ):
        if getattr(board, section):
            document[section] = table(getattr(board, section))
    document["actuators"] = [table(actuator) for actuator in board.actuators]
    for section in ("drive", "image", "regions", "electronics"):
        document[section] = table(getattr(board, section))
    return document
