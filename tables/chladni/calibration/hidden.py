"""The plate that no tool can see: a board as it may really have come out, drawn from a seed.

Everything that calibration finds is tested against such plates alone. What is drawn is wider than
the tolerances of a score (`drives/scoring/tolerances.py`): it is what no one has measured yet.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.drives.scoring.tolerances import (
    COIL_PLACE,
    SHEET_MODULUS,
    SHEET_THICKNESS,
    TRIES,
    Drawn,
    with_feet,
    with_moved_coils,
    with_soft_screws,
)
from chladni.drives.scoring.warm_coils import COPPER
from chladni.sim.board.board import Board
from chladni.sim.board.catalogue import RUBBER
from chladni.sim.board.foundation import Patch
from chladni.sim.board.parts import Plate, Spring
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import strengths
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]

FOAM_SOFTEST, FOAM_STIFFEST = 1.0 / 1.5, 4.0
"""Foam at 160 Hz over its data sheet's slow compression."""
FOAM_LOSS = 0.3
"""± share of its loss factor, which data sheets do not have."""
PATCH, PATCH_PITCH = 0.5, 15e-3
"""Glue and foam are up to a half stiffer, or softer in the same ratio, from patch to patch; m."""
SCREW = 3.0
"""Stand-offs are up to so many times as stiff as a nylon one, or so many times softer."""
FEET = 2.0
"""Rubber feet are up to so many times as stiff as drawn, or softer, all of one board alike."""
SHEET_LOSS = 0.3
"""± share of its loss factor."""
FORCE, OHMS = 0.20, 0.02
"""± shares of a coil's force per ampere and of its resistance."""
ROOM_K = 10.0
"""± from the 20 °C that coils' resistances are told at."""
REVERSED, DEAD = 1.0 / 4.0, 1.0 / 8.0
"""Shares of boards on which a coil is wired the wrong way round, and on which one is dead."""


@dataclass(frozen=True)
class HiddenPlate:
    """A board as it is, which only emulated hardware knows.

    Attributes
    ----------
    board
        Sheet, foam, screws and coils' places as they are.
    strengths
        Force per ampere of each coil over the drawn one, (actuators,): negative for one that is
        wired the wrong way round, 0 for a dead one.
    ohms
        Resistance of each coil over the drawn one, (actuators,).
    seed
        It was drawn from, or 0.
    name
        What reports call it.
    """

    board: Board
    strengths: FloatArray
    ohms: FloatArray
    seed: int
    name: str

    @property
    def forces(self) -> FloatArray:
        """Of each coil at a duty, over the drawn one."""
        return np.asarray(self.strengths / self.ohms)

    def on(self, known: Board) -> Drawn:
        """What drives of a device meet that takes the board to be `known`: this plate."""
        return Drawn(self.board, self.forces * strengths(self.board) / strengths(known))

    def ratios(self, drawn: Board) -> dict[str, float]:
        """What it really is over the drawn board, by the names of calibration's parameters.

        Foam is the mean of its patches' logarithms, feet that of theirs, as where they are fitted;
        feet are there one by one, too. What one of both boards lacks is left out.
        """
        true, soft = self.board, with_soft_screws(drawn)
        pairs = {
            "sheet thickness": (true.plate.thickness, drawn.plate.thickness),
            "modulus": (true.plate.youngs_modulus, drawn.plate.youngs_modulus),
            "sheet's loss": (true.plate.loss_factor, drawn.plate.loss_factor),
            "screws": tuple(sum(one.stiffness for one in own.screws) for own in (true, soft)),
            "feet": tuple(_even([one.stiffness for one in own.springs]) for own in (true, drawn)),
        }
        if true.foundation is not None and drawn.foundation is not None:
            patches = _even([own.ratio for own in true.foundation.patches] or [1.0])
            even = patches * true.foundation.sheet_stiffness
            pairs["foam"] = (even, drawn.foundation.sheet_stiffness)
            losses = [own.sheet_loss_factor for own in (true.foundation, drawn.foundation)]
            pairs["foam's loss"] = (losses[0], losses[1])
        # A plate of another version of the file may have fewer feet, or others.
        if len(true.springs) == len(drawn.springs):
            for own, of in zip(true.springs, drawn.springs, strict=True):
                pairs[foot_name(of)] = (own.stiffness, of.stiffness)
        return {name: float(own / of) for name, (own, of) in pairs.items() if own and of}


def foot_name(foot: Spring) -> str:
    """What reports call one of several."""
    return "foot at {:.0f}, {:.0f} mm".format(*(along / MM for along in foot.at))


def _even(values: list[float]) -> float:
    """By the mean of the logarithms; 0 of none."""
    return float(np.exp(np.mean(np.log(values)))) if values else 0.0


def hidden_plate(board: Board, seed: int) -> HiddenPlate:
    """Draw a plate; the same for the same board and seed.

    Raises
    ------
    InputError
        No such board can be built: coils touch whichever way they are moved.
    """
    rng = np.random.default_rng((seed, 43))
    count = len(board.actuators)
    for _ in range(TRIES):
        made = replace(_with_supports(board, rng), plate=_sheet(board, rng))
        moves = COIL_PLACE * rng.uniform(-1.0, 1.0, (count, 2))
        with suppress(InputError):
            made = with_moved_coils(made, moves)
            break
    else:
        raise InputError("actuators", "coils that touch", f"room for ±{COIL_PLACE * 1e3:g} mm")
    strengths = 1.0 + FORCE * rng.uniform(-1.0, 1.0, count)
    first, second = rng.permutation(count)[:2] if count > 1 else (0, 0)
    if rng.random() < REVERSED:
        strengths[first] *= -1.0
    if rng.random() < DEAD and count > 1:
        strengths[second] = 0.0
    ohms = 1.0 + OHMS * rng.uniform(-1.0, 1.0, count)
    room, loss = rng.uniform(-1.0, 1.0, 2)
    ohms *= 1.0 + COPPER * ROOM_K * room
    lossy = replace(made.plate, loss_factor=(1.0 + SHEET_LOSS * loss) * made.plate.loss_factor)
    return HiddenPlate(replace(made, plate=lossy), strengths, ohms, seed, f"plate {seed}")


def given_plate(drawn: Board, given: Board) -> HiddenPlate:
    """The plate that another version of a board's file describes.

    Its coils' polarities and forces are what they come out as, not what its device knows.

    Raises
    ------
    MissingError
        A board has no `[coil]`.
    """
    strengths, actuators = [], []
    for own, before in zip(given.actuators, drawn.actuators, strict=True):
        lives = not (own.is_dead or before.is_dead)
        strengths.append(own.strength / before.strength if lives else 0.0)
        actuators.append(replace(before, at=own.at))
    ohms = given.known_coil.resistance / drawn.known_coil.resistance
    made = replace(given, actuators=tuple(actuators))
    return HiddenPlate(
        made, np.array(strengths), np.full(len(strengths), ohms), 0, f"the plate of {given.name}"
    )


def _sheet(board: Board, rng: np.random.Generator) -> Plate:
    thickness, modulus = 1.0 + rng.uniform(-1.0, 1.0, 2) * (SHEET_THICKNESS, SHEET_MODULUS)
    plate = board.plate
    return replace(
        plate,
        thickness=float(thickness) * plate.thickness,
        youngs_modulus=float(modulus) * plate.youngs_modulus,
    )


def _with_supports(board: Board, rng: np.random.Generator) -> Board:
    """On foam of another stiffness, in patches, on other feet, and on stand-offs that give way."""
    stiffness = float(SCREW ** rng.uniform(-1.0, 1.0))
    board = with_soft_screws(board, stiffness)
    if board.springs:
        stiffness = float(FEET ** rng.uniform(-1.0, 1.0))
        # A stream of their own, so that what else is drawn does not depend on how many there are.
        each = 1.0 + RUBBER * rng.spawn(1)[0].uniform(-1.0, 1.0, len(board.springs))
        board = with_feet(board, stiffness * each)
    own = board.foundation
    low, high = np.log((FOAM_SOFTEST, FOAM_STIFFEST))
    even = float(np.exp(rng.uniform(low, high)))
    loss = float(1.0 + FOAM_LOSS * rng.uniform(-1.0, 1.0))
    if own is None or not own.sheet_stiffness:
        return board
    patches = _patches(board, rng) if not own.sealed_air else ()
    foam = replace(own.stiffer(even), loss_factor=loss * own.sheet_loss_factor, patches=patches)
    return replace(board, foundation=foam)


def _patches(board: Board, rng: np.random.Generator) -> tuple[Patch, ...]:
    places = [
        np.linspace(-side / 2.0, side / 2.0, max(2, round(side / PATCH_PITCH) + 1))
        for side in board.plate.size
    ]
    most = np.log1p(PATCH)
    return tuple(
        Patch((float(x), float(y)), float(np.exp(rng.uniform(-most, most))))
        for x in places[0]
        for y in places[1]
    )
