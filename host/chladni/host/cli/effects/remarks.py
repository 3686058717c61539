"""What is said of effects that a board cannot play as they are meant."""

from __future__ import annotations

from chladni.effects.effect import Effect
from chladni.effects.low_pass import EDGE_HZ, POLES
from chladni.host.cli.common.output import say
from chladni.sim.board.board import Board
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.image.metrics import decibel

MODES, STILL_HZ = 8, 1.0
"""Of a plate that are looked at; below so much they are rigid motions."""


def say_waves(board: Board) -> None:
    """Remark on a plate that resonates among what effects are made of: gains do not hold there."""
    modes = plate_model(board).natural_frequencies(MODES)
    first = min((own for own in modes.tolist() if own > STILL_HZ), default=EDGE_HZ)
    if first < EDGE_HZ:
        say(
            f"this plate's first natural frequency is {first:.3g} Hz: an effect of up to "
            f"{EDGE_HZ:g} Hz is kept from other fingers only below it"
        )


def say_filtered(effect: Effect) -> None:
    """Remark on what the low-pass takes of an effect's highest frequency."""
    highest = max(effect.frequencies_hz, default=0.0)
    if highest <= EDGE_HZ:
        return
    left_db = decibel(1.0 / (1.0 + (highest / EDGE_HZ) ** (2 * POLES)))
    say(
        f"{effect.name}: above {EDGE_HZ:g} Hz boards do not focus, and a low-pass leaves "
        f"{left_db:.0f} dB of {highest:.0f} Hz"
    )
