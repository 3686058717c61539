"""The paper's four drive waves as Fourier series, all of the same RMS voltage."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

ComplexArray = NDArray[np.complex128]

Waveform = Literal["sine", "triangle", "square", "ramp"]
WAVEFORMS: tuple[Waveform, ...] = ("sine", "triangle", "square", "ramp")

PEAK_PER_RMS = {"sine": np.sqrt(2.0), "triangle": np.sqrt(3.0), "square": 1.0, "ramp": np.sqrt(3.0)}
"""Crest factors, from the mean squares 1/2, 1/3, 1 and 1/3 of unit waves."""


def harmonics(waveform: Waveform, count: int) -> ComplexArray:
    """Amplitudes of the first harmonics of a wave of RMS 1, real part of Σ cₙ exp(inωt).

    Closed forms for unit peak: sine sin ωt; triangle (8/π²) Σ (−1)^k sin(nωt)/n², n = 2k + 1;
    square (4/π) Σ sin(nωt)/n, n odd; ramp (2/π) Σ (−1)^(n+1) sin(nωt)/n.

    Parameters
    ----------
    count
        Harmonics, n = 1 … count.

    Returns
    -------
    ComplexArray
        Shape (count,).
    """
    n = np.arange(1, count + 1)
    odd = n % 2 == 1
    if waveform == "sine":
        sines = np.where(n == 1, 1.0, 0.0)
    elif waveform == "triangle":
        sines = np.where(odd, 8.0 / np.pi**2 * (-1.0) ** ((n - 1) // 2) / n**2, 0.0)
    elif waveform == "square":
        sines = np.where(odd, 4.0 / np.pi / n, 0.0)
    else:
        sines = 2.0 / np.pi * (-1.0) ** (n + 1) / n
    # sin ωt is the real part of −i exp(iωt).
    return np.asarray(-1j * sines * PEAK_PER_RMS[waveform])


def synthesise(amplitudes: ComplexArray, points: int) -> NDArray[np.float64]:
    """One period of Re Σ cₙ exp(inωt) at evenly spaced instants.

    Parameters
    ----------
    amplitudes
        Shape (…, harmonics); harmonics from half of `points` on cannot be shown and are left out.

    Returns
    -------
    NDArray[np.float64]
        Shape (…, points).
    """
    kept = amplitudes[..., : (points - 1) // 2]
    silent = np.zeros((*kept.shape[:-1], 1))
    # irfft divides by the points and counts each harmonic twice.
    spectrum = np.concatenate((silent, kept), axis=-1) * (points / 2.0)
    return np.asarray(np.fft.irfft(spectrum, points, axis=-1))
