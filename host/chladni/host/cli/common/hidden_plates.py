"""`--hidden`: the plate that an emulated device is on, which no file tells."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from chladni.calibration.hidden import HiddenPlate, given_plate, hidden_plate
from chladni.host.cli.common.ranges import MOST_SEED
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError

MOST_OFF = 5e-3
"""m from a coil to the same one of a plate: coils are built within half a millimetre."""
SHAPES = "SEED, BOARD@SEED or FILE.toml"


def named_plate(board: Board, asked: str | None) -> HiddenPlate | None:
    """The plate of SEED, BOARD@SEED or a file, if one is asked for.

    A file that was measured is not what seeds are drawn from.

    Raises
    ------
    InputError
        There is no such plate, or it is another board's.
    """
    if asked is None:
        return None
    name, at, seed = asked.rpartition("@")
    if asked.endswith(".toml") and not at:
        if not Path(asked).exists():
            raise InputError("--hidden", f"no file {asked}", SHAPES)
        given = load_board(asked, "hidden")
        _check_alike(board, given, asked)
        return replace(given_plate(board, given), name=f"the plate of {Path(asked).name}")
    if not (seed.isascii() and seed.isdigit() and int(seed) <= MOST_SEED):
        expected = f"{SHAPES}, a seed from 0 to {MOST_SEED}"
        raise InputError("--hidden", asked, expected)
    if board.measured is not None and not at:
        hint = f"name the board that was calibrated, as in --hidden BOARD@{seed}"
        raise InputError("--hidden", asked, "BOARD@SEED with a board that was measured", hint=hint)
    plate = hidden_plate(_named(board, name) if at else board, int(seed))
    _check_alike(board, plate.board, asked)
    return plate


def _named(board: Board, name: str) -> Board:
    """A shipped board, that of a file, or the one beside which it is named."""
    try:
        return load_board(name, "hidden")
    except InputError:
        if name == board.name and board.measured is None:
            return board
        raise


def _check_alike(board: Board, other: Board, asked: str) -> None:
    """Refuse a plate of another board: what is played on it would look like a bad calibration."""
    if (other.plate.size, len(other.actuators)) != (board.plate.size, len(board.actuators)):
        raise InputError("--hidden", asked, f"a board of the size and coils of {board.name}")
    pairs = list(zip(board.actuators, other.actuators, strict=True))
    own, there = max(pairs, key=lambda pair: math.dist(pair[0].at, pair[1].at))
    if (off := math.dist(own.at, there.at)) > MOST_OFF:
        expected = f"a plate of {board.name}, each coil within {MOST_OFF / MM:g} mm of its place"
        hint = f"{there.name} lies {off / MM:.3g} mm off: is it another board, or another order?"
        raise InputError("--hidden", asked, expected, hint=hint)
