"""Recordings that commands take."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import ArgumentError
from chladni.sim.files import read_whole

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
    # A tenth of a second of SciPy, which no other command needs.
    from scipy.io import wavfile  # noqa: PLC0415

    data = read_whole(path, "--recording", RECORDING_BYTES)
    try:
        with warnings.catch_warnings(action="ignore"):  # of chunks that are not known
            rate, samples = wavfile.read(io.BytesIO(data))
    except Exception as error:
        # A file of any bytes makes it raise whatever it comes upon.
        raise ArgumentError("--recording", str(error), "a WAV file", file=str(path)) from None
    samples = np.atleast_1d(samples)
    first = samples[:, 0] if samples.ndim > 1 else samples
    if first.size == 0 or rate <= 0:
        raise ArgumentError("--recording", "no samples", "a WAV file", file=str(path))
    scaled = first.astype(np.float64)
    if first.dtype.kind == "u":  # of 8 bits, about 128
        scaled = scaled / 128.0 - 1.0
    elif first.dtype.kind == "i":
        scaled = scaled / float(np.iinfo(first.dtype).max)
    if not np.all(np.isfinite(scaled)):
        raise ArgumentError("--recording", "NaN or infinity", "samples", file=str(path))
    return scaled, float(rate)
