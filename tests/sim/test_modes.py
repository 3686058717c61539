"""Modes and what follows from them: masses, phases at resonance, motion from rest."""

from __future__ import annotations

import numpy as np
import pytest

from at_points import respond_at
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Edges
from chladni.sim.errors import ResonanceError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.navier.plate import SimplySupportedPlate
from chladni.sim.plate.geometry import PlateGeometry
from chladni.sim.plate.loads import Load
from chladni.sim.ritz.basis.resolution import first_level, resolution_for, wave_number
from chladni.sim.ritz.plate import RitzPlate
from plates import X, Y, changed, free_plate


def test_phase_turns_by_half_a_turn_through_resonance(paper: Board) -> None:
    """Loss 1e-6 and 1e-3: finite on the mode itself, in quadrature there, opposite beyond."""
    first = float(plate_model(paper).natural_frequencies(1)[0])
    for loss in (1e-6, 1e-3):
        model = plate_model(changed(paper, loss_factor=loss))
        below, on, above = (
            respond_at(model, [Load(0.0, 0.0)], f, [(0.0, 0.0)], tolerance=1e-6)[0, 0]
            for f in (first * (1 - 30 * loss), first, first * (1 + 30 * loss))
        )
        assert abs(np.angle(below)) < 0.05
        assert np.angle(on) == pytest.approx(-np.pi / 2, abs=0.02)
        assert abs(np.angle(-above)) < 0.05
        # Peak 1/(ηω²m): modal mass ρhab/4.
        mass = paper.plate.areal_mass * np.prod(paper.plate.size) / 4.0
        peak = 1.0 / (loss * (2.0 * np.pi * first) ** 2 * mass)
        assert abs(on) == pytest.approx(peak, rel=5e-3)


def test_an_undamped_ritz_plate_names_the_mode() -> None:
    model = free_plate(0.0)
    waves, level = wave_number(model.geometry, 2e3), first_level(model.geometry, 1e-3)
    solver = model._solver(waves, (level, level))
    second = float(solver.omega_squared[1] ** 0.5 / (2.0 * np.pi))
    solver_resolution = resolution_for(model.geometry, waves, level)
    fixed = RitzPlate(model.geometry, 0.0, solver_resolution)
    with pytest.raises(ResonanceError, match="mode 2"):
        fixed.respond([Load(0.0, 0.0, 3e-3)], frequency_hz=second, x=X, y=Y, tolerance=1e-3)


def test_a_mode_is_named_whatever_was_asked_before() -> None:
    """After a few frequencies modes answer, and the factors at hand are of another frequency."""
    geometry = free_plate(0.0).geometry
    fixed = RitzPlate(geometry, 0.0, resolution_for(geometry, wave_number(geometry, 2e3), 1))
    second = float(fixed.natural_frequencies(2)[1])
    load = Load(0.0, 0.0, 3e-3)
    for factor in (0.5, 0.6, 0.7, 0.8):
        fixed.respond([load], frequency_hz=second * factor, x=X, y=Y, tolerance=1e-2)
    with pytest.raises(ResonanceError, match="mode 2"):
        fixed.respond([load], frequency_hz=second, x=X, y=Y, tolerance=1e-2)


def test_degenerate_modes_span_the_same_space() -> None:
    """Square plate: modes (1,2) and (2,1) coincide; the projector onto them is compared."""
    x = np.linspace(-0.5, 0.5, 41)
    edges = Edges(*4 * ("simply supported",))
    ritz = RitzPlate(PlateGeometry(1.0, 1.0, 1.0, 0.3, 1.0, edges=edges), 0.0)
    closed = SimplySupportedPlate(1.0, 1.0, 1.0, 1.0, 0.0)
    pairs = []
    for model in (ritz, closed):
        shapes = model.modes(3, [], x, x).shapes[1:].reshape(2, -1)
        basis = np.linalg.qr(shapes.T)[0]
        pairs.append(basis @ basis.T)
    assert np.abs(pairs[0] - pairs[1]).max() < 1e-6


def test_modal_masses_of_the_supported_plate(paper: Board) -> None:
    """ρhab/4 for every mode whose antinode the image hits (odd numbers: the centre)."""
    shapes = plate_model(paper).modes(1, [], paper.x, paper.y)
    quarter = paper.plate.areal_mass * np.prod(paper.plate.size) / 4.0
    assert shapes.modal_masses[0] == pytest.approx(quarter, rel=1e-12)


def test_modes_are_orthonormal_in_mass(prototype: Board) -> None:
    """On the plate and its magnets, by the image's own quadrature (trapezoid, so 1 %)."""
    shapes = plate_model(prototype).modes(5, [], prototype.x, prototype.y).shapes
    mass = np.full(shapes.shape[1:], prototype.plate.areal_mass)
    assert prototype.magnet is not None
    for actuator in prototype.actuators:
        on = np.hypot(prototype.x[:, None] - actuator.at[0], prototype.y - actuator.at[1])
        mass[on <= prototype.magnet.radius] += prototype.magnet.areal_mass
    weight_x, weight_y = np.ones(prototype.x.size), np.ones(prototype.y.size)
    weight_x[[0, -1]] = weight_y[[0, -1]] = 0.5
    cell = (prototype.x[1] - prototype.x[0]) * (prototype.y[1] - prototype.y[0])
    flat = shapes.reshape(5, -1)
    gram = (flat * (mass * weight_x[:, None] * weight_y * cell).ravel()) @ flat.T
    assert gram == pytest.approx(np.eye(5), abs=0.01)


def test_from_rest_starts_still_and_ends_steady(paper: Board) -> None:
    """Zero deflection and velocity at t = 0; after many decay times the steady state."""
    model = plate_model(paper)
    loads = [Load(*a.at) for a in paper.actuators]
    x, y = paper.x[::12], paper.y[::24]
    modes = model.modes(40, loads, x, y)
    losses = np.full(40, 0.05)
    forces = np.exp(1j * np.arange(5.0))
    start = modes.from_rest(forces, 160.0, np.array([0.0, 1e-9, 1e-7]), losses)
    steady = np.tensordot(forces, modes.steady(160.0, losses), axes=1)
    largest = np.abs(steady).max()
    assert np.abs(start[0]).max() < 1e-12 * largest
    assert np.abs(start[1]).max() < 1e-9 * largest
    late = 1.0 + np.arange(8) / (8.0 * 160.0)
    settled = modes.from_rest(forces, 160.0, late, losses)
    # Viscous and structural loss differ by η(ω/ωₙ − 1) off resonance: a few percent here.
    expected = (steady * np.exp(2j * np.pi * 160.0 * late)[:, None, None]).real
    assert np.abs(settled - expected).max() < 0.05 * largest


def test_from_rest_without_loss_depends_on_phase(paper: Board) -> None:
    """The paper's remark: different phases give different images, but only from rest."""
    model = plate_model(paper)
    modes = model.modes(30, [Load(0.0, 0.0)], paper.x[::12], paper.y[::24])
    times = np.linspace(0.0, 1.0 / 160.0, 64, endpoint=False)
    images = []
    for phase in (0.0, np.pi / 2):
        series = modes.from_rest(np.exp(1j * phase)[None], 160.0, times, np.zeros(30))
        image = np.sqrt(np.mean(series**2, axis=0))
        images.append(image / image.max())
    assert np.abs(images[0] - images[1]).max() > 0.02
