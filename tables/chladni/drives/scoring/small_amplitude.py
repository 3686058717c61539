"""What a driver does to a soft wave: a diode stops the current, a bridge loses of each pulse."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import MOST_LEAST_DUTY
from chladni.sim.coil.bridge import BridgeCircuit
from chladni.sim.coil.circuit import circuit_of, current_wave
from chladni.sim.coil.full_drive import least_duty
from chladni.sim.image import metrics

TENTH = 0.05
"""Amplitude of a switch's duty: a tenth of the largest that a duty from 0 to 1 allows."""
SOFT_DB = 0.4
"""Less level that such a wave may have: loud coils lose less than soft ones, and what one finger is
spared of another's signal is their difference. With 0.9 dB an acrylic sheet on feet lost 1.4 dB of
isolation at the median, with 0.4 it lost 0.9."""


@dataclass(frozen=True)
class SoftWave:
    """A sine of a tenth of the largest amplitude, the bias as the firmware adds it.

    Attributes
    ----------
    continuous_from_duty
        From which duty on the current never stops.
    least_duty
        The lowest duty of the board's waves.
    shortest_on_ns
        A device's shortest pulse, as its `min_on_ns` is: that duty of a period, or the switch's.
    level_db_at_tenth
        Of the current's sine, against that without a diode.
    second_harmonic_at_tenth
        Over the sine.
    """

    continuous_from_duty: float
    least_duty: float
    shortest_on_ns: float
    level_db_at_tenth: float
    second_harmonic_at_tenth: float

    @property
    def is_bent(self) -> bool:
        """Whether the current stops somewhere in a soft wave."""
        return self.least_duty < self.continuous_from_duty

    @property
    def floor(self) -> float:
        """A `least_duty` with which it never stops, in hundredths."""
        return _floor(self.continuous_from_duty)


@dataclass(frozen=True)
class BridgeWave:
    """A sine of a tenth of the largest amplitude, as the firmware plays it.

    Attributes
    ----------
    lost_duty
        What of a duty the bridge loses.
    given_back_duty
        What the firmware adds for it: whole steps of the duty.
    level_db_at_tenth
        Of the current's sine, against that of a bridge that loses nothing.
    third_harmonic_at_tenth
        Over the sine.
    """

    lost_duty: float
    given_back_duty: float
    level_db_at_tenth: float
    third_harmonic_at_tenth: float


def with_floor(board: Board) -> Board:
    """The board with a `least_duty` with which diodes take `SOFT_DB` of a soft wave at most.

    The current of a coil without inductance stops in every period, and no floor helps.
    """
    circuit = circuit_of(board)
    if circuit is None or board.electronics.is_bridge:
        return board
    lowest = _floor(circuit.continuous_from())
    for floor in np.arange(lowest, MOST_LEAST_DUTY, 0.01).round(2).tolist():
        raised = replace(board, electronics=replace(board.electronics, least_duty=floor))
        if (wave := soft_wave(raised)) is not None and wave.level_db_at_tenth >= -SOFT_DB:
            return board if least_duty(board) >= least_duty(raised) else raised
    return board


def _floor(continuous_from: float) -> float:
    return float(np.ceil(100.0 * continuous_from) / 100.0)


def soft_wave(board: Board) -> SoftWave | BridgeWave | None:
    """A board's soft wave; None without a coil."""
    circuit = circuit_of(board)
    if circuit is None:
        return None
    if isinstance(circuit, BridgeCircuit):
        steps = 1 << board.electronics.pwm_bits
        given_back = round(circuit.lost_duty * steps) / steps
        # What is left of a pulse's loss, below zero where too much comes back.
        left_s = (circuit.lost_duty - given_back) / circuit.carrier_hz
        wave = current_wave(replace(circuit, lost_s=left_s), 2.0 * TENTH, 0.0)
        level_db = metrics.decibel(wave.gain**2)
        return BridgeWave(circuit.lost_duty, given_back, level_db, wave.third)
    rest = least_duty(board)
    wave = current_wave(circuit, TENTH, TENTH + rest)
    level_db = metrics.decibel(wave.gain**2)
    return SoftWave(
        continuous_from_duty=circuit.continuous_from(),
        least_duty=rest,
        shortest_on_ns=board.electronics.shortest_on_ns,
        level_db_at_tenth=level_db,
        second_harmonic_at_tenth=wave.second,
    )
