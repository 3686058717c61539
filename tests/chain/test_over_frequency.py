"""A plate over frequency: what splines make of the frequencies at which it is solved."""

from __future__ import annotations

import weakref
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from chladni.calibration.hidden import HiddenPlate
from chladni.drives.problem.problem import solved_board
from chladni.host.emulation import felt_over_time
from chladni.host.emulation.felt_over_time import TOGETHER, FingerPlate, Fingers, fingers_on
from chladni.host.emulation.over_frequency import GRID_HZ, Plates, frequencies_of, over_frequency
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM


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


def test_fingers_solved_for_together_are_those_solved_for_alone() -> None:
    """More sets than one group, of one finger and two, without and with places beside them."""
    solved = [solved_board(load_board("strip5")).at_frequency(hz) for hz in (120.0, 160.0)]
    rng = np.random.default_rng(5)
    sets: list[Fingers] = []
    for k in range(TOGETHER + 3):
        sets.append((rng.uniform((-6.0, -26.0), (6.0, 26.0), (1 + k % 2, 2)) * MM, None))
    beside = np.array([(0.0, 20.0), (3.0, -20.0)]) * MM
    others: list[Fingers] = [(places, beside) for places, _ in sets[:2]]
    found = [*FingerPlate.of_each(solved, sets, 1.0), *FingerPlate.of_each(solved, others, 1.0)]
    sets += others
    assert len(found) == len(sets)
    for one, (places, unpressed) in zip(found, sets, strict=True):
        alone = FingerPlate.of(solved, places, 1.0, unpressed)
        assert len(one.free) == len(places) + (0 if unpressed is None else len(unpressed))
        for ours, theirs in zip(one.free + one.pushes, alone.free + alone.pushes, strict=True):
            # Rounding in matrices of condition 1e7 or so: other columns beside them change it.
            assert np.abs(ours - theirs).max() == pytest.approx(
                0.0, abs=1e-8 * np.abs(theirs).max()
            )


def test_a_plate_that_was_given_away_is_not_held_beside_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With unpressed places its discs take hundreds of megabytes."""
    solved = [solved_board(load_board("strip5")).at_frequency(hz) for hz in (120.0, 160.0)]
    board = solved[0].board
    beside = np.array([(0.0, 20.0)]) * MM
    sets: list[Fingers] = [(np.array([(0.0, y)]) * MM, beside) for y in (-10.0, 0.0, 5.0)]
    hidden = HiddenPlate(board, np.ones(5), np.ones(5), 0, "its twin")
    held: list[weakref.ref[FingerPlate]] = []
    alive, solve = [], felt_over_time._discs

    def watched(*asked: Any) -> Any:
        alive.append(sum(one() is not None for one in held))
        return solve(*asked)

    monkeypatch.setattr(felt_over_time, "_discs", watched)
    for known, there in fingers_on(Plates(solved, hidden, solved), sets, 1.0):
        assert known is not there
        held += [weakref.ref(known), weakref.ref(there)]
        del known, there
    assert alive == [0] * (2 * len(sets))
