"""An accelerometer that stands on an emulated device's plate, at a place of one's choice.

It has a clock, a gain and a filter of its own, each as far off as data sheets allow. Motion is
solved with its mass at the frequencies that are read. Between them it is a smooth curve, as it is
for coils (`sensed_plate.py`). Its cable is left out, and so is what moves along the plate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.constants import g as standard_g

from chladni.calibration.device_readings import coil_impedance, duty_volts
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.laboratory.fields_at_places import FieldsAtPlaces
from chladni.calibration.sensing import BASE_SAMPLES, MULTIPLES, SAMPLE_HZ, UNIT_HZ
from chladni.host.emulation.emulator import Emulator
from chladni.host.emulation.sensed_plate import PERIODS, compliance_between

FloatArray = NDArray[np.float64]

SensorModel = Literal["LIS2DW12", "ADXL345"]
ADDRESSES: dict[SensorModel, int] = {"LIS2DW12": 0x19, "ADXL345": 0x53}
NOISE_G: dict[SensorModel, float] = {"LIS2DW12": 1.8e-3, "ADXL345": 4.5e-3}
"""RMS of a sample over 400 Hz: 90 µg/√Hz, and a step or so of 3.9 mg."""
CLOCK_HZ, CLOCK_ERROR, GAIN_ERROR, OFFSET_G = 800.0, 0.02, 0.03, 0.03
CUT_OFF_HZ, ORDERS = 400.0, (2, 5)
"""Where its filter has taken 3 dB, and of which orders (the last not) it may be."""
RESONANCES_HZ = (110.0, 240.0, 500.0)


@dataclass(frozen=True)
class Sensor:
    """What stands on the plate.

    Attributes
    ----------
    at
        m, from the board's centre.
    kg
        Its mass, cable's share and glue included.
    model
        Which part it is.
    """

    at: tuple[float, float]
    kg: float
    model: SensorModel = "LIS2DW12"


def stand(emulator: Emulator, hidden: HiddenPlate, sensor: Sensor, seed: int = 0) -> None:
    """Put an accelerometer on an emulated device's plate; one that stood there is taken off.

    The device is one of `emulator_on`.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    # The same part wherever it stands.
    rng = np.random.default_rng((hidden.seed, seed, 46))
    off = 1.0 + np.array([CLOCK_ERROR, GAIN_ERROR]) * rng.uniform(-1.0, 1.0, 2)
    order = int(rng.integers(*ORDERS))
    emulator.core.set_accelerometer(
        sensor.model,
        np.ascontiguousarray(off[1] * _responses(hidden, sensor, order), np.float32),
        address=ADDRESSES[sensor.model],
        clock_hz=CLOCK_HZ * off[0],
        noise_g=NOISE_G[sensor.model],
        steady_g=1.0 + OFFSET_G * rng.uniform(-1.0, 1.0),
        seed=int(rng.integers(1, 2**31)),
    )


def _responses(hidden: HiddenPlate, sensor: Sensor, order: int) -> FloatArray:
    """In g for a duty of 1, the newest first, (playing, duties)."""
    board = hidden.board
    coil = board.known_coil
    place = np.array([sensor.at])
    solved = np.array([own * UNIT_HZ for own in MULTIPLES])
    fields = FieldsAtPlaces(board, solved, sensor.kg, place)
    count = len(board.actuators)
    compliance = np.array(
        [
            fields.at(row, np.arange(count), np.repeat(place, count, axis=0))
            for row in range(solved.size)
        ]
    )
    length = PERIODS * BASE_SAMPLES
    hz = np.asarray(np.fft.rfftfreq(length, 1.0 / SAMPLE_HZ), np.float64)
    moved = compliance_between(hz, MULTIPLES, compliance, RESONANCES_HZ)
    newtons = coil.force_factor * duty_volts(board) / coil_impedance(board, hz)
    poles = scipy.signal.butter(order, 2.0 * np.pi * CUT_OFF_HZ, analog=True)
    _, passed = scipy.signal.freqs(*poles, worN=2.0 * np.pi * hz)
    shaken = -((2.0 * np.pi * hz) ** 2) * moved * newtons * passed / standard_g
    held = np.sinc(hz / SAMPLE_HZ) * np.exp(-1j * np.pi * hz / SAMPLE_HZ)
    return np.asarray(hidden.forces[:, None] * np.fft.irfft(shaken * held, n=length, axis=-1))
