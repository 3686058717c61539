"""The same level at every frequency: a signal shaped by the inverse of a place's own level.

Below its first resonance a board gives more at some frequencies than at others (`quiet16` 4.5 dB
more at 250 Hz than at 160). A filter of minimum phase takes that out: it begins at once.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.effects.effect import (
    Clip,
    Curve,
    Effect,
    Noise,
    Part,
    Tone,
    described,
    limited,
)
from chladni.effects.low_pass import EDGE_HZ, TAIL_S

FloatArray = NDArray[np.float64]

MOST_DB = 12.0
"""More or less than at the reference is left as it is."""
STEP_HZ = 10.0
"""Between breakpoints of a tone that is flattened."""
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
    gain = _gain(grid, frequency_hz, level, reference_hz)
    taps = scipy.signal.minimum_phase(scipy.signal.firwin2(TAPS, grid, gain**2, fs=rate_hz))
    return limited(np.convolve(samples, taps)[: len(samples)])


def flattened_effect(
    effect: Effect,
    rate_hz: float,
    frequency_hz: FloatArray,
    level: FloatArray,
    reference_hz: float,
) -> tuple[Effect, list[str]]:
    """An effect that such a place plays as it was, and the parts of which that cannot be.

    Tones are made louder or quieter by their own frequency, moment by moment; clicks and clips
    become clips, by `flattened`. Noise stays as it is.

    Parameters
    ----------
    rate_hz
        Of the clips.
    frequency_hz, level, reference_hz
        As of `flattened`.
    """
    parts: list[Part] = []
    left_out: list[str] = []
    for part in effect.parts:
        if isinstance(part, Tone):
            parts.append(_flat_tone(part, frequency_hz, level, reference_hz))
        elif isinstance(part, Noise):
            left_out.append(f"{described(part)}, which stays as it is")
            parts.append(part)
        else:
            times = np.arange(int((part.ends_s - part.begins_s + TAIL_S) * rate_hz) + 1) / rate_hz
            wave = part.wave(part.begins_s + times)
            samples = flattened(wave, rate_hz, frequency_hz, level, reference_hz)
            parts.append(Clip(part.begins_s, samples, rate_hz))
    return Effect(effect.name, tuple(parts), effect.loop_s), left_out


def _flat_tone(
    tone: Tone, frequency_hz: FloatArray, level: FloatArray, reference_hz: float
) -> Tone:
    hertz = tone.points_of(tone.frequency_hz)
    times = [tone.begins_s, tone.ends_s]
    for (early, low), (late, high) in pairwise(hertz):
        # Between them its frequency goes straight, and the level with it, but not straight.
        count = int(abs(high - low) / STEP_HZ) + 1
        times += np.linspace(early, late, count + 1).tolist()
    points = tone.points_of(tone.amplitude, sorted(set(times) - {tone.begins_s, tone.ends_s}))
    at = np.array([time for time, _ in points])
    gain = _gain(tone.frequency_hz.at(at), frequency_hz, level, reference_hz)
    values = np.array([value for _, value in points]) * gain
    return replace(tone, amplitude=Curve(tuple(at.tolist()), tuple(values.tolist())))


def _gain(
    hz: FloatArray, frequency_hz: FloatArray, level: FloatArray, reference_hz: float
) -> FloatArray:
    """What takes a place's level out; beyond the low-pass's edge nothing is raised any more."""
    at = np.clip(hz, frequency_hz[0], min(EDGE_HZ, frequency_hz[-1]))
    reference = float(np.interp(reference_hz, frequency_hz, level))
    most = 10.0 ** (MOST_DB / 20.0)
    return np.asarray(np.clip(reference / np.interp(at, frequency_hz, level), 1.0 / most, most))
