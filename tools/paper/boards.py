"""The two boards of the paper, each loaded once, and what a unit of drive is in newtons."""

from __future__ import annotations

from functools import cache

import numpy as np

from chladni.host.emulation._emulator import half_span_steps
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.coil.actuator import force_per_volt

MIDDLE, CORNER = 0, 1
"""Actuators of both boards: the paper's Actuator 3, and one beside which it calls the others
opposite, diagonal and central."""
ACROSS, ALONG, DIAGONAL = 2, 3, 4
"""What the corner has beside it: over the short side, along the long one, and both."""


@cache
def written() -> Board:
    """The board as the paper writes it."""
    return load_board("paper")


@cache
def computed() -> Board:
    """The board that its authors computed."""
    return load_board("prototype")


def newtons_per_gain(board: Board) -> float:
    """Force of a coil held still, N, that a gain of 1 at the pins stands for."""
    assert board.coil is not None
    own = board.electronics
    volts = own.supply_v * half_span_steps(own.pwm_bits) / 2**own.pwm_bits
    frequency = np.array([board.drive.frequency_hz])
    return float(volts * abs(force_per_volt(board.coil, frequency, blocked=True)[0]))
