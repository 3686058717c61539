"""Recordings that commands take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.effects.wav_file import wav_samples
from chladni.sim.errors import ArgumentError

FloatArray = NDArray[np.float64]

RECORDING_BYTES = 64_000_000
"""Six minutes of two channels of 16 bits at 44,100 samples a second."""


def read_recording(path: Path) -> tuple[FloatArray, float]:
    """Samples of a WAV file's first channel, -1 to 1, and how many there are a second.

    Raises
    ------
    InputError
        Not readable, too long, or no WAV file.
    """
    samples, rate = wav_samples(path, "--recording", RECORDING_BYTES)
    first = samples[:, 0] if samples.ndim > 1 else samples
    if first.size == 0 or rate <= 0:
        raise ArgumentError("--recording", "no samples", "a WAV file", file=str(path))
    if not np.all(np.isfinite(first)):
        raise ArgumentError("--recording", "NaN or infinity", "samples", file=str(path))
    return first, float(rate)
