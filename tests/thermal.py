"""How warm coils really get and what their supply delivers, by the pins alone."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chladni.host.emulation.emulator import Recording
from chladni.host.protocol.config import DeviceConfig

SUPPLY_WINDOW_S = 0.064


def means_of(
    current_ma: NDArray[np.float64], carrier_hz: float, window_s: float = SUPPLY_WINDOW_S
) -> NDArray[np.float64]:
    """Means over every window so long, shape (periods - window + 1,)."""
    count = round(window_s * carrier_hz)
    sums = np.concatenate(([0.0], np.cumsum(current_ma)))
    return np.asarray((sums[count:] - sums[:-count]) / count)


@dataclass
class Coils:
    """Every coil's rise above the air, K: one resistance and one time constant, exactly."""

    config: DeviceConfig
    rise_k: NDArray[np.float64] = field(init=False)
    most_k: float = 0.0

    def __post_init__(self) -> None:
        self.rise_k = np.zeros(self.config["channels"])

    def take(self, recording: Recording) -> None:
        """What came out of the pins; between two carrier periods nothing changes."""
        config, count = self.config, self.config["channels"]
        full_k = np.array(config["full_rise_dk"][:count]) / 10.0
        decay = np.exp(-1.0 / (recording.carrier_hz * config["heating_ds"] / 10.0))
        squares = recording.duty**2 * full_k
        # r[n+1] = decay r[n] + (1 − decay) s[n], in blocks that keep the powers of decay in range.
        for block in np.array_split(squares, max(1, len(squares) // 20_000)):
            growth = decay ** np.arange(1.0, len(block) + 1.0)[:, None]
            sums = np.cumsum(block / growth, axis=0)
            path = growth * (self.rise_k + (1.0 - decay) * sums)
            self.most_k = max(self.most_k, float(path.max()))
            self.rise_k = path[-1]

    def rest(self, seconds: float) -> None:
        """Nothing drives them."""
        self.rise_k = self.rise_k * np.exp(-seconds / (self.config["heating_ds"] / 10.0))
