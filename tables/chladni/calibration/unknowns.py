"""What of a board is not known: its values, how far they may be off, and the board that they make.

Ratios are fitted by their logarithms, so that a half and a double are as far off.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.hidden import (
    FEET,
    FOAM_LOSS,
    FOAM_SOFTEST,
    FOAM_STIFFEST,
    FORCE,
    PATCH,
    SCREW,
    SHEET_LOSS,
    foot_name,
)
from chladni.drives.scoring.tolerances import (
    COIL_PLACE,
    SHEET_MODULUS,
    SHEET_THICKNESS,
    with_feet,
    with_moved_coils,
    with_soft_screws,
)
from chladni.sim.board.board import Board
from chladni.sim.board.foundation import Patch
from chladni.sim.board.parts import Spring
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]

OF_SPACING, LEAST_PITCH = 0.5, 12e-3
"""Between patches of foam that are told apart: a share of what coils are apart, and m at least."""
UNIFORM = 1.0 / np.sqrt(3.0)
"""Standard deviation of what is uniform from −1 to 1."""
MOST_SCALE, MOST_PATCH, MOST_FOOT = 3.0, 2.5, 9.0
"""Of a scale's, a patch's and a foot's logarithm, either way: a foot may not touch."""
SMALLER = 10
"""Tries with smaller moves before coils stay where they are drawn."""
SCALES = ("sheet thickness", "modulus", "sheet's loss", "foam", "foam's loss", "screws", "feet")
"""Parameters of the whole board, in their order; boards without losses, foam, screws or
feet lack some."""


@dataclass(frozen=True)
class Unknowns:
    """The unknowns of one board, as a vector: scales, patches, feet, coils' places, coils' forces.

    Attributes
    ----------
    scales
        Which of `SCALES` the board has.
    patches
        Middles of patches of foam, m.
    mean, spread
        Of all values before anything was measured: shape (unknowns,).
    """

    board: Board
    scales: tuple[str, ...]
    patches: tuple[tuple[float, float], ...]
    mean: FloatArray
    spread: FloatArray

    @property
    def patch_values(self) -> slice:
        """Logarithms of patches' ratios."""
        return slice(len(self.scales), len(self.scales) + len(self.patches))

    @property
    def foot_values(self) -> slice:
        """Logarithms of what each foot is over all of them."""
        first = self.patch_values.stop
        return slice(first, first + len(uneven_feet(self.board)))

    def is_foot(self, value: int) -> bool:
        """Whether this value is a foot's."""
        own = self.foot_values
        return bool(own.start <= value < own.stop)

    @property
    def places(self) -> slice:
        """Coils' moves, x and y of each, m."""
        first = self.foot_values.stop
        return slice(first, first + 2 * len(self.board.actuators))

    @property
    def forces(self) -> slice:
        """Logarithms of coils' strengths."""
        return slice(self.places.stop, self.mean.size)

    @property
    def names(self) -> list[str]:
        """Of all values, in words."""
        coils = [own.name for own in self.board.actuators]
        moves = [f"{axis} of {own}" for own in coils for axis in ("x", "y")]
        patches = [f"foam at {x / MM:.0f}, {y / MM:.0f} mm" for x, y in self.patches]
        feet = map(foot_name, uneven_feet(self.board))
        return [*self.scales, *patches, *feet, *moves, *(f"force of {own}" for own in coils)]

    def board_at(self, values: FloatArray) -> Board:
        """The board with these values: sheet, foam, screws, feet and places.

        Raises
        ------
        InputError
            There can be no such board.
        """
        board = self.board
        scales = np.exp(np.clip(values[: len(self.scales)], -MOST_SCALE, MOST_SCALE))
        by_name = dict(zip(self.scales, scales.tolist(), strict=True))
        if "screws" in by_name:
            board = with_soft_screws(board, by_name["screws"])
        if "feet" in by_name:
            each = np.exp(np.clip(values[self.foot_values], -MOST_FOOT, MOST_FOOT))
            feet = each if each.size else np.ones(len(board.springs))
            board = with_feet(board, by_name["feet"] * feet)
        plate = replace(
            board.plate,
            thickness=board.plate.thickness * by_name["sheet thickness"],
            youngs_modulus=board.plate.youngs_modulus * by_name["modulus"],
            loss_factor=board.plate.loss_factor * by_name.get("sheet's loss", 1.0),
        )
        board = replace(board, plate=plate)
        if "foam" in by_name and board.foundation is not None:
            own = board.foundation.stiffer(by_name["foam"])
            # A search may try what no board file takes.
            ratios = np.exp(np.clip(values[self.patch_values], -MOST_PATCH, MOST_PATCH)).tolist()
            board = replace(
                board,
                foundation=replace(
                    own,
                    loss_factor=own.sheet_loss_factor * by_name["foam's loss"],
                    patches=tuple(map(Patch, self.patches, ratios)),
                ),
            )
        return _with_moves(board, values[self.places].reshape(-1, 2))

    def strengths(self, values: FloatArray) -> FloatArray:
        """Of the coils, as numbers above 0, (actuators,)."""
        return np.asarray(np.exp(values[self.forces]))


def _with_moves(board: Board, moves: FloatArray) -> Board:
    """The board with its coils moved, or as far that way as windings do not overlap."""
    for _ in range(SMALLER):
        with suppress(InputError):
            return with_moved_coils(board, moves)
        moves = moves * 0.8
    return board


def uneven_feet(board: Board) -> tuple[Spring, ...]:
    """Feet that may differ from one another; one alone is all of them."""
    return board.springs if len(board.springs) > 1 else ()


def unknowns_of(board: Board, *, rigid: bool = False) -> Unknowns:
    """What of a board is not known, before anything was measured; screws are not, if `rigid`."""
    ratio = np.log(FOAM_STIFFEST / FOAM_SOFTEST) / 2.0
    known = {
        "sheet thickness": (0.0, SHEET_THICKNESS * UNIFORM),
        "modulus": (0.0, SHEET_MODULUS * UNIFORM),
        "sheet's loss": (0.0, SHEET_LOSS * UNIFORM),
        "foam": (float(np.log(FOAM_STIFFEST * FOAM_SOFTEST) / 2.0), ratio * UNIFORM),
        "foam's loss": (0.0, FOAM_LOSS * UNIFORM),
        "screws": (0.0, float(np.log(SCREW)) * UNIFORM),
        "feet": (0.0, float(np.log(FEET)) * UNIFORM),
    }
    foundation = board.foundation
    has_foam = foundation is not None and bool(foundation.sheet_stiffness)
    left_out = set() if has_foam else {"foam", "foam's loss"}
    left_out |= set() if board.plate.loss_factor > 0.0 else {"sheet's loss"}
    left_out |= set() if board.screws and not rigid else {"screws"}
    left_out |= set() if board.springs else {"feet"}
    scales = tuple(name for name in SCALES if name not in left_out)
    is_patchy = has_foam and foundation is not None and not foundation.sealed_air
    patches = _patch_places(board) if is_patchy else ()
    count = len(board.actuators)
    pairs = [known[name] for name in scales]
    pairs += [(0.0, float(np.log1p(PATCH)) * UNIFORM)] * (len(patches) + len(uneven_feet(board)))
    pairs += [(0.0, COIL_PLACE * UNIFORM)] * (2 * count) + [(0.0, FORCE * UNIFORM)] * count
    mean, spread = np.array(pairs).T
    return Unknowns(board, scales, patches, mean, spread)


def _patch_places(board: Board) -> tuple[tuple[float, float], ...]:
    """The middles of as many cells as coils can tell apart."""
    spacing = float(np.median(board.coils_apart.min(axis=1)))
    pitch = max(LEAST_PITCH, OF_SPACING * min(spacing, *board.plate.size))
    axes = []
    for side in board.plate.size:
        count = max(1, round(side / pitch))
        axes.append((((np.arange(count) + 0.5) / count - 0.5) * side).tolist())
    return tuple((x, y) for x in axes[0] for y in axes[1])
