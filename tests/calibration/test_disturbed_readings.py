"""What happens to a board while its coils are read."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from calibration.reading_arithmetic import but_carrier, read_hidden
from calibration.small_board import small_board
from chladni.calibration import hidden_plate
from chladni.calibration.sensing import MOST_SECONDS
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.sensed_plate import emulator_on
from chladni.host.measuring.coil_readings import ReadingError, read_coils
from thermal import Coils


def test_a_blow_on_the_desk_is_read_again() -> None:
    """The plate rings at 150 Hz for a moment, as loud as a neighbour plays.

    Without a second reading values are five times as far off as is allowed here, which is what the
    firmware's readings and sines alone differ by (test_coil_readings.py).
    """
    board = small_board()
    hidden = hidden_plate(board, 1)
    emulator = emulator_on(board, hidden)
    with Device(EmulatorWire(emulator)) as device:
        emulator.core.bump(steps=300.0, hz=150.0, decay_s=0.1, after_s=2.0)
        found = read_coils(device, board)
    expected = read_hidden(hidden)
    apart = np.abs(but_carrier(found.volts - expected.volts, hidden)[0])
    allowed = 5.0 * np.hypot(found.noise, expected.noise) + 0.05 * np.abs(expected.volts)
    assert np.all(apart <= allowed)
    assert found.seconds <= MOST_SECONDS[False]


def test_a_coil_that_gets_hot_ends_a_reading() -> None:
    """Three times as hot as others, and twice as fast: by what the pins did it stays below 60 K."""
    board = small_board()
    electronics = dataclasses.replace(board.electronics, coil_k_per_w=300.0, coil_heating_s=5.0)
    board = dataclasses.replace(board, electronics=electronics)
    emulator = emulator_on(board, hidden_plate(board, 1))
    emulator.run(15_000.0)  # a device that was just switched on does not know how warm they are
    coils = Coils(emulator.config)
    with (
        Device(EmulatorWire(emulator)) as device,
        pytest.raises(ReadingError, match="coil 1 was not read: stopped"),
    ):
        read_coils(device, board)
    coils.take(emulator.run(30.0))
    assert 5.0 < coils.most_k < electronics.coil_limit_k
    assert not emulator.run(5.0).duty_steps.any()
    assert [cause for cause, _, _ in emulator.core.faults][-1] == "coil hot"
