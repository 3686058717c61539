"""WAV files: a recording as it is, in one channel."""

from __future__ import annotations

import io
import warnings
from math import gcd
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.io import wavfile

from chladni.effects.effect import MOST_S, Clip, Effect, limited
from chladni.sim.errors import ArgumentError
from chladni.sim.files import read_whole

FloatArray = NDArray[np.float64]

MOST_BYTES = 64 << 20
LEAST_RATE, MOST_RATE, KEPT_RATE = 500, 400_000, 4000
"""Hz. What lies above half of the last is filtered off by every device."""

WRITTEN_RATE = 48_000


def read_wav(path: Path, field: str) -> tuple[Effect, list[str]]:
    """The effect, and what of the file is left out.

    Raises
    ------
    InputError
        No WAV, too long, or of no rate that can be.
    """
    values, rate = wav_samples(path, field, MOST_BYTES)
    if not LEAST_RATE <= rate <= MOST_RATE:
        raise ArgumentError(
            field, f"{rate} samples a second", f"{LEAST_RATE} to {MOST_RATE:,}", file=str(path)
        )
    left_out = []
    if values.ndim > 1:
        left_out = [f"differences between {values.shape[1]} channels"]
        values = values.mean(axis=1)
    if not np.all(np.isfinite(values)):
        raise ArgumentError(field, "samples that are no numbers", "a WAV file", file=str(path))
    if not len(values):
        raise ArgumentError(field, "no samples", "a sound", file=str(path))
    if not len(values) <= rate * MOST_S:
        raise ArgumentError(
            field, f"{len(values) / rate:g} s", f"{MOST_S:g} s at most", file=str(path)
        )
    if rate > KEPT_RATE:
        shared = gcd(rate, KEPT_RATE)
        values = scipy.signal.resample_poly(values, KEPT_RATE // shared, rate // shared)
        rate = KEPT_RATE
    return Effect(path.stem, (Clip(0.0, np.clip(values, -1.0, 1.0), float(rate)),)), left_out


def wav_samples(path: Path, field: str, most_bytes: int) -> tuple[FloatArray, int]:
    """A file's samples, -1 to 1, (samples,) or (samples, channels), and how many a second.

    Raises
    ------
    InputError
        Not readable, too long, or no WAV file.
    """
    data = read_whole(path, field, most_bytes, "a WAV file")
    try:
        with warnings.catch_warnings():
            # Of chunks that mean nothing here.
            warnings.simplefilter("ignore", wavfile.WavFileWarning)
            rate, samples = wavfile.read(io.BytesIO(data))
    except Exception as error:
        # SciPy tells of a damaged file in many ways.
        raise ArgumentError(field, str(error)[:80], "a WAV file", file=str(path)) from None
    return _as_shares(np.atleast_1d(samples)), rate


def to_wav(effect: Effect) -> tuple[bytes, list[str]]:
    """A WAV file's bytes: an effect as anything plays it aloud, unfiltered; nothing is left out."""
    wave = limited(effect.wave(WRITTEN_RATE, effect.lasts_s))
    file = io.BytesIO()
    wavfile.write(file, WRITTEN_RATE, np.round(32767.0 * wave).astype(np.int16))
    return file.getvalue(), []


def _as_shares(samples: NDArray[Any]) -> FloatArray:
    """-1 to 1, whatever the file's numbers are."""
    values: FloatArray = samples.astype(np.float64)
    if samples.dtype == np.uint8:
        return (values - 128.0) / 128.0
    if np.issubdtype(samples.dtype, np.integer):
        return values / float(np.iinfo(samples.dtype).max)
    return values
