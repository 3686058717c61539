"""A haptic board as data, checked: its plate, supports, coils, electronics and panel."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.checks import check_board
from chladni.sim.board.panel_layer import Section, plate_section
from chladni.sim.board.parts import FEATURES, BoardParts
from chladni.sim.board.quantity import quantities

FloatArray = NDArray[np.float64]


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

    @property
    def x(self) -> FloatArray:
        """Image points along x, m."""
        return _axis(self.plate.size[0], self.image.points[0])

    @property
    def y(self) -> FloatArray:
        """Image points along y, m."""
        return _axis(self.plate.size[1], self.image.points[1])

    @cached_property
    def section(self) -> Section:
        """The plate as it bends and moves: with the layer of a touch panel, if that is glued on."""
        return plate_section(self)

    def wavelength(self, frequency_hz: float) -> float:
        """Bending wavelength λ = 2π (D/mω²)^(1/4) of an endless plate like this, m."""
        own, omega = self.section, 2.0 * np.pi * frequency_hz
        return float(2.0 * np.pi * (own.bending_stiffness / own.areal_mass / omega**2) ** 0.25)

    @property
    def pulls_beside(self) -> bool:
        """Whether it is known what coils and magnets do to those beside them."""
        return bool(
            len(self.actuators) > 1
            and self.winding
            and self.magnet
            and self.magnet.remanence
            and self.coil
            and self.coil.motion_acts_back
        )

    def fingerprint(self) -> int:
        """64 bits of the SHA-256 of what drives depend on.

        Plate and what it lies on, actuators, frequency, regions, the finger, what a focus keeps to,
        of coils that move what their motion does to their current, and of windings and magnets what
        they do to those beside them.
        """
        physical = {
            key: value
            for key, value in to_document(self).items()
            if key not in ("name", "electronics", "image", "coil", "winding", "panel", "active")
        }
        if self.panel is not None and self.panel.layer_thickness:
            physical["section"] = dataclasses.astuple(self.section)
        if self.pulls_beside:
            physical["beside"] = [
                dataclasses.astuple(part) for part in (self.winding, self.magnet) if part
            ]
        for part, key in (("plate", "material"), ("magnet", "remanence_t")):
            physical.get(part, {}).pop(key, None)
        if self.coil is not None and self.coil.motion_acts_back:
            own = self.coil
            physical["coil"] = [own.resistance, own.inductance, own.force_factor]
        physical["actuators"] = [
            {key: value for key, value in actuator.items() if key not in ("polarity", "trim_db")}
            for actuator in physical["actuators"]
        ]
        text = json.dumps(physical, sort_keys=True, separators=(",", ":"))
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")


def _axis(length: float, count: int) -> FloatArray:
    """`count` points from −length/2 to length/2, exactly symmetric."""
    half = (np.arange(count) - (count - 1) / 2.0) / (count - 1)
    return np.asarray(half * length)


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
            elif field.default is dataclasses.MISSING or value != field.default:
                result[spec.key if spec else field.name] = spec.from_si(value) if spec else value
        return result

    document: dict[str, Any] = {"name": board.name, "plate": table(board.plate)}
    for section in FEATURES:
        if getattr(board, section):
            document[section] = [table(feature) for feature in getattr(board, section)]
    if board.magnet:
        document["magnet"] = table(board.magnet)
    for section in ("coil", "winding", "panel", "foundation", "finger", "focus", "active"):
        if getattr(board, section):
            document[section] = table(getattr(board, section))
    document["actuators"] = [table(actuator) for actuator in board.actuators]
    for section in ("drive", "image", "regions", "electronics"):
        document[section] = table(getattr(board, section))
    return document
