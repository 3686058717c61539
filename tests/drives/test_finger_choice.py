"""The rule for λ of several fingers, on numbers of which the answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.drives.fingers.choice import LOUDEST, STILLER, chosen_drives
from chladni.drives.fingers.silence import REGULARISATION, drives_for
from chladni.sim.errors import ArgumentError
from finger_sets import MadeUpPlate, random_plate


def nearly_one(difference: float) -> MadeUpPlate:
    """Two fingers that differ in what coils do by a share of it."""
    plate = random_plate(np.random.default_rng(11), 2, 5, scale=1e-5)
    points = plate.points.copy()
    points[1] = points[0] + difference * points[1]
    return MadeUpPlate(plate.centres, points, plate.own, plate.coupling)


def test_a_share_that_is_unfelt_keeps_the_level() -> None:
    plate = random_plate(np.random.default_rng(1), 2, 16)
    shares = drives_for(plate, plate.fingers).shares
    above = [float(2.0 * shares.max())] * 2
    assert np.all(
        chosen_drives(plate, plate.fingers, thresholds=above).regularisation == REGULARISATION
    )


def test_a_share_that_is_felt_is_made_stiller() -> None:
    plate = random_plate(np.random.default_rng(1), 2, 16)
    first = drives_for(plate, plate.fingers)
    below = [1e-3 * float(first.shares[0, 1])] * 2
    found = chosen_drives(plate, plate.fingers, thresholds=below)
    assert np.all(found.regularisation == STILLER)
    assert np.all(found.found.isolation_db > first.isolation_db + 10.0)


def test_a_level_counts_in_what_is_felt() -> None:
    plate = random_plate(np.random.default_rng(1), 2, 16)
    share = float(drives_for(plate, plate.fingers).shares[0, 1])
    for level, expected in ((0.5, REGULARISATION), (1.5, STILLER)):
        found = chosen_drives(plate, plate.fingers, thresholds=[share, share], levels=[level, 1.0])
        assert found.regularisation[0] == expected


def test_a_drive_too_quiet_is_given_up_for_one_that_the_other_hears_less_than_its_own() -> None:
    plate = nearly_one(0.02)
    first = drives_for(plate, plate.fingers)
    assert np.all(first.below_loudest_db < -20.0)
    found = chosen_drives(plate, plate.fingers, thresholds=[0.0, 0.0])
    for own, other in ((0, 1), (1, 0)):
        taken = found.regularisation[own]
        if taken > REGULARISATION:
            assert found.found.shares[own, other] <= first.shares[other, other]
            assert found.found.below_loudest_db[own] > first.below_loudest_db[own]


def test_beside_a_finger_that_plays_nothing_a_quiet_drive_gets_loud_until_that_one_feels_it() -> (
    None
):
    plate = nearly_one(0.02)
    levels = [1.0, 0.0]
    loud = chosen_drives(plate, plate.fingers, thresholds=[0.0, 1.0], levels=levels)
    assert REGULARISATION < loud.regularisation[0] <= LOUDEST
    assert loud.found.below_loudest_db[0] >= -20.0
    still = chosen_drives(plate, plate.fingers, thresholds=[0.0, 0.0], levels=levels)
    assert still.regularisation[0] == REGULARISATION


def test_each_finger_needs_a_threshold() -> None:
    plate = nearly_one(0.5)
    with pytest.raises(ArgumentError, match="thresholds"):
        chosen_drives(plate, plate.fingers, thresholds=[0.0])
