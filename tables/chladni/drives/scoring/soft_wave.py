"""What a flyback diode does to a soft wave: it stops a coil's current in every carrier period."""

from __future__ import annotations

from dataclasses import dataclass

from chladni.sim.board.board import Board
from chladni.sim.coil.flyback import circuit_of
from chladni.sim.coil.full_drive import least_duty
from chladni.sim.image import metrics

TENTH = 0.05
"""Amplitude of the duty: a tenth of the largest that a duty from 0 to 1 allows."""


@dataclass(frozen=True)
class SoftWave:
    """A sine of a tenth of the largest amplitude, the bias as the firmware adds it.

    Attributes
    ----------
    continuous_from_duty
        From which duty on the current never stops.
    least_duty
        The lowest duty of the board's waves.
    level_db_at_tenth
        Of the current's sine, against that without a diode.
    second_harmonic_at_tenth
        Over the sine.
    """

    continuous_from_duty: float
    least_duty: float
    level_db_at_tenth: float
    second_harmonic_at_tenth: float

    @property
    def is_bent(self) -> bool:
        """Whether the current stops somewhere in a soft wave."""
        return self.least_duty < self.continuous_from_duty


def soft_wave(board: Board) -> SoftWave | None:
    """A board's soft wave; None without a coil."""
    circuit = circuit_of(board)
    if circuit is None:
        return None
    rest = least_duty(board)
    gain, second = circuit.wave(TENTH, rest)
    return SoftWave(circuit.continuous_from(), rest, metrics.decibel(gain**2), second)
