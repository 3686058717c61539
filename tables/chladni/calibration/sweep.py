"""A sweep that every coil plays in turn, and what of it a recording has at each frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FROM_HZ, TO_HZ = 80.0, 2000.0
"""A phone's microphone hears from 80 Hz on; light sheets on stiff foam ring at 1 kHz and more."""
SECONDS, PAUSE, FADE = 3.0, 0.5, 0.05
"""Of one coil's sweep, of the rest after it, and of the ramps at both ends."""
LEVEL = 0.5
"""Of full duty."""
FREQUENCIES, EDGE = 14, 2.0 ** (1.0 / 12.0)
"""How many are used, and how far from both ends of the sweep."""
DAMPING = 0.01
"""By which a sweep's echo is taken to die away sooner, as a damping ratio: what rings for seconds
is neither heard nor solved then, and resonances between these frequencies still show."""
PLAYED = 1.02
"""How far from its ends a sweep is loud enough to be divided by."""
TOP, BELOW, CLIPPED = 0.99, 0.9, 0.25
"""Samples above the first share of the largest, over those from the second share to the first. A
sweep through resonances has about 0.1 (0.01 by 0.09, where its envelope is a parabola), one that is
clipped by 0.9 dB has 0.36 or more, at 8 and 48 kHz, in 60 steps or in all of 16 bits."""
FEWEST = 40
"""Samples below the top that are too few to compare with, as beside a click."""
FOUND = 0.06
"""Of the correlation that a recording of nothing but the sweeps has. Plates that ring long have
0.16, noise 0.015."""
AUDIBLE_DB = 6.0
"""That a band must be above the recording's own noise."""


def sweep_frequencies() -> FloatArray:
    """Where levels are taken, Hz; equal steps of pitch."""
    return np.geomspace(FROM_HZ * EDGE, TO_HZ / EDGE, FREQUENCIES)


def sweep_wave(rate_hz: float) -> FloatArray:
    """One coil's sweep, −1 to 1: a sine that rises by as many octaves each second."""
    times = np.arange(round(SECONDS * rate_hz)) / rate_hz
    return np.asarray(_sine(times) * _ramp(times))


def sweep_duties(board: Board, times: FloatArray) -> FloatArray:
    """Duties of all channels while one coil after the other sweeps, for `Device.stream`.

    Every coil takes 3.5 s. Each sweep rides on a bias of its own size, on bridges too, that comes
    and goes with it.

    Parameters
    ----------
    times
        From the first sweep's beginning, s, shape (frames,).

    Returns
    -------
    float64, shape (frames, actuators), 0 to 1.
    """
    duties = np.zeros((times.size, len(board.actuators)))
    for coil in range(len(board.actuators)):
        own = times - coil * (SECONDS + PAUSE)
        plays = (own >= 0.0) & (own <= SECONDS)
        duties[plays, coil] = LEVEL * _ramp(own[plays]) * (1.0 + _sine(own[plays])) / 2.0
    return duties


def _sine(times: FloatArray) -> FloatArray:
    octaves = np.log(TO_HZ / FROM_HZ)
    phase = 2.0 * np.pi * FROM_HZ * SECONDS / octaves * np.expm1(times / SECONDS * octaves)
    return np.asarray(np.sin(phase))


def _ramp(times: FloatArray) -> FloatArray:
    """From 0 to 1 and back."""
    share = np.clip(np.minimum(times, SECONDS - times) / FADE, 0.0, 1.0)
    return np.asarray(np.sin(np.pi / 2.0 * share) ** 2)


@dataclass(frozen=True)
class HeardCoils:
    """What of every coil's sweep is in a recording.

    Attributes
    ----------
    values
        Over what was played, in a unit that all have in common, (coils, frequencies).
    noise
        Variance of each value, (frequencies,).
    slot_s
        From one coil's sweep to the next one's.
    """

    values: ComplexArray
    noise: FloatArray
    slot_s: float


def heard_coils(samples: FloatArray, rate_hz: float, coils: int) -> HeardCoils:
    """What every coil's sweep is like in a recording, at `sweep_frequencies`, damped by `DAMPING`.

    Parameters
    ----------
    samples
        Of one channel, any scale; the sweeps begin anywhere in it.

    Raises
    ------
    InputError
        It is too short, silent, clipped, or has no such sweeps.
    """
    wave = sweep_wave(rate_hz)
    slot = wave.size + round(PAUSE * rate_hz)
    _check(samples, rate_hz, coils * slot)
    begin = _begin(samples, wave, slot, coils)
    size = 2 ** int(np.ceil(np.log2(slot + rate_hz)))
    hertz = np.asarray(np.fft.rfftfreq(size, 1.0 / rate_hz), np.float64)
    played = np.fft.rfft(wave, size)
    weights = _weights(hertz)
    power = np.maximum(np.abs(played) ** 2, 1e-9 * np.abs(played).max() ** 2)
    values = np.empty((coils, len(weights)), np.complex128)
    for coil in range(coils):
        products = np.fft.rfft(samples[begin + coil * slot :][:slot], size) * played.conj()
        values[coil] = weights @ (products / power)
    noise = np.zeros(len(weights))
    quiet = samples[:begin][-slot:]
    if quiet.size > 0.2 * rate_hz:
        each = np.abs(np.fft.rfft(quiet, size)) ** 2 * slot / quiet.size
        noise = weights**2 @ (each / power)
    audible = 10.0 ** (AUDIBLE_DB / 10.0) * noise
    if np.mean(np.abs(values) ** 2 > audible) < 0.5:
        raise InputError("recording", "sweeps below its noise", "sweeps that are heard")
    return HeardCoils(values, noise, slot / rate_hz)


def _weights(hertz: FloatArray) -> FloatArray:
    """Of each line of a spectrum in the value at each frequency, (frequencies, lines).

    What is heard after a push and never before is, at ω (i + ζ), a mean along the axis, with
    weights of 1 / ((ζω)² + (ω − ω′)²) (Poisson's formula for a half-plane).
    """
    centre = sweep_frequencies()[:, None]
    inside = (hertz >= FROM_HZ * PLAYED) & (hertz <= TO_HZ / PLAYED)
    weights = inside / ((DAMPING * centre) ** 2 + (hertz - centre) ** 2)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _check(samples: FloatArray, rate_hz: float, needed: int) -> None:
    if rate_hz < 2.5 * TO_HZ:
        raise InputError(
            "recording", f"{rate_hz:g} Hz", f"at least {2.5 * TO_HZ:g} samples a second"
        )
    if samples.size < needed:
        lasts, long = samples.size / rate_hz, needed / rate_hz
        raise InputError("recording", f"{lasts:.1f} s", f"sweeps of all coils, {long:.1f} s")
    loudest = float(np.abs(samples).max())
    if not loudest > 0.0:
        raise InputError("recording", "silence", "sweeps of all coils")
    if _is_clipped(samples - samples.mean()):
        hint = "record from further away, without automatic level"
        raise InputError("recording", "clipped", "sweeps that are not too loud", hint=hint)


def _is_clipped(samples: FloatArray) -> bool:
    """Whether either end is as full as the peaks of no sweep are."""
    for own in (samples, -samples):
        top = int(np.count_nonzero(own >= TOP * own.max()))
        below = int(np.count_nonzero(own >= BELOW * own.max())) - top
        if top > CLIPPED * max(below, FEWEST):
            return True
    return False


def _begin(samples: FloatArray, wave: FloatArray, slot: int, coils: int) -> int:
    """Where the first sweep begins."""
    alike = np.abs(scipy.signal.correlate(samples, wave, mode="valid", method="fft"))
    span = alike.size - (coils - 1) * slot
    together = np.sum([alike[k * slot : k * slot + span] for k in range(coils)], axis=0)
    begin = int(np.argmax(together))
    energy = sum(
        float(np.linalg.norm(samples[begin + k * slot :][: wave.size])) for k in range(coils)
    )
    if float(together[begin]) < FOUND * energy * float(np.linalg.norm(wave)):
        raise InputError(
            "recording", "no sweeps", "one of each coil in turn", hint="docs/calibrate.md has them"
        )
    return begin
