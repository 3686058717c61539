"""What a coil draws in a full bridge, in a carrier period: the sign and the magnitude of a duty.

While the pulse is on, two transistors put the supply across the coil, the way that the sign says.
For the rest of the period (slow decay) both low sides short it, and the current goes on through
them without a diode's drop, whichever way it flows. So it never stops, and no bias is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class BridgeCircuit:
    """A coil, its supply, its bridge and its carrier. SI units; no inductance, see `mean_current`.

    `ohm` is the winding's resistance and that of the two transistors in the current's way, in a
    pulse as after it. `lost_s` is what the bridge makes each pulse shorter: it waits before it
    opens a transistor, so that no two of a leg conduct, and for a few nanoseconds the current then
    flows through a body diode.
    """

    ohm: float
    supply_v: float
    lost_s: float
    carrier_hz: float

    @property
    def current_per_duty(self) -> float:
        """By how much a duty more raises the mean current, A."""
        return self.supply_v / self.ohm

    @property
    def lost_duty(self) -> float:
        """What of a duty, 0 to 1, moves nothing."""
        return self.lost_s * self.carrier_hz

    def continuous_from(self) -> float:
        """0: the current never stops, at no duty."""
        return 0.0

    def mean_current(self, duty: FloatArray) -> FloatArray:
        """Mean current of a carrier period at a steady duty from −1 to 1, A, shape as `duty`'s.

        With both low sides on between pulses the circuit is linear at any current, and over a
        period L di/dt has no mean: ī = V d/R, whatever the inductance.
        """
        size = np.abs(duty)
        # A pulse that never ends has no edges to lose anything at.
        pulse = np.where(size < 1.0, np.maximum(size - self.lost_duty, 0.0), 1.0)
        return np.asarray(np.sign(duty) * pulse * self.current_per_duty)
