"""A device reads an accelerometer that stands on its plate: one coil plays after another.

The accelerometer samples by a clock of its own. The device tells when it found each sample, up to a
turn of its main loop late. A straight line through these times is the clock, and all that is left
is a delay that all values have in common, which the fit does not need (`fields_fit.py`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.constants import g as standard_g

from chladni.calibration.device_readings import coil_impedance, duty_volts
from chladni.calibration.laboratory.measured_fields import MeasuredFields
from chladni.calibration.sensing import LEVEL, MULTIPLES, UNIT_HZ
from chladni.host.device.device import Device
from chladni.host.device.wires.link import Answer
from chladni.host.measuring.coil_readings import ReadingError, check_device, finished
from chladni.host.protocol.codes import ACCELEROMETER
from chladni.host.protocol.link import BY_NAME, MOST_MOTIONS
from chladni.sim.board.board import Board

FloatArray = NDArray[np.float64]
Report = Callable[[int, int], None]

MOTION_MINOR = 10
"""Of the link: older devices know no such requests."""
RING_UP_MS = 60
"""The plate's and the accelerometer's filter's."""
STEPS_PER_G = {"LIS2DW12": 4096.0, "ADXL345": 256.0}
RANGE_G = {"LIS2DW12": 8.0, "ADXL345": 16.0}
FULL = 0.95
"""Of that range, from which a sample may be cut off."""
LIES_G = (0.7, 1.3)
"""Of the earth along z, either way up, where the part lies flat."""
CUT_OFF_HZ, ORDER = 400.0, 3
"""Both parts' filters have taken 3 dB there at 800 samples a second; how steep they are is not
said, and between 2 and 4 this is 4 % off at most at 240 Hz."""
HALVINGS, TRIES = 6, 3
BUMPED = 6.0
"""Times what is left of other requests, from which something else shook the board."""
CLEAR = 10.0
"""Times the noise, that one coil must make at least."""


def read_motions(
    device: Device,
    board: Board,
    at: tuple[float, float],
    sensor_kg: float,
    progress: Report | None = None,
) -> MeasuredFields:
    """Have a device play one coil after another, and read the accelerometer at a place, m.

    Raises
    ------
    ReadingError
        A finger came down, no accelerometer answers, it does not lie flat, or feels nothing.
    InputError
        The device is of another board, or its firmware is older.
    """
    check_device(device, board, MOTION_MINOR)
    reader, count = _Reader(device), len(board.actuators)
    rows = []
    for coil in range(count):
        for multiple in MULTIPLES:
            found, duty = reader.read(coil, multiple)
            amperes = duty * duty_volts(board) / coil_impedance(board, multiple * UNIT_HZ)
            rows.append((coil, multiple * UNIT_HZ, standard_g * found / amperes))
        if progress:
            progress(coil + 1, count)
    if reader.loudest < CLEAR:
        hint = "is it glued to the plate, and are the coils' supplies on?"
        raise ReadingError("the accelerometer feels none of the coils", hint=hint)
    coils, hz = (np.array([own[k] for own in rows]) for k in (0, 1))
    values = np.array([own[2] for own in rows], np.complex128)
    passed = 1.0 / np.sqrt(1.0 + (hz / CUT_OFF_HZ) ** (2 * ORDER))
    places = np.tile(np.array(at), (len(rows), 1))
    return MeasuredFields(coils, places, hz, values / passed, "acceleration", "current", sensor_kg)


class _Reader:
    def __init__(self, device: Device) -> None:
        self._device = device
        self._rate_hz = 2.0 * device.config().frame_rate_hz  # a frame is two samples
        self._left: list[float] = []
        self._level = LEVEL
        self.loudest = 0.0

    def read(self, coil: int, multiple: int) -> tuple[complex, float]:
        """The sine in g by the phase of the duty, as late as the part is, and the duty.

        What shook the part too much is read again at half; where something else shook it, once
        more.
        """
        tries = 0
        for _ in range(HALVINGS + TRIES):
            z, times, duty, model = self._sampled(coil, multiple)
            if np.abs(z).max() >= FULL * RANGE_G[model]:
                self._level /= 2.0
                continue
            found, steady, left = _sine(z, times, 2.0 * np.pi * multiple * UNIT_HZ)
            if not LIES_G[0] < abs(steady) < LIES_G[1]:
                expected = "lay it flat, its z axis up or down"
                raise ReadingError(f"the accelerometer reads {steady:.2f} g at rest", hint=expected)
            tries += 1
            if self._left and left > BUMPED * np.median(self._left) and tries < TRIES:
                continue
            self._left.append(left)
            self.loudest = max(self.loudest, abs(found) / (left * np.sqrt(2.0 / z.size)))
            return found, duty
        raise ReadingError(
            f"coil {coil + 1} shakes the accelerometer too much", hint="which part is it?"
        )

    def _sampled(self, coil: int, multiple: int) -> tuple[FloatArray, FloatArray, float, str]:
        """Samples, g, when each was taken, s, the duty's amplitude, and the part."""
        asked = {"playing": coil, "multiple": multiple}
        self._device.link.request(
            "motion_sense",
            b"",
            **asked,
            level_q15=round(self._level * 32767.0),
            settle_ms=RING_UP_MS,
            count=MOST_MOTIONS,
        )
        answer = finished(self._device, lambda: self._asked(0), asked)
        assert answer is not None
        rows, duty = _entries(answer), answer.fields["amplitude_q16"] / 65536.0
        while len(rows) < MOST_MOTIONS:
            more = _entries(self._asked(len(rows)))
            if not more:
                hint = "another program reads it too: end it, and calibrate again"
                raise ReadingError("the device told fewer samples than it took", hint=hint)
            rows += more
        model = ACCELEROMETER.text(answer.fields["model"])
        z, found_at = np.array(rows, np.float64).T
        times = np.unwrap(found_at, period=65536.0) / self._rate_hz
        number = np.arange(times.size)
        clock = np.asarray(np.polyval(np.polyfit(number, times, 1), number), np.float64)
        return z / STEPS_PER_G[model], clock, duty, model

    def _asked(self, first: int) -> Answer:
        return self._device.link.request("motion", first=first)


def _entries(answer: Answer) -> list[tuple[int, ...]]:
    entry = BY_NAME["motion"].entry
    count = answer.fields["count"]
    return [entry.unpack_from(answer.tail, k * entry.size) for k in range(count)]


def _sine(z: FloatArray, times: FloatArray, omega: float) -> tuple[complex, float, float]:
    """Of g: amplitude by the phase of cos ωt, mean, and RMS of what is left."""
    shapes = np.stack((np.cos(omega * times), -np.sin(omega * times), np.ones_like(times)), axis=1)
    found, *_ = np.linalg.lstsq(shapes, z, rcond=None)
    left = float(np.sqrt(np.mean((z - shapes @ found) ** 2)))
    return complex(found[0], found[1]), float(found[2]), max(left, 1e-9)
