"""What a steady force of each coil does: that of the bias of switches, which drive one way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.transfer import TransferFields, transfer_fields
from chladni.sim.plate.response import PlateModel

FloatArray = NDArray[np.float64]

SLOW_HZ = 0.1
"""Slow enough to be at rest: inertia is (0.1/20)² = 2.5e-5 of stiffness even with a mode at 20."""


def static_fields(board: Board, model: PlateModel) -> FloatArray | None:
    """Deflection per steady newton of each actuator, shape (actuators, nx, ny), m/N.

    None where nothing holds the board, so that a steady force would carry it away.
    """
    if not is_held(board):
        return None
    loss, foundation = board.section.loss_factor, board.foundation
    own = {foot.loss_factor for foot in board.springs} | {own.loss_factor for own in board.screws}
    own -= {None, loss}
    if own or (foundation is not None and foundation.total_loss_factor != loss):
        # What is steady loses nothing; of two loss factors none can be divided out.
        still = replace(
            board,
            plate=replace(board.plate, loss_factor=0.0),
            panel=board.panel and replace(board.panel, loss_factor=0.0),
            foundation=foundation and replace(foundation, loss_factor=0.0),
            springs=tuple(replace(foot, loss_factor=None) for foot in board.springs),
            screws=tuple(replace(screw, loss_factor=None) for screw in board.screws),
        )
        return static_fields(still, plate_model(still))
    fields: TransferFields = transfer_fields(
        board, frequency_hz=SLOW_HZ, model=model, allow_unmet=True
    )
    return np.asarray((fields.values * (1.0 + 1j * loss)).real)


def is_held(board: Board) -> bool:
    """Whether a board's supports leave it no rigid motion: no lift, no tilt either way."""
    if board.foundation is not None:
        return True
    half_x, half_y = (side / 2.0 for side in board.plate.size)
    rows = [(1.0, *pin.at) for pin in board.pins]
    rows += [(1.0, *spring.at) for spring in board.springs if spring.stiffness > 0.0]
    for screw in board.screws:
        if screw.support != "sprung" or screw.stiffness > 0.0:
            # A rim is a circle: three places of it tell a tilt.
            angles = 2.0 * np.pi * np.arange(3) / 3.0
            x = screw.at[0] + screw.radius * np.cos(angles)
            y = screw.at[1] + screw.radius * np.sin(angles)
            rows += [(1.0, float(px), float(py)) for px, py in zip(x, y, strict=True)]
        elif screw.rotational_stiffness > 0.0:
            rows += [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    for name, ends in (
        ("left", ((-half_x, -half_y), (-half_x, half_y))),
        ("right", ((half_x, -half_y), (half_x, half_y))),
        ("bottom", ((-half_x, -half_y), (half_x, -half_y))),
        ("top", ((-half_x, half_y), (half_x, half_y))),
    ):
        kind = board.plate.edges.kinds()[name]
        if kind != "free":
            rows += [(1.0, *end) for end in ends]
        if kind == "clamped":
            rows.append((0.0, 1.0, 0.0) if name in ("left", "right") else (0.0, 0.0, 1.0))
    if len(rows) < 3:
        return False
    scale = np.array([1.0, 1.0 / half_x, 1.0 / half_y])
    return bool(np.linalg.matrix_rank(np.array(rows) * scale, tol=1e-9) == 3)
