"""The same level at every frequency: a signal shaped by the inverse of a place's own level.

Below its first resonance a board gives more at some frequencies than at others (`quiet16` 4.5 dB
more at 250 Hz than at 160). A filter of minimum phase takes that out: it begins at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from chladni.effects.effect import limited
from chladni.effects.low_pass import EDGE_HZ

FloatArray = NDArray[np.float64]

MOST_DB = 12.0
"""More or less than at the reference is left as it is."""
TAPS = 257
"""Of the linear-phase filter whose square root it is: 9.5 Hz apart at 2441 samples a second."""


def flattened(
    samples: FloatArray,
    rate_hz: float,
    frequency_hz: FloatArray,
    level: FloatArray,
    reference_hz: float,
) -> FloatArray:
    """Samples shaped so that a place whose level is not flat plays them flat.

    Parameters
    ----------
    samples
        -1 to 1, low-passed.
    rate_hz
        Of the samples.
    frequency_hz, level
        What a place does with a tone, in any unit, shape (frequencies,) each.
    reference_hz
        Where nothing changes.

    Returns
    -------
    float64, as many, -1 to 1.
    """
    grid = np.linspace(0.0, 0.5 * rate_hz, 256)
    # Beyond the low-pass's edge nothing is raised any more.
    at = np.clip(grid, frequency_hz[0], min(EDGE_HZ, frequency_hz[-1]))
    reference = float(np.interp(reference_hz, frequency_hz, level))
    most = 10.0 ** (MOST_DB / 20.0)
    gain = np.clip(reference / np.interp(at, frequency_hz, level), 1.0 / most, most)
    taps = signal.minimum_phase(signal.firwin2(TAPS, grid, gain**2, fs=rate_hz))
    return limited(np.convolve(samples, taps)[: len(samples)])
