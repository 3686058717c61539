"""Which channel has which actuator and GPIOs."""

from __future__ import annotations

from dataclasses import dataclass

from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM


@dataclass(frozen=True)
class Channel:
    """An output: its number, its actuator's name and place (mm), its GPIO if it has one.

    `sign_gpio` is that of its bridge's sign; None with a switch.
    """

    channel: int
    actuator: str
    gpio: int | None
    at_mm: tuple[float, float]
    sign_gpio: int | None = None


def channels(board: Board) -> tuple[Channel, ...]:
    """A board's channels in order; `gpio` is None where the board file names no pins."""
    none = (None,) * len(board.actuators)
    pins, signs = board.electronics.pwm_pins or none, board.electronics.sign_pins or none
    return tuple(
        Channel(k, own.name, pin, (round(own.at[0] / MM, 9), round(own.at[1] / MM, 9)), sign)
        for k, (own, pin, sign) in enumerate(zip(board.actuators, pins, signs, strict=True))
    )
