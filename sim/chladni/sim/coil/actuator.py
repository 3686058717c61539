"""The coil actuator of the paper's section II: coil, magnet and the board on its latch.

    u = R i + L di/dt + BL v          coil, with the voltage its own motion induces
    m dv/dt + c v + k ∫v dt = BL i    magnet and board on the latch, one resonator

Linear, so every wave is the sum of its harmonics' answers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.electronics import Coil
from chladni.sim.coil.waveforms import Waveform, harmonics, synthesise
from chladni.sim.errors import MissingError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

HARMONICS = 199
"""A square wave's 199th harmonic carries 2.5e-5 of its power."""
PERIOD_POINTS = 2048


@dataclass(frozen=True)
class WaveResponse:
    """Acceleration of the moving part under one wave, over frequency.

    Attributes
    ----------
    fundamental
        Amplitude of the first harmonic, m/s², shape (frequencies,).
    rms
        Of the whole wave, m/s².
    distortion
        RMS of the higher harmonics over that of the first.
    correlation
        Correlation of the acceleration's shape with the drive's, best over all delays, 0 to 1.
    """

    fundamental: FloatArray
    rms: FloatArray
    distortion: FloatArray
    correlation: FloatArray


def force_per_volt(
    coil: Coil, frequencies_hz: FloatArray, *, blocked: bool = False
) -> ComplexArray:
    """Magnetic force per volt at the coil, N/V, shape of `frequencies_hz`.

    `blocked` holds the magnet still, so that nothing is induced: the force BL/(R + iωL) that a
    plate model takes, whose own motion is small beside the latch's.
    """
    omega = 2.0 * np.pi * np.asarray(frequencies_hz, dtype=np.float64)
    electrical = coil.resistance + 1j * omega * coil.inductance
    if blocked:
        return np.asarray(coil.force_factor / electrical)
    induced = coil.force_factor**2 / _mechanical(coil, omega)
    return np.asarray(coil.force_factor / (electrical + induced))


def acceleration_per_volt(coil: Coil, frequencies_hz: FloatArray) -> ComplexArray:
    """Acceleration of the moving part per volt, m/(s²·V)."""
    omega = 2.0 * np.pi * np.asarray(frequencies_hz, dtype=np.float64)
    velocity = force_per_volt(coil, frequencies_hz) / _mechanical(coil, omega)
    return np.asarray(1j * omega * velocity)


def wave_response(coil: Coil, waveform: Waveform, frequencies_hz: FloatArray) -> WaveResponse:
    """Answer to a wave of the coil's RMS voltage at each fundamental frequency."""
    drive = coil.rms_voltage * harmonics(waveform, HARMONICS)
    order = np.arange(1, HARMONICS + 1)
    answer = drive * acceleration_per_volt(coil, np.outer(frequencies_hz, order))
    power = np.abs(answer) ** 2 / 2.0
    higher = np.sqrt(power[:, 1:].sum(axis=1))
    return WaveResponse(
        fundamental=np.abs(answer[:, 0]),
        rms=np.sqrt(power.sum(axis=1)),
        distortion=higher / np.sqrt(power[:, 0]),
        correlation=correlation(drive, answer),
    )


def correlation(first: ComplexArray, second: ComplexArray) -> FloatArray:
    """Largest correlation of periodic waves over all delays, from harmonics (…, harmonics)."""
    cross = synthesise(first * second.conj(), PERIOD_POINTS)
    norm = np.linalg.norm(first, axis=-1) * np.linalg.norm(second, axis=-1)
    return np.asarray(np.abs(cross).max(axis=-1) / np.maximum(norm, 1e-300))


def motion(coil: Coil, waveform: Waveform, frequency_hz: float, points: int) -> FloatArray:
    """One period of the acceleration under a wave, m/s², shape (points,)."""
    order = np.arange(1, HARMONICS + 1)
    answer = harmonics(waveform, HARMONICS) * acceleration_per_volt(
        coil, np.asarray(frequency_hz * order, dtype=np.float64)
    )
    return synthesise(coil.rms_voltage * answer, points)


def _mechanical(coil: Coil, omega: FloatArray) -> ComplexArray:
    """Force over velocity of the moving part, N·s/m."""
    latch = coil.latch
    if latch is None:
        raise MissingError("coil.resonance_hz", "with moving_mass_g and mechanical_q, of a latch")
    own = 2.0 * np.pi * latch.resonance_hz
    return np.asarray(
        latch.moving_mass * (1j * omega + own / latch.mechanical_q + own**2 / (1j * omega))
    )
