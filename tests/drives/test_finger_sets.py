"""Several fingers on a board at once, against fingers put on it one after another."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet, finger_sets
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.errors import ArgumentError
from chladni.sim.image import metrics
from chladni.sim.image.finger import fields_under_finger, pressing_stiffness
from chladni.sim.ritz.solver import Solver
from conftest import shipped_board

APART = 16e-3
STIFFNESS = pressing_stiffness(1.0, 160.0)


@pytest.fixture(scope="module")
def board() -> Board:
    own = shipped_board("strip5")
    return replace(own, image=replace(own.image, points=(29, 121)))


@pytest.fixture(scope="module")
def solved(board: Board) -> SolvedBoard:
    return solved_board(board)


def test_fingers_together_are_fingers_put_down_one_after_another(solved: SolvedBoard) -> None:
    """A rank-one change each, of coils' fields and of what the fingers to come will do."""
    board = solved.board
    places = finger_sets(board, 3, 1, APART, np.random.default_rng(3))[0]
    masks = [
        metrics.disc_mask(board.x, board.y, (x, y), metrics.FINGERTIP_RADIUS)
        for x, y in places.tolist()
    ]
    fields = solved.fields.values
    answers = solved.under_finger([(1e3 * x, 1e3 * y) for x, y in places.tolist()])
    for k, mask in enumerate(masks):
        one, own = answers[k], complex(answers[k][mask].mean())

        def under(
            all_fields: np.ndarray,
            mask: np.ndarray = mask,
            one: np.ndarray = one,
            own: complex = own,
        ) -> np.ndarray:
            means = all_fields[..., mask].mean(axis=-1)
            return fields_under_finger(all_fields, means, one, own, STIFFNESS)

        fields, answers = under(fields), under(answers)
    found = FingerSet.of(solved, places, STIFFNESS)
    for disc, mask in zip(found.discs, masks, strict=True):
        wanted = fields[:, mask].T
        # Sums of some ten terms of like size, in double precision.
        assert np.abs(disc - wanted).max() < 1e-11 * np.abs(wanted).max()


def test_many_sets_are_each_set_alone(solved: SolvedBoard) -> None:
    places = finger_sets(solved.board, 2, 9, APART, np.random.default_rng(4))
    drives = np.eye(5, dtype=np.complex128)[:2]
    together = list(FingerSet.of_all(solved, places, STIFFNESS))
    assert len(together) == len(places)
    for own, many in zip(places[[0, 8]], (together[0], together[8]), strict=True):
        alone = FingerSet.of(solved, own, STIFFNESS)
        np.testing.assert_allclose(many.shares(drives), alone.shares(drives), rtol=1e-9)
        one, other = many.means(drives), alone.means(drives)
        assert np.abs(one - other).max() < 1e-9 * np.abs(other).max()


def test_fingers_take_no_matrices_that_coils_did_not(
    board: Board, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What fingers do is as exact as what coils do, whatever that was to be."""
    made = []

    class Counted(Solver):
        def __init__(self, *given: Any) -> None:
            made.append(given)
            super().__init__(*given)

    monkeypatch.setattr("chladni.sim.ritz.plate.Solver", Counted)
    targets = [(0.0, 20.0), (2.0, -11.0)]
    rough = SolvedBoard.of(board, DRAWN_TOLERANCE)
    coils = len(made)
    found = rough.under_finger(targets)
    assert len(made) == coils > 0
    exact = SolvedBoard.of(board, 0.01 * DRAWN_TOLERANCE).under_finger(targets)
    assert len(made) > coils
    off = np.linalg.norm(found - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    assert np.all(off < DRAWN_TOLERANCE)


def test_shares_are_root_mean_squares_and_isolation_their_ratio() -> None:
    """Two discs of two points: 3 and 4 under the first, 1 and 1 under the second."""
    discs = [np.array([[3.0, 0.1], [4.0j, 0.1]]), np.array([[1.0, 10.0], [-1.0, 10.0]])]
    own = FingerSet(np.zeros((2, 2)), [disc.astype(np.complex128) for disc in discs])
    drives = np.eye(2, dtype=np.complex128)
    rms = np.sqrt(12.5)
    np.testing.assert_allclose(own.shares(drives), [[rms, 1.0], [0.1, 10.0]])
    assert np.abs(own.means(drives) - np.array([[1.5 + 2.0j, 0.0], [0.1, 10.0]])).max() < 1e-15
    np.testing.assert_allclose(own.isolation_db(drives), [20.0 * np.log10(rms), 40.0])


def test_drawn_fingers_keep_apart_and_off_the_edges(board: Board) -> None:
    places = finger_sets(board, 3, 50, APART, np.random.default_rng(5))
    margin = board.active.margin if board.active else 3e-3
    assert np.all(np.abs(places) <= np.array(board.plate.size) / 2.0 - margin)
    for a, b in ((0, 1), (0, 2), (1, 2)):
        assert np.hypot(*(places[:, a] - places[:, b]).T).min() >= APART
    with pytest.raises(ArgumentError, match="apart"):
        finger_sets(board, 5, 1, 0.5, np.random.default_rng(6))
