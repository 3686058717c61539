"""A plate over frequency: what splines make of the frequencies at which it is solved."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from chladni.drives.problem.problem import solved_board
from chladni.host.emulation.felt_over_time import GRID_HZ, frequencies_of, over_frequency
from chladni.sim.board.file import load_board


def test_a_plate_that_resonates_is_solved_closer_there() -> None:
    """`prototype` resonates from 545 Hz on, 10 Hz wide: without more frequencies splines are off by
    as much as there is, and a finger rings before it is touched."""
    board = load_board("prototype")
    found = over_frequency(board)
    hz = frequencies_of(found)
    assert np.all(np.diff(hz) > 0.0)
    assert set(GRID_HZ) < set(hz.tolist())
    assert np.all(np.isin(hz[hz < 400.0], GRID_HZ))  # nothing resonates there
    values = np.array([np.asarray(own.fields.values)[:, ::9, ::9] for own in found])
    plate = solved_board(board)
    for between in (553.0, 566.0, 583.0):
        exact = np.asarray(plate.at_frequency(between).fields.values)[:, ::9, ::9]
        off = np.abs(CubicSpline(hz, values)(between) - exact)
        assert off.max() < 0.05 * np.abs(exact).max()
