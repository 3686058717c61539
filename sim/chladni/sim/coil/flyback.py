"""What a coil draws behind a switch and a flyback diode, in a carrier period.

While the switch is on the supply drives the current through the winding, while it is off the diode
carries it on against its own drop. At small duties it reaches zero before the next period begins:
the mean is then no longer in proportion to the duty, and a sine that comes down to such duties gets
harmonics, which no drive focuses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

DIODE_AT_A = 0.03
"""Where a diode's drop is the one of the board file: between a soft wave's current and a loud
one's."""
DIODE_SLOPE_V = 0.0272
"""By which the drop grows with ln i: 1.05 kT/e at 27 °C, of a Schottky diode (SPICE's N)."""
DIODE_OHM = 0.05
"""In series with it (SPICE's RS)."""
DIODE_TURNS = 6
"""Of drop and current, each found from the other: they leave 3 µA at any duty of 10 Ω at 5 V."""
LEAST_A = 1e-6
"""Below it a drop stays as it is."""


@dataclass(frozen=True)
class FlybackCircuit:
    """A coil, its supply, its diode and its carrier. SI units; the switch drops nothing.

    `diode_v` is the diode's drop at 30 mA, from which it grows with the current as a Schottky
    diode's; 0 for none at any current, as with a second transistor in the diode's place.
    """

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

    def drop(self, ampere: FloatArray) -> FloatArray:
        """The diode's, V, at a current; shape as `ampere`'s.

        U = U₀ + n ln(i/i₀) + r (i − i₀), not below zero (Shockley's law with a resistance).
        """
        if self.diode_v == 0.0:
            return np.zeros_like(ampere)
        current = np.maximum(ampere, LEAST_A)
        grown = DIODE_SLOPE_V * np.log(current / DIODE_AT_A) + DIODE_OHM * (current - DIODE_AT_A)
        return np.maximum(self.diode_v + grown, 0.01 * self.diode_v)

    def continuous_from(self) -> float:
        """The duty from which on the current never stops, 0 to 1."""
        if self.diode_v == 0.0:
            return 0.0
        if not np.isfinite(self._period):
            return 1.0
        edge = 0.0
        for _ in range(DIODE_TURNS):
            # The drop at the mean of a triangle, which falls to zero as the period ends.
            peak = self.supply_v * -np.expm1(-edge * self._period) / self.ohm
            edge = float(self._edge(self.drop(np.array(peak / 2.0))))
        return edge

    def _edge(self, drop_v: FloatArray) -> FloatArray:
        """The same with a constant drop.

        i falls from (V/R)(1 − e^(−dT)) to zero just at the end, with the drop U and the period T in
        time constants: (V + U) e^(−(1 − d)T) = U + V e^(−T).
        """
        period, v = self._period, self.supply_v
        return np.asarray(1.0 - np.log((v + drop_v) / (drop_v + v * np.exp(-period))) / period)

    def mean_current(self, duty: FloatArray) -> FloatArray:
        """Mean current of a carrier period at a steady duty, A, shape as `duty`'s.

        While the diode conducts its drop counts as that at the mean of its current.
        """
        period, v = self._period, self.supply_v
        if self.diode_v == 0.0 or not np.isfinite(period):
            return np.asarray(duty * v / self.ohm)
        on = duty * period
        peak = v * -np.expm1(-on)  # times R
        conducted = np.full_like(np.asarray(duty, dtype=np.float64), DIODE_AT_A)
        for _ in range(DIODE_TURNS):
            u = self.drop(conducted)
            flows = duty >= self._edge(u)
            flowing = np.maximum(duty * v - (1.0 - duty) * u, 0.0) / self.ohm
            fall = np.log1p(peak / u)
            charge = peak - u * fall  # of the diode, times R, over L/R
            stopping = (v * on - peak + charge) / (period * self.ohm)
            own = charge / np.maximum(fall, 1e-12) / self.ohm
            conducted = np.where(flows, flowing, own)
        return np.asarray(np.where(flows, flowing, stopping))
