"""`--hidden`: the plate that an emulated device is on, which no file tells."""

from __future__ import annotations

from chladni.calibration.hidden import HiddenPlate, hidden_plate
from chladni.host.cli.common.ranges import MOST_SEED
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError


def named_plate(board: Board, asked: str | None) -> HiddenPlate | None:
    """The plate of SEED or BOARD@SEED, if one is asked for.

    A file that was measured is not what it is drawn from.

    Raises
    ------
    InputError
        There is no such plate, or it is another board's.
    """
    if asked is None:
        return None
    name, at, seed = asked.rpartition("@")
    if not (seed.isascii() and seed.isdigit() and len(seed) <= len(str(MOST_SEED))):
        raise InputError("--hidden", asked, "SEED or BOARD@SEED, a whole number as of `calibrate`")
    if board.measured is not None and not at:
        hint = f"name the board that was calibrated, as in --hidden BOARD@{seed}"
        raise InputError("--hidden", asked, "BOARD@SEED with a board that was measured", hint=hint)
    plate = hidden_plate(load_board(name) if at else board, int(seed))
    same = [(own.plate.size, len(own.actuators)) for own in (plate.board, board)]
    if same[0] != same[1]:
        raise InputError("--hidden", asked, f"a board of the size and coils of {board.name}")
    return plate
