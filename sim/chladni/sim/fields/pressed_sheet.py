"""What fingers that press change in a board's fields, where they bend a thin sheet on foam.

The sheet is solved in splines (`sim/pressed`), free and pressed, and the difference is what counts:
3 to 5 % of the difference is wrong where as much of the field itself would hide a focus.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.fingers import FINGERTIP_RADIUS
from chladni.sim.board.foundation import MATERIALS
from chladni.sim.board.parts import FEATURES
from chladni.sim.fields.board_plate import plate_geometry
from chladni.sim.pressed.press import Equilibrium, flat, press, vibration
from chladni.sim.pressed.sheet import Foam, SplineSheet

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Place = tuple[float, float]

ELEMENT = 2.0 / 3.0
"""Of a magnet's radius. Half of it moves what a press of 1 N changes by a fiftieth (`quiet16`)."""
ACROSS = 12
"""Elements across a sheet's shorter side at least, for narrow strips."""
THIN = 0.3
"""Deflection over thickness from which on a press stretches the sheet: below, tension adds less
than a tenth to its stiffness."""
SOLID_DENSITY = 1200.0
"""kg/m³, of polyurethane without pores."""
FULL_STRAIN = 0.7
"""Of foam whose density is not known."""


def is_thin(board: Board, newtons: float) -> bool:
    """Whether a press stretches the board's sheet: one on foam alone, bent by a third of itself.

    The deflection is that of an endless plate under a point, F/(8 √(kD)).
    """
    held = any(getattr(board, name) for name in FEATURES if name != "actuators")
    free = board.plate.edges.are_all("free") and not board.plate.corner_radius
    if board.foundation is None or board.magnet is None or held or not free:
        return False
    stiffness = board.foundation.total_stiffness * board.section.bending_stiffness
    return bool(newtons / (8.0 * np.sqrt(stiffness)) > THIN * board.plate.thickness)


@dataclass(frozen=True)
class PressingFingers:
    """Their places (m), how hard each presses (N), and its force over displacement (N/m)."""

    places: tuple[Place, ...]
    newtons: float
    stiffness: complex


class PressedSheet:
    """A board's sheet in splines, which remembers how it lies under fingers."""

    def __init__(self, board: Board) -> None:
        assert board.magnet is not None
        self.board = board
        self._sheet = SplineSheet(
            plate_geometry(board),
            board.section.stretching_stiffness,
            foam_of(board),
            min(ELEMENT * board.magnet.radius, min(board.plate.size) / ACROSS),
        )
        self._image = self._sheet.at(board.x, board.y)
        self._loads = np.stack(
            [self._sheet.mean(*own.at, board.magnet.radius) for own in board.actuators], axis=1
        )
        self._rest: dict[tuple[tuple[Place, ...], float], Equilibrium] = {}
        self._free: dict[float, ComplexArray] = {}

    @cached_property
    def _flat(self) -> Equilibrium:
        return flat(self._sheet)

    def at_rest(self, fingers: PressingFingers) -> Equilibrium:
        """The sheet under fingers; foam gives way as slowly as its data sheet says."""
        key = (fingers.places, fingers.newtons)
        if key not in self._rest:
            softer = [newtons for places, newtons in self._rest if places == fingers.places]
            # From the next softer press on it is fewer steps.
            nearest = max((own for own in softer if own < fingers.newtons), default=None)
            start = self._flat if nearest is None else self._rest[fingers.places, nearest]
            load = self._touches(fingers).sum(axis=1)
            self._rest[key] = press(self._sheet, load, fingers.newtons, start)
        return self._rest[key]

    def deflection(self, fingers: PressingFingers) -> float:
        """Mean under all of them, m."""
        return float((self.at_rest(fingers).deflection @ self._touches(fingers)).mean())

    def _touches(self, fingers: PressingFingers) -> FloatArray:
        """A newton of each, shape (splines, fingers)."""
        own = [self._sheet.mean(*place, FINGERTIP_RADIUS) for place in fingers.places]
        return np.stack(own, axis=1)

    def change(self, fingers: PressingFingers, *, foam_factor: float = 1.0) -> ComplexArray:
        """By what the field of each unit force changes, shape (actuators, nx, ny), m/N.

        Parameters
        ----------
        foam_factor
            Dynamic over static stiffness of the foam.
        """
        if foam_factor not in self._free:
            self._free[foam_factor] = self._fields(self._flat, foam_factor, None)
        touches = (self._touches(fingers), fingers.stiffness)
        under = self._fields(self.at_rest(fingers), foam_factor, touches)
        return np.asarray(under - self._free[foam_factor])

    def _fields(
        self, at: Equilibrium, foam_factor: float, fingers: tuple[FloatArray, complex] | None
    ) -> ComplexArray:
        board = self.board
        found = vibration(
            self._sheet,
            at,
            self._loads,
            2.0 * np.pi * board.drive.frequency_hz,
            loss_factor=board.section.loss_factor,
            foam_factor=foam_factor,
            fingers=fingers,
        )
        return np.asarray((self._image @ found).T.reshape(-1, board.x.size, board.y.size))


def foam_of(board: Board) -> Foam:
    """What a board lies on, with the strain at which it is solid."""
    own = board.foundation
    assert own is not None
    density = MATERIALS[own.material].density if own.material else None
    # ε_D = 1 − 1.4 ρ/ρ_s (Gibson and Ashby).
    full = 1.0 - 1.4 * density / SOLID_DENSITY if density else FULL_STRAIN
    thickness = own.thickness if own.material and not own.sealed_air else 0.0
    return Foam(own.total_stiffness, own.total_loss_factor, thickness, full)
