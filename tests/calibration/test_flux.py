"""The reading at 7.6 kHz, which tells what coils share besides motion."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.calibration import hidden_plate
from chladni.host.device.device import Device
from chladni.host.device.wire import EmulatorWire
from chladni.host.emulation.sensed_plate import emulator_on
from chladni.host.measuring.coil_readings import read_coils
from chladni.sim.board.file import load_board


def test_all_coils_read_flux_at_one_level() -> None:
    """A dead neighbour hears nothing, so that the first coil is not found too loud at first.

    Five samples a wave at four fifths of full duty play half of what a twentieth would make one
    expect, and what one coil hears of another would be twice what that one hears of it.
    """
    strip = load_board("strip5")
    with Device(EmulatorWire(emulator_on(strip, hidden_plate(strip, 13)))) as device:
        high = read_coils(device, strip).high.volts.imag
    lives = [0, 2, 3, 4]
    own = high[np.ix_(lives, lives)]
    off = ~np.eye(len(lives), dtype=bool)
    assert own[off] == pytest.approx(own.T[off], rel=0.15)
