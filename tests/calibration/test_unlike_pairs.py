"""Readings that no board makes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from calibration.reading_arithmetic import read_hidden
from chladni.calibration import hidden_plate
from chladni.calibration.wiring import find_wiring
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError


def test_a_pair_that_reads_unlike_is_named_though_80_hz_tells_nothing_of_it() -> None:
    """Each pair of phone5 at three tenths, but for one that is 13 deviations above noise in all."""
    board = load_board("phone5")
    readings = read_hidden(hidden_plate(board, 1))
    assert find_wiring(board, readings, readings.volts).signs.all()
    clear = np.argwhere(np.linalg.norm(readings.volts / readings.noise, axis=0) > 20.0).tolist()
    assert len(clear) == 18
    for i, j in clear:
        volts = readings.volts.copy()
        volts[:, i, j] *= 0.3
        names = [board.actuators[k].name for k in (i, j)]
        with pytest.raises(InputError, match="unlike readings") as caught:
            find_wiring(board, dataclasses.replace(readings, volts=volts), readings.volts)
        assert all(name in str(caught.value) for name in names)
