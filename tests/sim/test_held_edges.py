"""Held edges beside screws and magnets: corners must not take a screw's functions away.

Clamped edges say in their corners what their neighbours say there too. Once functions of a screw's
rim are added these conditions no longer agree to the last digit; before they were left out, one
field was 550 times wrong and its estimate 42.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.sim.board.parts import EdgeKind, Edges
from chladni.sim.plate.geometry import Inclusion, PlateGeometry, RimSupport
from chladni.sim.plate.loads import Load
from chladni.sim.plate.mirrors import orbits_of
from chladni.sim.plate.response import Response
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.parity import find_mirrors
from chladni.sim.ritz.basis.resolution import Resolution, resolution_for, wave_number
from chladni.sim.ritz.circles.functions import Circle
from chladni.sim.ritz.circles.held_edges import HeldEdge
from chladni.sim.ritz.circles.terms import FunctionSet
from chladni.sim.ritz.constraints import met_by_polynomials
from chladni.sim.ritz.plate import RitzPlate
from chladni.sim.ritz.solver import Solver
from plate_fem.mesh import Disc, plate_mesh
from plate_fem.plate import ArgyrisPlate, Material
from plate_fem.plate import Inclusion as FemInclusion

C: EdgeKind = "clamped"
S: EdgeKind = "simply supported"
WIDTH, LENGTH, THICKNESS = 71.5e-3, 146.7e-3, 1e-3
YOUNG, POISSON, DENSITY, LOSS = 22e9, 0.28, 1900.0, 0.02
STIFFNESS = YOUNG * THICKNESS**3 / 12.0 / (1.0 - POISSON**2)
SCREW = RimSupport(-25.75e-3, -63.35e-3, 1.5e-3)
X, Y = np.linspace(-0.03, 0.03, 13), np.linspace(-0.07, 0.07, 27)


def plate(kind: EdgeKind, *inclusions: Inclusion) -> PlateGeometry:
    return PlateGeometry(
        WIDTH,
        LENGTH,
        STIFFNESS,
        POISSON,
        DENSITY * THICKNESS,
        rims=(SCREW,),
        inclusions=inclusions,
        edges=Edges(kind, kind, kind, kind),
    )


def at_level(geometry: PlateGeometry, level: int) -> tuple[NDArray[np.complex128], float]:
    """Fields under one load in the middle, and one 5 mm from an edge, with their estimate."""
    resolution = resolution_for(geometry, wave_number(geometry, 2.0 * np.pi * 160.0), level)
    found = RitzPlate(geometry, LOSS, resolution).respond(
        [Load(10e-3, -5e-3, 0.0), Load(10e-3, -68.5e-3, 0.0)],
        frequency_hz=160.0,
        x=X,
        y=Y,
        tolerance=1e-12,
    )
    return found.values, found.error_estimate


@pytest.mark.parametrize("kind", [C, S])
def test_fields_of_held_plates_with_a_screw_converge(kind: EdgeKind) -> None:
    """Larger bases come nearer to a fine one, and no estimate is below its error."""
    exact, _ = at_level(plate(kind), 3)
    errors = []
    for level in (0, 1):
        found, estimate = at_level(plate(kind), level)
        error = np.linalg.norm(found - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
        errors.append(error.max())
        assert error.max() <= estimate
        assert error[0] < 1e-3  # in the middle even the coarsest basis does
    assert errors[-1] < errors[0] / 2.0
    assert errors[-1] < 3e-2


@pytest.mark.slow
def test_a_supported_plate_with_a_screw_and_a_magnet_matches_finite_elements() -> None:
    """Elements on a second, finer mesh say what the first one's own error is."""
    magnet = Inclusion(10e-3, 20e-3, 5e-3, 22.5, 1000.0)
    load, points = (-10e-3, -15e-3), np.stack(np.meshgrid(X, Y, indexing="ij"), -1).reshape(-1, 2)
    material = Material(YOUNG, POISSON, DENSITY, THICKNESS, LOSS)
    fields = []
    for size in (9e-3, 6e-3):
        mesh = plate_mesh(
            WIDTH,
            LENGTH,
            [Disc(SCREW.x, SCREW.y, SCREW.radius)],
            [Disc(magnet.x, magnet.y, 5e-3)],
            size,
            segments=32,
            grading=0.4,
        )
        elements = ArgyrisPlate(
            mesh, material, [FemInclusion(magnet.areal_mass, magnet.stiffness_ratio)], "supported"
        )
        fields.append(elements.response(load, 0.0, 160.0, points).reshape(X.size, Y.size))
    coarse, fine = fields
    own = np.linalg.norm(coarse - fine) / np.linalg.norm(fine)
    found = RitzPlate(plate(S, magnet), LOSS).respond(
        [Load(*load, 0.0)], frequency_hz=160.0, x=X, y=Y, tolerance=1e-3
    )
    error = np.linalg.norm(found.values[0] - fine) / np.linalg.norm(fine)
    assert own < 1e-3
    assert error < found.error_estimate + own


@pytest.mark.parametrize(("kind", "superfluous"), [(C, 16), (S, 4)])
def test_corners_make_as_many_conditions_superfluous_as_theory_says(
    kind: EdgeKind, superfluous: int
) -> None:
    """Clamped: w, both slopes and the twist in four corners. Supported: w alone."""
    geometry = plate(kind)
    solver = Solver(geometry, find_mirrors(geometry), Resolution(12, 18, 3))
    (only,) = solver.classes
    supports = solver.assembly.supports(only.basis)
    edges = supports.moments[-supports.edges :, : only.basis.polynomials]
    assert Basis(geometry, Resolution(12, 18, 3)).polynomials == edges.shape[1]
    assert len(edges) - len(met_by_polynomials(edges)) == superfluous


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("clamped", [True, False])
def test_functions_of_a_circle_near_a_held_edge_obey_it(axis: int, clamped: bool) -> None:
    """w and its slope vanish on a clamped edge, w and its curvature on a supported one."""
    edge = HeldEdge(axis, 0.03, clamped)
    circle = Circle(0.024, 0.022, 5e-3, FunctionSet(4, 2, (0, 1)), edge)
    along = np.linspace(-0.03, 0.03, 9)
    on_edge = (np.full(9, 0.03), along) if axis == 0 else (along, np.full(9, 0.03))
    across: tuple[int, int] = (1, 0) if axis == 0 else (0, 1)
    held = across if clamped else (2 * across[0], 2 * across[1])
    away = (on_edge[0] - 4e-3, on_edge[1]) if axis == 0 else (on_edge[0], on_edge[1] - 4e-3)
    for derivative in ((0, 0), held):
        vanish = circle.evaluate(on_edge[0], on_edge[1], derivative)
        there = circle.evaluate(away[0], away[1], derivative)
        assert np.abs(vanish).max() < 1e-11 * np.abs(there).max()


@pytest.mark.parametrize("clamped", [True, False])
@pytest.mark.parametrize("axis", [0, 1])
def test_derivatives_of_mirrored_functions_follow_from_differences(
    axis: int, clamped: bool
) -> None:
    """And Δ²w is zero: third derivatives differenced once more."""
    circle = Circle(0.02, 0.018, 5e-3, FunctionSet(3, 1, (0, 1)), HeldEdge(axis, 0.03, clamped))
    x, y, step = np.array([0.027, -0.01, 0.011]), np.array([0.001, 0.025, 0.029]), 1e-6

    def difference(derivative: tuple[int, int], by: int) -> NDArray[np.float64]:
        shift = (step, 0.0) if by == 0 else (0.0, step)
        ahead = circle.evaluate(x + shift[0], y + shift[1], derivative)
        return (ahead - circle.evaluate(x - shift[0], y - shift[1], derivative)) / (2.0 * step)

    for a, b in ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)):
        for by in (0, 1):
            exact = circle.evaluate(x, y, (a + 1, b) if by == 0 else (a, b + 1))
            assert difference((a, b), by) == pytest.approx(
                exact, rel=1e-5, abs=1e-6 * np.abs(exact).max()
            )
    fourth = difference((3, 0), 0) + 2.0 * difference((2, 1), 1) + difference((0, 3), 1)
    assert np.abs(fourth).max() < 1e-5 * np.abs(difference((3, 0), 0)).max()


@pytest.mark.parametrize("kind", [C, S])
def test_a_magnet_close_to_a_held_edge_takes_no_larger_basis(kind: EdgeKind) -> None:
    """1 mm from the edge, loaded there; without images the estimate was above 1."""
    magnet = Inclusion(WIDTH / 2.0 - 6e-3, 0.02, 5e-3, 30.0, 1000.0)
    geometry = plate(kind, magnet)
    loads = [Load(magnet.x, magnet.y, 5e-3), Load(0.0, -0.03, 5e-3)]

    def fields(resolution: Resolution | None, tolerance: float) -> Response:
        return RitzPlate(geometry, LOSS, resolution).respond(
            loads, frequency_hz=160.0, x=X, y=Y, tolerance=tolerance
        )

    found = fields(None, 5e-3)
    waves = wave_number(geometry, 2.0 * np.pi * 160.0)
    exact = fields(resolution_for(geometry, waves, 4, 5), 1e-9).values
    error = np.linalg.norm(found.values - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    assert error.max() <= found.error_estimate <= 5e-3


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("kind", [C, S])
def test_a_coarser_solution_is_the_same_with_the_finer_factors(
    kind: EdgeKind, mirrored: bool
) -> None:
    """Corners make other combinations of edge conditions for fewer polynomials.

    Rounding leaves 1e-12 of the field, and a step changes it by 3e-6 or more.
    """
    geometry = plate(kind, Inclusion(10e-3, 20e-3, 5e-3, 22.5, 1000.0))
    if mirrored:
        signs = [(sx, sy) for sx in (-1.0, 1.0) for sy in (-1.0, 1.0)]
        (magnet,) = geometry.inclusions
        geometry = replace(
            geometry,
            rims=tuple(replace(SCREW, x=sx * SCREW.x, y=sy * SCREW.y) for sx, sy in signs),
            inclusions=tuple(replace(magnet, x=sx * magnet.x, y=sy * magnet.y) for sx, sy in signs),
        )
    mirrors, omega = find_mirrors(geometry), 2.0 * np.pi * 160.0
    assert len(mirrors.images) == (4 if mirrored else 1)
    solver = Solver(geometry, mirrors, resolution_for(geometry, wave_number(geometry, omega), 1))
    orbits = orbits_of([Load(-10e-3, -15e-3, 2e-3), Load(10e-3, 20e-3, 5e-3)], mirrors)
    case = solver.case(orbits.distinct)

    def field(solution: list[NDArray[np.complex128]]) -> NDArray[np.complex128]:
        return solver.image(case, solution, LOSS, X, Y).unfold(orbits)

    fine = field(solver.coefficients(case, omega, LOSS))
    by_class = [
        c.modes.solve_in(c.coarser, case.in_class(c.basis), omega, LOSS) for c in solver.classes
    ]
    for k in range(3):
        found = field([coarser[k] for coarser in by_class])
        pairs = [(c.coarser[k], case.in_class(c.basis)) for c in solver.classes]
        exact = field([own.solve(load, omega, LOSS) for own, load in pairs])
        assert np.linalg.norm(fine - exact) > 1e-6 * np.linalg.norm(exact)
        assert np.linalg.norm(found - exact) < 1e-9 * np.linalg.norm(exact)
