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
from numpy.typing import ArrayLike, NDArray
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
    kg
        Its mass, cable's share and glue included.
    model
        Which part it is.
    """

    kg: float
    model: SensorModel = "LIS2DW12"


class ShakenPlate:
    """A hidden plate with an accelerometer, which stands at one of some places at a time.

    Parameters
    ----------
    places
        m, from the board's centre, (places, 2). The plate is solved for all of them at once.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """

    def __init__(
        self, hidden: HiddenPlate, sensor: Sensor, places: ArrayLike, seed: int = 0
    ) -> None:
        self._sensor = sensor
        # The same part wherever it stands.
        rng = np.random.default_rng((hidden.seed, seed, 46))
        off = 1.0 + np.array([CLOCK_ERROR, GAIN_ERROR]) * rng.uniform(-1.0, 1.0, 2)
        stands = np.asarray(places, np.float64)
        responses = _responses(hidden, sensor.kg, stands, order=int(rng.integers(*ORDERS)))
        self._responses = np.ascontiguousarray(off[1] * responses, np.float32)
        self._clock_hz = CLOCK_HZ * float(off[0])
        self._steady_g = 1.0 + OFFSET_G * rng.uniform(-1.0, 1.0)
        self._seed = int(rng.integers(1, 2**31))

    def stand(self, emulator: Emulator, place: int) -> None:
        """Put it on the plate of a device of `emulator_on`; where it stood it is taken off."""
        emulator.core.set_accelerometer(
            self._sensor.model,
            self._responses[place],
            address=ADDRESSES[self._sensor.model],
            clock_hz=self._clock_hz,
            noise_g=NOISE_G[self._sensor.model],
            steady_g=self._steady_g,
            seed=self._seed,
        )


def _responses(hidden: HiddenPlate, kg: float, places: FloatArray, *, order: int) -> FloatArray:
    """In g for a duty of 1, the newest first, (places, playing, duties)."""
    board = hidden.board
    coil = board.known_coil
    solved = np.array([own * UNIT_HZ for own in MULTIPLES])
    fields = FieldsAtPlaces(board, solved, kg, places)
    count = len(board.actuators)
    coils, stands = np.tile(np.arange(count), len(places)), np.repeat(places, count, axis=0)
    compliance = np.array([fields.at(row, coils, stands) for row in range(solved.size)])
    length = PERIODS * BASE_SAMPLES
    hz = np.asarray(np.fft.rfftfreq(length, 1.0 / SAMPLE_HZ), np.float64)
    between = compliance.reshape(solved.size, len(places), count)
    moved = compliance_between(hz, MULTIPLES, between, RESONANCES_HZ)
    newtons = coil.force_factor * duty_volts(board) / coil_impedance(board, hz)
    poles = scipy.signal.butter(order, 2.0 * np.pi * CUT_OFF_HZ, analog=True)
    _, passed = scipy.signal.freqs(*poles, worN=2.0 * np.pi * hz)
    shaken = -((2.0 * np.pi * hz) ** 2) * moved * newtons * passed / standard_g
    held = np.sinc(hz / SAMPLE_HZ) * np.exp(-1j * np.pi * hz / SAMPLE_HZ)
    return np.asarray(hidden.forces[:, None] * np.fft.irfft(shaken * held, n=length, axis=-1))
