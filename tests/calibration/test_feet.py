"""Calibration of what holds a board: feet, one that does not carry, and screws that are rigid."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from calibration.reading_arithmetic import read_hidden
from calibration.small_board import small_board
from chladni.calibration import fit_board, hidden_plate
from chladni.calibration.hidden import given_plate
from chladni.calibration.parameters import parameters_of
from chladni.calibration.unknowns import unknowns_of
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Spring
from chladni.sim.errors import InputError


@pytest.fixture(scope="module")
def board() -> Board:
    return small_board()


def on_feet(board: Board) -> Board:
    """Without foam four feet are all that holds it."""
    feet = tuple(
        Spring((x, y), 8e3, loss_factor=0.1) for x in (-26e-3, 26e-3) for y in (-28e-3, 28e-3)
    )
    return dataclasses.replace(board, foundation=None, springs=feet)


@pytest.mark.parametrize("seed", [1, 2])
def test_feet_that_carry_a_board_are_found(board: Board, seed: int) -> None:
    """Each of them, up to a quarter off; coils are loud near a resonance."""
    drawn = on_feet(board)
    hidden = hidden_plate(drawn, seed)
    each = np.array([own.stiffness for own in hidden.board.springs]) / 8e3
    true = hidden.ratios(drawn)["feet"]
    assert np.log(true) == pytest.approx(np.log(each).mean())
    assert not 0.9 < true < 1.1
    assert each.max() / each.min() > 1.1
    found = fit_board(drawn, read_hidden(hidden))
    assert found.wiring.signs.tolist() == np.sign(hidden.strengths).tolist()
    own = next(one for one in found.parameters if one.name == "feet")
    assert own.told
    assert own.low < true < own.high
    # Coils of a room that is 10 K off play 4 % more or less: feet are found by that much softer.
    assert own.value == pytest.approx(true, rel=0.07)
    feet = [one for one in found.parameters if one.name.startswith("foot ")]
    assert len(feet) == len(each)
    for one, ratio in zip(feet, each, strict=True):
        # Feet twice as stiff hold this board no better, and one of them is hardly told.
        assert one.told or seed == 2
        # On twelve plates 48 of 48 intervals hold the truth.
        assert one.low < ratio < one.high
        assert hidden.ratios(drawn)[one.name] == pytest.approx(ratio)
    told = np.array([one.stiffness for one in found.board.springs]) / 8e3
    assert told / own.value == pytest.approx(each / true, rel=0.1)


@pytest.mark.parametrize("share", [0.001, 0.07])
def test_a_foot_that_hardly_touches_or_does_not_is_named(board: Board, share: float) -> None:
    """No step leads to 0.1 %; of 7 % a coil seems to lie elsewhere."""
    drawn = on_feet(board)
    hidden = hidden_plate(drawn, 1)
    first, *others = hidden.board.springs
    loose = (dataclasses.replace(first, stiffness=share * first.stiffness), *others)
    strengths = np.abs(hidden.strengths)
    strengths[2] *= -1.0
    plate = dataclasses.replace(
        hidden, board=dataclasses.replace(hidden.board, springs=loose), strengths=strengths
    )
    with pytest.raises(InputError, match=r"foot at -26, -28 mm .* deviations off") as caught:
        fit_board(drawn, read_hidden(plate))
    told = str(caught.value)
    assert told.endswith(f"does it touch? Measure again; {board.actuators[2].name} is reversed")


def test_a_board_that_is_as_drawn_keeps_its_rigid_screws() -> None:
    """The fit softens screws by stand-offs, and none is as stiff as what the file draws."""
    board = load_board("prototype")
    found = fit_board(board, read_hidden(given_plate(board, board)))
    assert "screws" not in [own.name for own in found.parameters]
    assert found.board.screws == board.screws
    assert found.left < 1.5


def test_feet_that_mirror_each_other_are_not_told_apart_by_coils_between_them() -> None:
    """Their mean is known, and of each no more than that: all coils stand on the middle line."""
    board = on_feet(small_board())
    unknowns = unknowns_of(board)
    feet, count = unknowns.foot_values, unknowns.mean.size
    # Readings that tell each pair's sum to 2 %, the one that coils beside it would tell as well.
    rows = np.zeros((2, count))
    for row, pair in enumerate(((0, 1), (2, 3))):
        rows[row, [feet.start + own for own in pair]] = 1.0
        rows[row, unknowns.scales.index("feet")] = 2.0
    prior = np.diag(1.0 / unknowns.spread**2)
    told = [
        [own.told for own in parameters_of(unknowns, unknowns.mean, np.array(covariance))][-4:]
        for covariance in (
            np.linalg.inv(prior + rows.T @ rows / 0.02**2),
            np.linalg.inv(prior + np.eye(count) / 0.02**2),
        )
    ]
    assert told == [[False] * 4, [True] * 4]
