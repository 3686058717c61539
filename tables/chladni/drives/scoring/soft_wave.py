"""What a driver does to a soft wave: a diode stops the current, a bridge loses of each pulse."""

from __future__ import annotations

from dataclasses import dataclass

from chladni.sim.board.board import Board
from chladni.sim.coil.bridge import BridgeCircuit
from chladni.sim.coil.circuit import circuit_of, current_wave
from chladni.sim.coil.full_drive import least_duty
from chladni.sim.image import metrics

TENTH = 0.05
"""Amplitude of a switch's duty: a tenth of the largest that a duty from 0 to 1 allows."""


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


@dataclass(frozen=True)
class BridgeWave:
    """A sine of a tenth of the largest amplitude, if the firmware gave nothing back.

    Attributes
    ----------
    lost_duty
        What of a duty moves nothing.
    level_db_at_tenth
        Of the current's sine, against that of a bridge that loses nothing.
    third_harmonic_at_tenth
        Over the sine.
    """

    lost_duty: float
    level_db_at_tenth: float
    third_harmonic_at_tenth: float


def soft_wave(board: Board) -> SoftWave | BridgeWave | None:
    """A board's soft wave; None without a coil."""
    circuit = circuit_of(board)
    if circuit is None:
        return None
    if isinstance(circuit, BridgeCircuit):
        wave = current_wave(circuit, 2.0 * TENTH, 0.0)
        return BridgeWave(circuit.lost_duty, metrics.decibel(wave.gain**2), wave.third)
    rest = least_duty(board)
    wave = current_wave(circuit, TENTH, TENTH + rest)
    level_db = metrics.decibel(wave.gain**2)
    return SoftWave(circuit.continuous_from(), rest, level_db, wave.second)
