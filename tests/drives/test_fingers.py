"""Drives of several fingers, on plates of which everything is known in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.drives.fingers import drives_for, fitted_coupling, responses_at
from chladni.drives.fingers.responses import interpolated
from chladni.drives.fingers.silence import disc_weights, loaded_points, ring_offsets
from chladni.drives.problem.problem import solved_board
from chladni.sim.errors import ArgumentError
from chladni.sim.image import metrics
from conftest import shipped_board

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
STIFFNESS = 2e3 + 2e3j
FINGERS = [(-0.02, 0.01), (0.015, -0.012), (0.02, 0.03)]


@dataclass(frozen=True)
class SixModes:
    """A plate that moves in six shapes, 1, x, y, x², xy and y².

    The mean of each over a fingertip is that of its seven points, and eight coils tell all six.
    """

    seed: int = 0

    @cached_property
    def compliance(self) -> ComplexArray:
        rng = np.random.default_rng(self.seed)
        half = rng.normal(size=(6, 6)) + 0.1j * rng.normal(size=(6, 6))
        return np.asarray(1e-4 * (half @ half.T + 0.5 * np.eye(6)), np.complex128)

    @cached_property
    def coils(self) -> ComplexArray:
        """Shapes at eight coils, (6, 8)."""
        return self.shapes(np.random.default_rng(self.seed + 1).uniform(-0.03, 0.03, (8, 2))).T

    @staticmethod
    def shapes(places: FloatArray) -> ComplexArray:
        x, y = places.T / 0.03
        return np.stack((np.ones(x.shape), x, y, x * x, x * y, y * y), axis=1).astype(np.complex128)

    def under(self, places: FloatArray) -> ComplexArray:
        """Mean shapes under fingertips, in closed form: x² gains a²/4 of its disc's radius a."""
        found = self.shapes(places)
        found[:, [3, 5]] += (metrics.FINGERTIP_RADIUS / 0.03) ** 2 / 4.0
        return found

    @cached_property
    def coupling(self) -> ComplexArray:
        places = np.random.default_rng(self.seed + 2).uniform(-0.05, 0.05, (60, 2))
        shapes = self.under(places)
        return fitted_coupling(
            places, shapes @ self.compliance @ self.coils, shapes @ self.compliance @ shapes.T
        )

    def at(self, places: FloatArray) -> ComplexArray:
        return np.asarray(self.shapes(places) @ self.compliance @ self.coils)

    def own_at(self, places: FloatArray) -> ComplexArray:
        shapes = self.under(places)
        return np.asarray(np.einsum("pi,ij,pj->p", shapes, self.compliance, shapes))


@pytest.fixture
def plate() -> SixModes:
    return SixModes()


def test_the_points_weights_are_a_discs_mean() -> None:
    """Of every field of second order; by the closed form of x² over a disc, a²/4."""
    points = ring_offsets()
    assert np.isclose(disc_weights().sum(), 1.0)
    np.testing.assert_allclose(
        disc_weights() @ (points[:, 0] ** 2), metrics.FINGERTIP_RADIUS**2 / 4.0, rtol=1e-12
    )
    np.testing.assert_allclose(disc_weights() @ (points[:, 0] * points[:, 1]), 0.0, atol=1e-18)


def test_a_coupling_that_coils_can_tell_is_found_exactly(plate: SixModes) -> None:
    """h̄ᵀ M h̄ is g for any two places, also for those that were not fitted."""
    places = np.random.default_rng(9).uniform(-0.03, 0.03, (5, 2))
    means = plate.under(places) @ plate.compliance @ plate.coils
    shapes = plate.under(places)
    wanted = shapes @ plate.compliance @ shapes.T
    np.testing.assert_allclose(
        means @ plate.coupling @ means.T, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max()
    )
    np.testing.assert_allclose(plate.coupling, plate.coupling.T)


def test_without_two_places_apart_nothing_couples() -> None:
    means = np.ones((2, 3), dtype=np.complex128)
    found = fitted_coupling(np.zeros((2, 2)), means, np.ones((2, 2), dtype=np.complex128))
    assert not np.any(found)


def test_a_dead_coil_couples_nothing_and_leaves_the_others_as_they_are_without_it() -> None:
    plate = SixModes()
    places = np.random.default_rng(7).uniform(-0.05, 0.05, (60, 2))
    shapes = plate.under(places)
    pairs = shapes @ plate.compliance @ shapes.T
    means = (shapes @ plate.compliance @ plate.coils)[:, :6]
    means[:, 2] = 0.0
    found = fitted_coupling(places, means, pairs)
    assert not np.any(found[2])
    others = fitted_coupling(places, np.delete(means, 2, axis=1), pairs)
    lives = np.delete(np.delete(found, 2, axis=0), 2, axis=1)
    # Both are least squares of the same columns, up to the order that rounding takes.
    np.testing.assert_allclose(lives, others, rtol=0, atol=1e-6 * np.abs(others).max())


def test_fingers_on_the_plate_are_springs_in_its_modes(plate: SixModes) -> None:
    """q = (A⁻¹ + Z Σ φ̄ φ̄ᵀ)⁻¹ Φ: the plate solved with all fingers in it, and no formula of ours."""
    places = np.array(FINGERS)
    shapes = plate.under(places)
    stiffened = np.linalg.inv(plate.compliance) + STIFFNESS * shapes.T @ shapes
    wanted = shapes @ np.linalg.solve(stiffened, plate.coils)
    points = loaded_points(plate, places, STIFFNESS)
    found = np.einsum("p,fpa->fa", disc_weights(), points)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-5 * np.abs(wanted).max())
    free = np.einsum("p,fpa->fa", disc_weights(), loaded_points(plate, places, 0.0))
    assert np.abs(free - wanted).max() > 0.3 * np.abs(wanted).max()


@pytest.mark.parametrize("regularisation", [1e-1, 1e-3, 1e-5])
def test_a_drive_is_the_constrained_optimum(plate: SixModes, regularisation: float) -> None:
    """By the form over points, solved as least squares: min |d − h̄*|² + |H d|²/λ."""
    points = loaded_points(plate, np.array(FINGERS), STIFFNESS)
    means = np.einsum("p,fpa->fa", disc_weights(), points)
    found = drives_for(plate, FINGERS, stiffness=STIFFNESS, regularisation=regularisation).drives
    for own in range(3):
        others = np.concatenate([points[k] for k in range(3) if k != own])
        raised = regularisation * float((np.abs(others) ** 2).sum()) / len(others)
        rows = np.concatenate((np.eye(8), others / np.sqrt(raised)))
        aims = np.concatenate((means[own].conj(), np.zeros(len(others))))
        wanted = np.linalg.lstsq(rows, aims, rcond=None)[0]
        wanted /= np.abs(wanted).max()
        np.testing.assert_allclose(found[own], wanted, rtol=0, atol=1e-7)


def test_less_regularisation_isolates_more_and_costs_level(plate: SixModes) -> None:
    loud, still = (
        drives_for(plate, FINGERS, stiffness=STIFFNESS, regularisation=each)
        for each in (1e-2, 1e-4)
    )
    assert np.all(still.isolation_db > loud.isolation_db)
    assert np.all(still.below_loudest_db <= 0.0)
    assert still.below_loudest_db.mean() < loud.below_loudest_db.mean()


def test_one_finger_alone_gets_the_loudest_drive(plate: SixModes) -> None:
    (drive,) = drives_for(plate, FINGERS[:1], stiffness=STIFFNESS).drives
    points = loaded_points(plate, np.array(FINGERS[:1]), STIFFNESS)[0]
    wanted = (disc_weights() @ points).conj()
    np.testing.assert_allclose(drive, wanted / np.abs(wanted).max(), atol=1e-12)


def test_levels_are_the_largest_forces(plate: SixModes) -> None:
    found = drives_for(plate, FINGERS, levels=[0.5, 0.0, 2.0])
    np.testing.assert_allclose(np.abs(found.drives).max(axis=1), [0.5, 0.0, 2.0])
    assert not np.any(found.shares[1])
    assert np.all(np.isfinite(found.isolation_db))


def test_fingers_on_one_spot_and_silent_plates_give_numbers(plate: SixModes) -> None:
    found = drives_for(plate, [FINGERS[0]] * 5, stiffness=STIFFNESS)
    assert np.all(np.isfinite(found.drives))
    np.testing.assert_allclose(found.isolation_db, 0.0, atol=1.0)


@pytest.mark.parametrize("fingers", [[], [(0.0, 0.0)] * 11])
def test_no_finger_and_eleven_are_refused(
    plate: SixModes, fingers: list[tuple[float, float]]
) -> None:
    with pytest.raises(ArgumentError, match="fingers"):
        drives_for(plate, fingers)


@pytest.mark.parametrize("regularisation", [0.0, -1.0, float("nan"), float("inf")])
def test_regularisation_is_positive(plate: SixModes, regularisation: float) -> None:
    with pytest.raises(ArgumentError, match="regularisation"):
        drives_for(plate, FINGERS, regularisation=regularisation)


def test_responses_are_exact_on_planes_and_constant_beyond() -> None:
    x, y = np.linspace(-1.0, 1.0, 5), np.array([-2.0, 0.5, 2.0])
    values = (2.0 + 3.0 * x[:, None] - 1.0j * y)[None]
    places = np.array([[0.3, -1.7], [-0.9, 1.9], [9.0, 0.0], [0.0, -9.0]])
    inside = np.clip(places, [-1.0, -2.0], [1.0, 2.0])
    wanted = 2.0 + 3.0 * inside[:, 0] - 1.0j * inside[:, 1]
    np.testing.assert_allclose(interpolated(x, y, values, places)[0], wanted)


def test_a_boards_responses_are_its_fields() -> None:
    """Of a strip: at image points to rounding, and a fingertip's own compliance solved again."""
    solved = solved_board(shipped_board("strip5"))
    board, known = solved.board, responses_at(solved)
    place = (board.x[9], board.y[40])
    np.testing.assert_allclose(known.at(np.array([place]))[0], solved.fields.values[:, 9, 40])
    (answer,) = solved.under_finger([(place[0] * 1e3, place[1] * 1e3)])
    disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
    own = complex(known.own_at(np.array([place]))[0])
    # Bilinear over 7 mm; a finger on a spring of 2 N/mm hardly notices 5 %.
    assert abs(own / complex(answer[disc].mean()) - 1.0) < 0.05
    assert known.coupling.shape == (5, 5)


def test_real_drives_are_the_best_of_all_real_ones() -> None:
    """By a solver of least squares, from the real and imaginary rows themselves."""
    plate, share = SixModes(3), 1e-3
    points = loaded_points(plate, np.array(FINGERS), STIFFNESS)
    found = drives_for(plate, FINGERS, stiffness=STIFFNESS, regularisation=share, real=True).drives
    assert np.all(found.imag == 0.0)
    for own in range(len(FINGERS)):
        rows = np.delete(points, own, axis=0).reshape(-1, points.shape[-1])
        mean = disc_weights() @ points[own]
        # Of all common phases the one that leaves the largest real part, looked for.
        turns = np.exp(1j * np.linspace(-np.pi / 2, np.pi / 2, 20_001))
        parts = (mean.conj()[:, None] * turns).real
        aim = parts[:, np.argmax((parts**2).sum(axis=0))]
        root = np.sqrt(share * np.mean(np.sum(np.abs(rows) ** 2, axis=1)))
        whole = np.concatenate((rows.real, rows.imag, root * np.eye(len(aim))))
        asked = np.concatenate((np.zeros(2 * len(rows)), root * aim))
        wanted = np.linalg.lstsq(whole, asked, rcond=None)[0]
        assert found[own].real == pytest.approx(wanted / np.abs(wanted).max(), abs=1e-3)
        # It moves the finger up where it pushes up.
        assert (mean @ found[own]).real > 0.0


def test_some_fingers_may_have_real_drives_and_others_not() -> None:
    plate = SixModes(4)
    both = drives_for(plate, FINGERS, real=[True, False, True]).drives
    real, complex_ones = (drives_for(plate, FINGERS, real=own).drives for own in (True, False))
    assert np.array_equal(both[[0, 2]], real[[0, 2]])
    assert np.array_equal(both[1], complex_ones[1])
    assert np.abs(both[1].imag).max() > 0.0
