"""Boards with so many coils, on so many pins; and boards with bridges in place of switches."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Electronics
from chladni.sim.board.gpio import CHIPS
from chladni.sim.board.parts import Actuator

SWITCHED = Path(__file__).parent / "boards"
"""Files of `strip5` and `quiet5` with switches."""


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


def with_bridges(board: Board, **electronics: Any) -> Board:
    """Of a board with switches, without pins; all that only switches have is as by default."""
    values: dict[str, Any] = {
        "drive": "bridge",
        "diode_v": Electronics.diode_v,
        "least_duty": 0.0,
        "min_on_ns": Electronics.min_on_ns,
        "pwm_pins": (),
    }
    return replace(board, electronics=replace(board.electronics, **(values | electronics)))


def limits_used(
    own: Electronics, duty: NDArray[np.float64], ohm: float, *, crests: int
) -> dict[str, float]:
    """What whole waves of duty at 160 Hz, shape (coils, times), take of each limit: 1 is all.

    Of the supply it is what is delivered, and what a window has more where it holds half a period
    more of the crest, twice. Of two crests a period the area of one is half of what stands above
    the mean.
    """
    current = own.supply_v * duty / ohm
    delivered = (duty * current).sum(axis=0)
    above = np.maximum(delivered - delivered.mean(), 0.0).mean()
    crest = 2.0 / crests * above / (160.0 * 0.064)
    heat = (current**2).mean(axis=1).max() * own.coil_ohm * own.coil_k_per_w
    return {
        "duty": duty.max() / own.max_duty,
        "supply": (delivered.mean() + crest) * 1e3 / (own.supply_limit_ma * 31.0 / 32.0),
        "heat": heat / own.coil_limit_k,
    }
