"""Tolerances of a board's parts, and boards drawn at random within them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.catalogue import RUBBER
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]

FOAM, FORCE = 0.20, 0.05
"""± shares: of foam's stiffness by its compression, of a coil's force by the magnet's Br (1.5 %)
and the gap (5 % for 0.1 mm, docs/parts.md)."""
COIL_PLACE = 0.5e-3
"""± m, along both axes, of a magnet glued by hand."""
SHEET_THICKNESS, SHEET_MODULUS = 0.05, 0.10
"""± shares of one sheet that was measured once; sheets among each other differ by more
(sensitivity.py)."""
SOFT_SCREW, SOFT_SCREW_TILT = 2e6, 0.8
"""N/m and N·m/rad of a nylon stand-off M2.5 of 6 mm: EA/l and EI/l at 2.5 GPa."""
TRIES = 100
DRAWN_TOLERANCE = 1e-2
"""Of the fields of boards that are drawn or compared: they come out good to 1e-3, which is 0.01 dB,
in less than half the time."""


@dataclass(frozen=True)
class Drawn:
    """A board as it may come out, and its coils' forces over the nominal, shape (actuators,)."""

    board: Board
    forces: FloatArray


def drawn_boards(board: Board, count: int, seed: int) -> Iterator[Drawn]:
    """Boards of which everything is off at once, each value uniform within its tolerance.

    Raises
    ------
    InputError
        No board can be built within the tolerances.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield _drawn(board, rng)


def _drawn(board: Board, rng: np.random.Generator) -> Drawn:
    actuators = len(board.actuators)
    for _ in range(TRIES):
        thickness, modulus, foam = 1.0 + rng.uniform(-1.0, 1.0, 3) * (
            SHEET_THICKNESS,
            SHEET_MODULUS,
            FOAM,
        )
        moves = COIL_PLACE * rng.uniform(-1.0, 1.0, (actuators, 2))
        forces = 1.0 + FORCE * rng.uniform(-1.0, 1.0, actuators)
        # Where magnets stand close, a draw in which they touch is drawn again.
        with suppress(InputError):
            plate = replace(
                board.plate,
                thickness=float(thickness) * board.plate.thickness,
                youngs_modulus=float(modulus) * board.plate.youngs_modulus,
            )
            own = with_foam(replace(board, plate=plate), float(foam))
            if board.springs:
                own = with_feet(own, 1.0 + RUBBER * rng.uniform(-1.0, 1.0, len(board.springs)))
            return Drawn(with_moved_coils(own, moves), forces)
    raise InputError("actuators", "coils that touch", f"room for ±{COIL_PLACE * 1e3:g} mm")


def with_foam(board: Board, factor: float) -> Board:
    """The board on foam so many times as stiff; the same where it lies on none."""
    foundation = board.foundation
    if foundation is None or not foundation.sheet_stiffness:
        return board
    return replace(board, foundation=foundation.stiffer(factor))


def with_feet(board: Board, factors: FloatArray) -> Board:
    """The board on feet each so many times as stiff."""
    feet = zip(board.springs, factors.tolist(), strict=True)
    springs = tuple(replace(foot, stiffness=own * foot.stiffness) for foot, own in feet)
    return replace(board, springs=springs)


def with_soft_screws(board: Board, factor: float = 1.0) -> Board:
    """The board on stand-offs that give way: nylon ones, or the sprung ones of its file.

    Parameters
    ----------
    factor
        They are so many times as stiff.
    """
    screws = []
    for screw in board.screws:
        stiffness, tilt = screw.stiffness, screw.rotational_stiffness
        if screw.support != "sprung":
            stiffness = SOFT_SCREW
            tilt = SOFT_SCREW_TILT if screw.support == "clamped" else 0.0
        screws.append(
            replace(
                screw,
                support="sprung",
                stiffness=factor * stiffness,
                rotational_stiffness=factor * tilt,
            )
        )
    return replace(board, screws=tuple(screws))


def with_moved_coils(board: Board, moves: FloatArray) -> Board:
    """All coils off their places by moves (actuators, 2), m, as far as they stay on the board."""
    margin = board.magnet.radius * 1.01 if board.magnet else 0.0
    half = np.array(board.plate.size) / 2.0 - margin
    actuators = []
    for actuator, move in zip(board.actuators, moves, strict=True):
        x, y = np.clip(np.array(actuator.at) + move, -half, half).tolist()
        actuators.append(replace(actuator, at=(x, y)))
    return replace(board, actuators=tuple(actuators))
