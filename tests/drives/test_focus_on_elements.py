"""The score of a board that focuses, again on finite elements with its foam and magnets in them."""

from __future__ import annotations

import numpy as np
import pytest

from conftest import shipped_board
from plate_fem.boards import compared_second_fingers

PLACES = [(0.0, 0.0), (0.0, 6.0), (0.0, -13.0), (1.5, 18.0), (0.0, 25.0), (-3.0, -20.0)]


@pytest.mark.slow
def test_second_fingers_of_strip5_are_those_on_finite_elements() -> None:
    """On a coil, between coils, at the end and off the middle line; two meshes.

    Silent discs lie 27 dB below the finger at most, so fields that agree to 2e-4 of their maximum
    agree there to 2e-4 · 22 = 0.4 %, 0.04 dB. Triangles of 2/3 the size leave half at most.
    `bench/second_finger.py` has the other boards.
    """
    board = shipped_board("strip5")
    apart = []
    for mesh in ((4e-3, 16), (3e-3, 24)):
        found = compared_second_fingers(board, PLACES, *mesh)
        apart.append(float(np.abs(found.elements - found.own).max()))
        assert found.own[:, 2].max() > 27.0
    assert apart[0] < 0.04
    assert apart[1] < apart[0] / 2.0
