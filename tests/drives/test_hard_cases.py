"""Scenes at the edge of what can be solved: every number stays finite, and means something."""

from __future__ import annotations

import dataclasses
import tomllib

import numpy as np
import pytest

from chladni.drives.methods import METHODS, Options
from chladni.drives.problem.field_space import FieldSpace
from chladni.drives.problem.problem import Problem, solved_board
from chladni.drives.scoring.scorecard import null_models, score, score_on
from chladni.drives.solve import solve, solve_problem
from chladni.sim.board.board import Board
from chladni.sim.board.file import board_from_document, shipped_boards
from chladni.sim.board.parts import Actuator
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError, ResonanceError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.image import metrics
from scorecards import all_finite


def with_actuators(board: Board, places_mm: list[tuple[float, float]]) -> Board:
    actuators = tuple(Actuator(f"a{k}", (x * MM, y * MM)) for k, (x, y) in enumerate(places_mm))
    # A board for study: nothing is wired.
    electronics = dataclasses.replace(board.electronics, pwm_pins=())
    return dataclasses.replace(board, actuators=actuators, electronics=electronics)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("name", "target"), [("prototype", (25.75, 0.0)), ("paper", (35.75, 10.0))]
)
def test_a_target_that_nothing_moves_is_said_to_be_one(
    request: pytest.FixtureRequest, method: str, name: str, target: tuple[float, float]
) -> None:
    """A screw's centre, and a supported edge, where even the target's own field is nothing."""
    board: Board = request.getfixturevalue(name)
    problem = solved_board(board).problem(target)
    solution = solve_problem(problem, method, Options(steps=50))
    card = score_on(problem, solution.field, null_models(problem))
    assert not card.movable
    assert all_finite(card)
    assert np.all(np.isfinite(solution.drive))
    assert np.abs(solution.drive).max() <= board.drive.max_gain * (1 + 1e-12)


@pytest.mark.parametrize("apart_mm", [0.1, 0.002])
def test_nearly_coincident_actuators_ask_for_no_more_than_one(
    paper: Board, apart_mm: float
) -> None:
    """At 0.1 mm the Gram matrix has a condition of 1e8 and more. As good as without one of them,
    within the default's own 1e-4, and the board still moves: no gain is spent on cancelling."""
    places = [(0.0, 0.0), (24.25, 43.35), (-24.25, 43.35), (24.25, -43.35), (-24.25, -43.35)]
    alone = with_actuators(paper, places)
    double = with_actuators(paper, [*places, (24.25 + apart_mm, 43.35)])
    for target in ((10.0, 25.0), (20.0, 40.0)):
        one, two = (solve(board, target) for board in (alone, double))
        assert two.ssim >= one.ssim - 1e-4
        assert np.abs(two.drive).max() == pytest.approx(paper.drive.max_gain)
        assert np.abs(two.field).max() > 0.01 * np.abs(one.field).max()
        assert all_finite(score(two, double))
    space = solved_board(double).space
    assert space.condition > 1e3
    assert space.rank <= 6


def test_the_search_leaves_weak_directions_out() -> None:
    rng = np.random.default_rng(0)
    fields = rng.normal(size=(3, 20, 30)) + 0j
    twin = np.concatenate((fields, fields[:1] * (1 + 1e-9)))
    assert FieldSpace(twin).rank == 3
    assert FieldSpace(np.zeros((2, 20, 30), dtype=complex)).rank == 1


def with_loss(board: Board, loss_factor: float) -> Board:
    return dataclasses.replace(
        board, plate=dataclasses.replace(board.plate, loss_factor=loss_factor)
    )


def test_real_fields_have_a_solution_as_good(paper: Board) -> None:
    """Without loss every transfer field is real; 1e-4 of loss must not change what is reached."""
    assert not solved_board(paper).fields.values.imag.any()
    target = (10.0, 25.0)
    assert solve(paper, target).ssim == pytest.approx(
        solve(with_loss(paper, 1e-4), target).ssim, abs=1e-3
    )


def test_a_silent_field_is_scored(prototype: Board) -> None:
    problem = solved_board(prototype).problem((10.0, 25.0))
    card = score_on(problem, np.zeros_like(problem.wanted), null_models(problem))
    assert all_finite(card)
    assert card.ssim == card.nulls.silent


def test_a_constant_target_image_is_solved(prototype: Board) -> None:
    solved = solved_board(prototype)
    problem = Problem(solved, (10.0, 25.0), np.ones_like(solved.fields.values[0]))
    assert not problem.image.any()
    for objective in ("ssim", "balanced", "focus", "contrast"):
        solution = solve_problem(problem, "phasor", Options(objective))
        assert np.all(np.isfinite(solution.drive))
        assert np.isfinite(solution.ssim)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_a_target_field_that_is_no_number_is_refused(prototype: Board, bad: float) -> None:
    solved = solved_board(prototype)
    wanted = np.ones_like(solved.fields.values[0])
    wanted[3, 4] = bad
    with pytest.raises(InputError, match="finite numbers"):
        Problem(solved, (0.0, 0.0), wanted)
    with pytest.raises(InputError, match="an image of"):
        Problem(solved, (0.0, 0.0), wanted[:-1])


def test_one_actuator(prototype: Board) -> None:
    """Nothing to search: one field, whatever the drive."""
    single = with_actuators(prototype, [(0.0, 0.0)])
    for method in METHODS:
        solution = solve(single, (10.0, 25.0), method=method, steps=20)
        assert solution.drive == pytest.approx(
            [
                single.drive.max_gain
                * np.exp(-1j * np.angle(solved_board(single).problem((10.0, 25.0)).at_target[0]))
            ]
        )
        assert all_finite(score(solution, single))


def test_sixty_four_actuators_reach_higher(paper: Board) -> None:
    """More coils can only help; the climb has 128 variables then."""
    places = [(9.0 * (i - 3.5), 18.0 * (j - 3.5)) for i in range(8) for j in range(8)]
    many = with_actuators(paper, places)
    solution = solve(many, (10.0, 25.0))
    assert solution.ssim > solve(paper, (10.0, 25.0)).ssim
    assert solution.ssim > 0.998
    assert all_finite(score(solution, many))


def test_at_a_resonance(paper: Board) -> None:
    """With loss a mode takes over and every field looks alike; without, the mode is named."""
    mode = float(plate_model(paper).natural_frequencies(2)[1])
    at_mode = dataclasses.replace(paper, drive=dataclasses.replace(paper.drive, frequency_hz=mode))
    damped = with_loss(at_mode, 0.02)
    solution = solve(damped, (10.0, 25.0))
    assert all_finite(score(solution, damped))
    assert solution.ssim > 0.9
    with pytest.raises(ResonanceError, match="mode"):
        solve(at_mode, (10.0, 25.0))


def test_a_drive_limit_of_zero_is_refused() -> None:
    document = tomllib.loads(shipped_boards()["paper"].read_text(encoding="utf-8"))
    document["drive"]["max_gain"] = 0.0
    with pytest.raises(InputError, match="max_gain"):
        board_from_document(document)


def test_metrics_of_the_found_field_are_those_reported(prototype: Board) -> None:
    problem = solved_board(prototype).problem((-12.0, 40.0))
    solution = solve_problem(problem, "phasor", Options())
    image = np.abs(np.tensordot(solution.drive, problem.transfer, axes=1))
    assert metrics.ssim(image, np.abs(problem.wanted)) == solution.ssim
