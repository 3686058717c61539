"""Boards with so many coils, on so many pins."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from chladni.sim.board.board import Board
from chladni.sim.board.gpio import CHIPS
from chladni.sim.board.parts import Actuator


def board_with(
    board: Board, count: int, *, pins: bool = True, name: str = "coil no. {}", **electronics: Any
) -> Board:
    """A board with so many coils on a grid, on the first GPIOs there are, or on none."""
    actuators = tuple(
        Actuator(name.format(k), ((k % 4 - 1.5) * 14e-3, (k // 4 - 1.5) * 13e-3))
        for k in range(count)
    )
    wired = replace(
        board.electronics, pwm_pins=CHIPS["esp32"].gates[:count] if pins else (), **electronics
    )
    return replace(board, actuators=actuators, electronics=wired, screws=(), coil=None)
