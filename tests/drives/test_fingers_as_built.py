"""Several fingers on a board as it is built: each row from the parts that it is made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.drives.fingers import responses_at
from chladni.drives.methods import SEED
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.as_built import with_film
from chladni.drives.scoring.kept_focus import FOAM_TWICE
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet, finger_sets
from chladni.drives.scoring.several_fingers.fingers_as_built import (
    FingersAsBuilt,
    score_fingers_as_built,
)
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers, solver_of
from chladni.drives.scoring.tolerances import with_foam
from chladni.drives.scoring.warm_coils import warm
from chladni.sim.board.board import Board
from chladni.sim.errors import ArgumentError
from chladni.sim.image.finger import pressing_stiffness
from conftest import made_once, shipped_board

SETS = 3


@pytest.fixture(scope="module")
def strip() -> Board:
    return shipped_board("strip5")


@pytest.fixture(scope="module")
def built(strip: Board, tmp_path_factory: pytest.TempPathFactory) -> FingersAsBuilt:
    def make() -> FingersAsBuilt:
        return score_fingers_as_built(strip, 2, sets=SETS, samples=2, regularisation=1e-3)

    return made_once(tmp_path_factory, "fingers-as-built", make)


def test_what_is_drawn_is_the_boards_own_score(strip: Board, built: FingersAsBuilt) -> None:
    (two,) = score_fingers(strip, (2,), sets=SETS, samples=0, regularisation=1e-3).counts
    assert vars(built.nominal.isolation_db) == pytest.approx(vars(two.isolation_db))
    assert two.finger_um is not None
    assert vars(built.nominal.finger_um) == pytest.approx(vars(two.finger_um))


def test_stiffer_foam_is_another_board_under_the_same_drives(
    strip: Board, built: FingersAsBuilt
) -> None:
    """Fields of random boards are known to a hundredth: 0.1 dB where 26 dB are kept apart."""
    solve = solver_of(strip, responses_at(solved_board(strip)), 1e-3)
    stiffer = with_foam(strip, FOAM_TWICE)
    (two,) = score_fingers(stiffer, (2,), sets=SETS, samples=0, solve=solve).counts
    assert built.foam_twice is not None
    assert built.foam_twice.isolation_db.p10 == pytest.approx(two.isolation_db.p10, abs=0.3)
    assert built.foam_twice.finger_um is not None
    assert two.finger_um is not None
    assert built.foam_twice.finger_um.median == pytest.approx(two.finger_um.median, rel=0.01)
    assert built.nominal.finger_um is not None
    assert two.finger_um.median < 0.75 * built.nominal.finger_um.median


def test_a_film_is_known_to_its_drives(strip: Board, built: FingersAsBuilt) -> None:
    (two,) = score_fingers(with_film(strip), (2,), sets=SETS, samples=0, regularisation=1e-3).counts
    assert built.film is not None
    assert vars(built.film.isolation_db) == pytest.approx(vars(two.isolation_db))


def test_warm_coils_pull_as_their_magnets_do(strip: Board, built: FingersAsBuilt) -> None:
    """The sets by hand, every coil's force as warm as both drives together make it."""
    solved = solved_board(strip)
    places = finger_sets(strip, 2, SETS, 16e-3, np.random.default_rng(SEED))
    solve = solver_of(strip, responses_at(solved), 1e-3)
    found = []
    for own in FingerSet.of_all(solved, places, pressing_stiffness(1.0, 160.0)):
        drives = solve(own.places)
        heat = warm(strip, np.abs(drives).sum(axis=0).astype(np.complex128))
        assert heat is not None
        found.append(own.isolation_db(drives * heat.forces))
    assert built.warm.isolation_db.median == pytest.approx(np.median(found), rel=1e-9)


def test_a_thin_sheet_is_bent_and_all_at_once_is_worst(built: FingersAsBuilt) -> None:
    assert built.stretched is not None
    assert built.stretched.isolation_db != built.nominal.isolation_db
    assert built.together.isolation_db.median < built.nominal.isolation_db.median - 5.0
    assert built.together.isolation_db.median > 15.0
    assert built.together.finger_um is not None
    assert built.nominal.finger_um is not None
    assert built.together.finger_um.median < 0.6 * built.nominal.finger_um.median


def test_nothing_bends_a_thick_sheet_and_nothing_is_laid_on_a_film(strip: Board) -> None:
    thick = replace(strip, plate=replace(strip.plate, thickness=0.8e-3))
    found = score_fingers_as_built(with_film(thick), 2, sets=1, samples=1)
    assert found.stretched is None
    assert found.film is None


@pytest.mark.parametrize("newtons", [0.01, 11.0])
def test_no_finger_presses_so(strip: Board, newtons: float) -> None:
    with pytest.raises(ArgumentError, match="press"):
        score_fingers_as_built(strip, 2, newtons=newtons)
