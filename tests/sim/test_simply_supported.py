"""The simply supported plate against closed forms."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from chladni.sim.board.board import Board
from chladni.sim.errors import ResonanceError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.transfer import target_field, transfer_fields
from chladni.sim.navier.plate import SimplySupportedPlate
from chladni.sim.plate.loads import Load


def plate(width: float, length: float, *, loss: float = 0.0) -> SimplySupportedPlate:
    return SimplySupportedPlate(width, length, 1.0, 1.0, loss)


def test_nafems_thin_plate_frequencies() -> None:
    """NAFEMS: 10 m square, 50 mm steel; published to four digits, so 2e-4."""
    stiffness = 200e9 * 0.05**3 / 12.0 / (1.0 - 0.3**2)
    found = SimplySupportedPlate(10.0, 10.0, stiffness, 400.0, 0.0).natural_frequencies(6)
    assert found == pytest.approx([2.377, 5.942, 5.942, 9.507, 11.884, 11.884], rel=2e-4)


def test_paper_board_starts_at_192_hz(paper: Board) -> None:
    """physics.md: the first mode of `paper`."""
    assert plate_model(paper).natural_frequencies(1)[0] == pytest.approx(192.0, abs=0.5)


def test_static_deflection_under_a_central_point_force() -> None:
    """Timoshenko's table 23, computed by hand to four digits: 0.01160 and 0.01651 P a²/D."""
    for length, factor in ((1.0, 0.01160), (2.0, 0.01651)):
        origin = np.zeros(1)
        found = plate(1.0, length).respond(
            [Load(0.0, 0.0)], frequency_hz=1e-6, x=origin, y=origin, tolerance=1e-8
        )
        assert found.values[0, 0, 0].real == pytest.approx(factor, rel=1e-3)


@pytest.mark.parametrize("frequency_hz", [0.1, 3.0, 20.0])
@pytest.mark.parametrize("radius", [0.0, 0.07])
def test_error_estimate_bounds_the_true_error(frequency_hz: float, radius: float) -> None:
    """Against a sum with ten thousand times smaller tolerance; the bound may not be idle either."""
    x, y = np.linspace(-0.5, 0.5, 61), np.linspace(-0.75, 0.75, 91)
    model = plate(1.0, 1.5, loss=0.01)
    fine, coarse = (
        model.respond(
            [Load(0.13, -0.2, radius)], frequency_hz=frequency_hz, x=x, y=y, tolerance=tolerance
        )
        for tolerance in (1e-8, 1e-3)
    )
    error = np.linalg.norm(coarse.values - fine.values) / np.linalg.norm(fine.values)
    assert coarse.modes_used < fine.modes_used / 50
    assert error <= coarse.error_estimate <= 1e-3
    # A disc's modes die off by J₁ as well, which the bound leaves out.
    assert coarse.error_estimate < error * (100.0 if radius == 0.0 else 1e5)


def test_the_load_is_taken_where_it_stands(paper: Board) -> None:
    """The paper's ∫φ would lose all even modes and so the load's place; a mirrored load differs."""
    there = target_field(paper, (10.0, 25.0)).values[0]
    mirrored = target_field(paper, (-10.0, 25.0)).values[0]
    assert np.allclose(there, mirrored[::-1], rtol=0, atol=1e-12 * np.abs(there).max())
    assert np.abs(there - mirrored).max() > 0.05 * np.abs(there).max()
    i, j = np.unravel_index(np.abs(there).argmax(), there.shape)
    # The supports pull the peak inwards, by 10 mm here; without the place it would sit at 25 mm.
    assert np.hypot(paper.x[i] - 10e-3, paper.y[j] - 25e-3) < 12e-3


def test_reciprocity() -> None:
    """w at B from a force at A equals w at A from a force at B (Betti), to rounding."""
    a, b = (0.1, 0.3), (-0.25, -0.4)
    values = (
        plate(1.0, 1.5, loss=0.02)
        .respond(
            [Load(*a), Load(*b)],
            frequency_hz=5.0,
            x=np.array([a[0], b[0]]),
            y=np.array([a[1], b[1]]),
            tolerance=1e-4,
        )
        .values
    )
    assert values[0, 1, 1] == pytest.approx(values[1, 0, 0], rel=1e-12)


def test_an_undamped_drive_on_a_mode_names_the_mode(paper: Board) -> None:
    first = float(plate_model(paper).natural_frequencies(1)[0])
    with pytest.raises(ResonanceError, match=r"mode \(1, 1\)") as caught:
        transfer_fields(paper, frequency_hz=first)
    assert caught.value.mode_hz == pytest.approx(first)
    damped = dataclasses.replace(paper, plate=dataclasses.replace(paper.plate, loss_factor=1e-3))
    assert np.all(np.isfinite(transfer_fields(damped, frequency_hz=first).values))


def test_a_lossless_field_is_real(paper: Board) -> None:
    assert not transfer_fields(paper).values.imag.any()
