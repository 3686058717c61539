"""The current that a duty drives through a coil, whichever driver it has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import CLOCK_HZ
from chladni.sim.coil.bridge import BridgeCircuit
from chladni.sim.coil.flyback import FlybackCircuit

FloatArray = NDArray[np.float64]

POINTS = 1024
"""Of a wave; harmonics up to the tenth are then exact to 1e-4."""


class CoilCircuit(Protocol):
    """A coil, its supply and its driver."""

    @property
    def current_per_duty(self) -> float:
        """By how much a duty more raises the mean current, A."""
        ...

    def continuous_from(self) -> float:
        """The duty from which on the current never stops within a carrier period."""
        ...

    def mean_current(self, duty: FloatArray) -> FloatArray:
        """Mean current of a carrier period at a steady duty, A, shape as `duty`'s."""
        ...


@dataclass(frozen=True)
class CurrentWave:
    """What a sine of duty becomes as a current.

    Attributes
    ----------
    gain
        Its amplitude over that of the duty times `current_per_duty`.
    second, third
        Its harmonics over its fundamental.
    """

    gain: float
    second: float
    third: float


def current_wave(circuit: CoilCircuit, amplitude: float, bias: float) -> CurrentWave:
    """The current of the duty bias + amplitude · sin.

    Parameters
    ----------
    amplitude
        Of the duty, 0 to 1.
    bias
        Mean duty; 0 with bridges.
    """
    duty = bias + amplitude * np.sin(2.0 * np.pi * np.arange(POINTS) / POINTS)
    spectrum = np.abs(np.fft.rfft(circuit.mean_current(duty))) * 2.0 / POINTS
    return CurrentWave(
        gain=float(spectrum[1] / (amplitude * circuit.current_per_duty)),
        second=float(spectrum[2] / spectrum[1]),
        third=float(spectrum[3] / spectrum[1]),
    )


def circuit_of(board: Board) -> CoilCircuit | None:
    """The circuit of every coil of a board; None without a coil."""
    coil, own = board.coil, board.electronics
    if coil is None:
        return None
    carrier = CLOCK_HZ / 2**own.pwm_bits
    if own.is_bridge:
        ohm = coil.resistance + own.bridge_ohm
        return BridgeCircuit(ohm, own.supply_v, own.lost_ns * 1e-9, carrier)
    return FlybackCircuit(coil.resistance, coil.inductance, own.supply_v, own.diode_v, carrier)
