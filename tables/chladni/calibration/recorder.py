"""What a phone's microphone would record of a hidden plate while its coils sweep.

The plate's volume goes through a microphone whose response is off by some decibels, with a
reflection from the desk and noise. Coils' harmonics, their hum and a room's other echoes are left
out.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.calibration.hearing import sound
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.sweep import FROM_HZ, PAUSE, TO_HZ, sweep_wave

FloatArray = NDArray[np.float64]

RATE_HZ = 8000.0
"""Of the recording; phones' have more, and nothing more of a sweep."""
SOLVED = 160
"""Frequencies at which the plate is solved. Its resonances are those of a rational function that
goes through the answers: within 1e-3 of what twice as many say of `prototype`, `paper`, `phone5`
and `strip5`, where splines through 241 are off by 13 %, 100 %, 0.2 % and 0.2 %."""
AS_SOLVED = 1e-5
"""To which that function goes through the answers."""
AIR = 1.5e-3
"""Damping ratio of what a plate loses to air and wires, also one that is drawn without losses."""
CLOCKS_APART = 40e-6
"""How far the recorder's clock and the device's differ at most."""
MICROPHONE_DB, WAVES = 3.0, 3
"""How far its response is off, and how many times it goes up and down over the sweep."""
REFLECTION, DELAY_S = 0.3, 0.004
NOISE_DB = 30.0
"""Below the loudest coil's sweep, RMS of both."""
REST_S = 0.7
"""Before the first sweep."""


def record_hidden(hidden: HiddenPlate, seed: int = 0) -> tuple[FloatArray, float]:
    """Samples from −1 to 1, and how many there are a second."""
    rng = np.random.default_rng((hidden.seed, seed, 45))
    hz = np.geomspace(0.8 * FROM_HZ, 1.2 * TO_HZ, SOLVED)
    answers = hidden.forces[:, None] * sound(hidden.board, hz)
    wave = sweep_wave(RATE_HZ)
    slot = wave.size + round(PAUSE * RATE_HZ)
    spectrum, hertz = np.fft.rfft(wave, 2 * slot), np.fft.rfftfreq(2 * slot, 1.0 / RATE_HZ)
    inside = (hertz >= hz[0]) & (hertz <= hz[-1])
    # To the right of the axis all dies away faster.
    ringing = hertz * (1j + AIR)
    pitch = np.log(hertz[inside] / hz[0]) / np.log(hz[-1] / hz[0])
    turns = rng.uniform(0.0, 2.0 * np.pi, WAVES)
    off = sum(np.sin(2.0 * np.pi * (k + 1) * pitch + turns[k]) / (k + 1) for k in range(WAVES))
    gain = 10.0 ** (MICROPHONE_DB / 20.0 * np.asarray(off))
    gain = gain * np.abs(1.0 + REFLECTION * np.exp(-2j * np.pi * hertz[inside] * DELAY_S))
    samples = np.zeros(round(REST_S * RATE_HZ) + (len(answers) + 1) * slot)
    apart = rng.uniform(-CLOCKS_APART, CLOCKS_APART)
    for coil, answer in enumerate(answers):
        late = np.exp(-2j * np.pi * hertz[inside] * apart * coil * slot / RATE_HZ)
        heard = np.zeros(hertz.size, np.complex128)
        heard[inside] = (
            spectrum[inside]
            * scipy.interpolate.AAA(1j * hz, answer, rtol=AS_SOLVED)(ringing[inside])
            * gain
            * late
        )
        begin = round(REST_S * RATE_HZ) + coil * slot
        samples[begin : begin + 2 * slot] += np.fft.irfft(heard)[: samples.size - begin]
    loudest = float(np.abs(samples).max())
    rms = max(float(np.sqrt(np.mean(samples[k * slot :][:slot] ** 2))) for k in range(len(answers)))
    noisy = samples + rms * 10.0 ** (-NOISE_DB / 20.0) * rng.standard_normal(samples.size)
    return np.asarray(0.5 * noisy / max(loudest, 1e-300)), RATE_HZ
