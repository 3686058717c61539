"""What a device reads of its own coils: one plays, the others are listened to in turn.

And what there is to be read, on a plate that only an emulated device knows: motion and flux
(`sim/fields/induced.py`). Coils are read once more at some kilohertz, where the sheet's mass keeps
it still and flux is most of it (`flux.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.hidden import HiddenPlate
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.errors import ToleranceError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.induced import induced_voltages, open_coils, shared_inductances

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SAMPLE_HZ = 80e6 / 4096.0
"""Every fourth carrier period, as the firmware makes its own samples."""
BASE_SAMPLES = 488
"""25 ms: two periods of the lowest frequency. All frequencies are multiples of its inverse."""
UNIT_HZ = SAMPLE_HZ / BASE_SAMPLES
"""Of which all frequencies are multiples, 40 Hz."""
MULTIPLES, FLUX_MULTIPLE = (2, 4, 6), 190
"""80, 160 and 240 Hz, and 7.6 kHz."""
FLUX_MULTIPLES = {10: FLUX_MULTIPLE, 11: 100, 12: 50}
"""By the carrier's bits: 7.6, 4 and 2 kHz, which samples of 19.5, 9.8 and 4.9 kHz can make."""
MOST_SECONDS, FEW_COILS = (10.0, 30.0), 8
"""A reading lasts so long at most, on boards of so few coils and on larger ones."""
LEVEL = 0.8
"""Of the current that a coil's supply allows around a bias of the same size."""
AMPLIFIER = 187.0
GAIN_ERROR, FLUX_ERROR = 0.01, 0.01
"""Of the amplifier (common to all coils), and of the flux at 7.6 kHz against that at 160 Hz."""
CONVERTER_V, CONVERTER_STEPS = 3.1, 4096
CONVERTER_NOISE, CONVERTER_BEND = 4.0, 4.0
"""Steps, RMS and at most, within 1.1 V about the amplifier's middle of 1.3 V, where an ESP32's
converter is straight."""


@dataclass(frozen=True)
class ReadAt:
    """What coils read at one frequency.

    Attributes
    ----------
    hz
        Frequency.
    volts
        Per ampere that was meant, (listening, playing).
    spread
        One standard deviation of its real and imaginary parts, by the converter's noise.
    duties
        Amplitudes that coils played with, (playing,).
    sessions
        Of the converter, in which coils played, as numbers, (playing,).
    """

    hz: float
    volts: ComplexArray
    spread: FloatArray
    duties: FloatArray
    sessions: FloatArray


@dataclass(frozen=True)
class CoilReadings:
    """What coils read of each other, by motion and flux together.

    Attributes
    ----------
    frequencies_hz
        Shape (frequencies,).
    volts
        Per ampere that was meant, (frequencies, listening, playing), 0 on the diagonals.
    noise
        One standard deviation of its real and imaginary parts, the same shape.
    duties, sessions
        Amplitudes that coils played with, and in which of the converter's sessions, (frequencies,
        playing).
    high
        At 7.6 kHz, where flux is most of it.
    seconds
        That the device took.
    """

    frequencies_hz: FloatArray
    volts: ComplexArray
    noise: FloatArray
    duties: FloatArray
    sessions: FloatArray
    high: ReadAt
    seconds: float

    @classmethod
    def of(cls, low: Sequence[ReadAt], high: ReadAt, seconds: float) -> CoilReadings:
        """Of what was read at each frequency."""
        return cls(
            np.array([own.hz for own in low]),
            np.array([own.volts for own in low]),
            np.array([own.spread for own in low]),
            np.array([own.duties for own in low]),
            np.array([own.sessions for own in low]),
            high,
            seconds,
        )


def hidden_voltages(hidden: HiddenPlate, multiples: Sequence[int]) -> ComplexArray:
    """What motion alone induces, V/A, (multiples of 40 Hz, listening, playing)."""
    model = plate_model(hidden.board)
    strength = np.outer(hidden.strengths, hidden.strengths)
    found: list[ComplexArray] = []
    for multiple in multiples:
        frequency = multiple * UNIT_HZ
        try:
            moving = open_coils(hidden.board, frequency, model=model, tolerance=DRAWN_TOLERANCE)
        except ToleranceError:
            if multiple in MULTIPLES:
                raise
            # Of a board with a heavy part on it, that high up: it stands still.
            found.append(np.zeros_like(found[0]))
            continue
        found.append(strength * induced_voltages(hidden.board, moving.compliance, frequency))
    return np.array(found)


def turned_inductances(hidden: HiddenPlate) -> FloatArray:
    """Of every pair of coils as they are connected, H: a dead one has none led to the amplifier."""
    strength = np.outer(hidden.strengths, hidden.strengths)
    return np.asarray(np.sign(strength) * shared_inductances(hidden.board))
