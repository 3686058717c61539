"""What boards cannot focus is taken out of a signal: above their first resonance they leak.

A Butterworth low-pass of four poles at 250 Hz. It delays a tone of 60 Hz by 1.7 ms, one of 160 by
2.1, and leaves -28 dB of one of 500.
"""

from __future__ import annotations

import numpy as np
import scipy  # which loads its `signal`, half a second's work, where that is used
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

EDGE_HZ = 250.0
POLES = 4
TAIL_S = 0.014
"""After which its answer to an impulse is below a thousandth of its largest."""


def low_passed(samples: FloatArray, rate_hz: float) -> FloatArray:
    """Samples behind the low-pass, from rest."""
    if 0.5 * rate_hz <= EDGE_HZ:
        return samples
    return np.asarray(scipy.signal.sosfilt(sections(rate_hz), samples))


def sections(rate_hz: float) -> FloatArray:
    """Of second order, as SciPy has them: b0, b1, b2, 1, a1, a2 each."""
    return np.asarray(scipy.signal.butter(POLES, EDGE_HZ, fs=rate_hz, output="sos"))
