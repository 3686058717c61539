"""What a coil draws behind a switch and a flyback diode, in a carrier period and over a wave.

While the switch is on the supply drives the current through the winding, while it is off the diode
carries it on against its own drop. At small duties it reaches zero before the next period begins:
the mean is then no longer in proportion to the duty, and a sine that comes down to such duties gets
harmonics, which no drive focuses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import CLOCK_HZ

FloatArray = NDArray[np.float64]

POINTS = 1024
"""Of a wave; harmonics up to the tenth are then exact to 1e-4."""


@dataclass(frozen=True)
class FlybackCircuit:
    """A coil, its supply, its diode and its carrier. SI units; the switch drops nothing."""

    ohm: float
    henry: float
    supply_v: float
    diode_v: float
    carrier_hz: float

    @property
    def _period(self) -> float:
        """Of the carrier, in time constants L/R of the coil."""
        return self.ohm / self.henry / self.carrier_hz if self.henry > 0.0 else np.inf

    @property
    def current_per_duty(self) -> float:
        """By how much a duty more raises the mean current while that flows, A."""
        return (self.supply_v + self.diode_v) / self.ohm

    def continuous_from(self) -> float:
        """The duty from which on the current never stops, 0 to 1.

        i falls from (V/R)(1 − e^(−dT)) to zero just at the end, with the drop U and the period T in
        time constants: (V + U) e^(−(1 − d)T) = U + V e^(−T).
        """
        period, v, u = self._period, self.supply_v, self.diode_v
        if u == 0.0:
            return 0.0
        if not np.isfinite(period):
            return 1.0
        return float(1.0 - np.log((v + u) / (u + v * np.exp(-period))) / period)

    def mean_current(self, duty: FloatArray) -> FloatArray:
        """Mean current of a carrier period at a steady duty, A, shape as `duty`'s."""
        period, v, u = self._period, self.supply_v, self.diode_v
        flowing = (duty * v - (1.0 - duty) * u) / self.ohm
        if u == 0.0:
            return np.asarray(flowing)
        if not np.isfinite(period):
            return np.asarray(duty * v / self.ohm)
        on = duty * period
        peak = v * -np.expm1(-on)  # times R
        fall = np.log1p(peak / u)
        stopping = (v * on - peak + peak - u * fall) / (period * self.ohm)
        return np.asarray(np.where(duty >= self.continuous_from(), flowing, stopping))

    def wave(self, amplitude: float, rest: float) -> tuple[float, float]:
        """A sine of duty over its bias: its current against amplitude · V/R, and H2/H1.

        Parameters
        ----------
        amplitude
            Of the duty, 0 to 0.5.
        rest
            Least duty of the wave: the bias is `amplitude` above it.
        """
        turns = np.arange(POINTS) / POINTS
        duty = rest + amplitude * (1.0 + np.sin(2.0 * np.pi * turns))
        spectrum = np.abs(np.fft.rfft(self.mean_current(duty))) * 2.0 / POINTS
        whole = amplitude * self.supply_v / self.ohm
        return float(spectrum[1] / whole), float(spectrum[2] / spectrum[1])


def circuit_of(board: Board) -> FlybackCircuit | None:
    """The circuit of every coil of a board; None without a coil."""
    coil, own = board.coil, board.electronics
    if coil is None:
        return None
    carrier = CLOCK_HZ / 2**own.pwm_bits
    return FlybackCircuit(coil.resistance, coil.inductance, own.supply_v, own.diode_v, carrier)
