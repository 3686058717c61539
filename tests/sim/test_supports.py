"""Every way a plate can be held or loaded, against closed forms, tables and finite elements."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.optimize import brentq

from chladni.sim.board.board import Board
from chladni.sim.board.parts import EdgeKind, Edges
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.transfer import disc_fields
from chladni.sim.navier.plate import SimplySupportedPlate
from chladni.sim.plate.geometry import Inclusion, PlateGeometry, PointFeature, RimSupport
from chladni.sim.plate.loads import Load
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.parity import ParityBasis, parity_classes
from chladni.sim.ritz.basis.resolution import Resolution
from chladni.sim.ritz.forms.assembly import Assembly
from chladni.sim.ritz.plate import RitzPlate
from levy import levy_displacement
from plate_fem.mesh import Disc, plate_mesh
from plate_fem.plate import ArgyrisPlate, Material
from plate_fem.plate import Inclusion as FemInclusion

SS: EdgeKind = "simply supported"
C: EdgeKind = "clamped"
F: EdgeKind = "free"
SUPPORTED = Edges(SS, SS, SS, SS)


def parameters(
    edges: Edges, count: int, *, length: float = 1.0, poisson: float = 0.3
) -> np.ndarray:
    """ωa²√(ρh/D) of the lowest modes, rigid ones left out."""
    plate = RitzPlate(PlateGeometry(1.0, length, 1.0, poisson, 1.0, edges=edges), 0.0)
    found = 2.0 * np.pi * plate.natural_frequencies(count + 3)
    return np.asarray(found[found > 1e-3][:count])


@pytest.mark.parametrize(
    ("edges", "expected", "tolerance"),
    [
        # Closed form π²(m² + n²); Leissa 1973 (upper bounds to five digits), converged since.
        (SUPPORTED, np.pi**2 * np.array([2, 5, 5, 8, 10, 10]), 1e-7),
        (Edges(C, C, C, C), [35.985, 73.394, 73.394, 108.22, 131.58, 132.20], 1e-4),
        (Edges(C, F, F, F), [3.4711, 8.5067, 21.285, 27.199, 30.955, 54.187], 2e-4),
        (Edges(SS, SS, F, F), [9.6314, 16.135, 36.726, 38.945, 46.738, 70.740], 1e-4),
    ],
)
def test_square_plates_with_mixed_edges(
    edges: Edges, expected: list[float], tolerance: float
) -> None:
    assert parameters(edges, 6) == pytest.approx(expected, rel=tolerance)


def test_a_plate_on_four_corner_pins() -> None:
    """Published 7.111, 15.77, 15.77, 19.60, 38.43 (ν = 0.3)."""
    pins = tuple(PointFeature(x, y, is_pinned=True) for x in (-0.5, 0.5) for y in (-0.5, 0.5))
    plate = RitzPlate(PlateGeometry(1.0, 1.0, 1.0, 0.3, 1.0, points=pins), 0.0)
    found = 2.0 * np.pi * plate.natural_frequencies(5)
    assert found == pytest.approx([7.111, 15.770, 15.770, 19.596, 38.432], rel=1e-4)


def receptance(omega: float, place: tuple[float, float]) -> float:
    """Displacement under a unit force on a supported 1 × 1.5 plate, by Lévy's series."""
    at = levy_displacement((1.0, 1.5), 1.0, 1.0, omega, place, np.array([place]), 1e-9)
    return float(at[0].real)


@pytest.mark.parametrize(
    ("feature", "equation", "between"),
    [
        (PointFeature(0.13, -0.21, mass=0.3), lambda w, g: 1.0 - 0.3 * w**2 * g, (0, 1)),
        (PointFeature(0.13, -0.21, stiffness=200.0), lambda w, g: 1.0 + 200.0 * g, (1, 2)),
        (PointFeature(0.13, -0.21, is_pinned=True), lambda w, g: g, (1, 2)),
    ],
)
def test_point_features_solve_the_receptance_equation(
    feature: PointFeature, equation: object, between: tuple[int, int]
) -> None:
    """A point mass, spring or pin on a supported plate: closed form against Ritz."""
    assert callable(equation)
    place = (feature.x, feature.y)
    bare = 2.0 * np.pi * SimplySupportedPlate(1.0, 1.5, 1.0, 1.0, 0.0).natural_frequencies(2)
    ends = [3.0, *bare.tolist()]
    low, high = ends[between[0]] + 1e-3, ends[between[1]] - 1e-3
    exact = brentq(lambda w: equation(w, receptance(w, place)), low, high, xtol=1e-9)
    geometry = PlateGeometry(1.0, 1.5, 1.0, 0.3, 1.0, points=(feature,), edges=SUPPORTED)
    found = 2.0 * np.pi * RitzPlate(geometry, 0.0).natural_frequencies(1)[0]
    assert found == pytest.approx(exact, rel=2e-6)


@pytest.mark.slow
def test_a_hole_matches_finite_elements() -> None:
    """Elements with next to no stiffness and mass in the disc; within 1e-5 on this mesh."""
    mesh = plate_mesh(0.06, 0.08, [], [Disc(0.01, 0.005, 8e-3)], 5e-3, segments=48)
    material = Material(22e9, 0.15, 1900.0, 1e-3)
    nothing = FemInclusion(-1.9 * (1.0 - 1e-7), 1e-7)
    expected = ArgyrisPlate(mesh, material, [nothing]).natural_frequencies(8)[3:]
    stiffness = 22e9 * 1e-9 / 12.0 / (1.0 - 0.15**2)
    hole = Inclusion(0.01, 0.005, 8e-3, -1.9, 0.0)
    geometry = PlateGeometry(0.06, 0.08, stiffness, 0.15, 1.9, inclusions=(hole,))
    assert RitzPlate(geometry, 0.0).natural_frequencies(8)[3:] == pytest.approx(expected, rel=3e-5)


def rim_plate(rim: RimSupport) -> np.ndarray:
    geometry = PlateGeometry(0.1, 0.12, 2.0, 0.2, 2.0, rims=(rim,), edges=SUPPORTED)
    return RitzPlate(geometry, 0.0).natural_frequencies(4)


def test_a_sprung_screw_lies_between_no_screw_and_a_held_one() -> None:
    """Frequencies rise with stiffness (Rayleigh) from the free plate to the pinned and clamped."""
    place = (0.012, 0.017, 2e-3)
    bare = RitzPlate(
        PlateGeometry(0.1, 0.12, 2.0, 0.2, 2.0, edges=SUPPORTED), 0.0
    ).natural_frequencies(4)
    loose, soft, firm = (
        rim_plate(RimSupport(*place, holds_deflection=False, holds_slope=False, stiffness=k))
        for k in (1e-6, 1e4, 1e12)
    )
    pinned = rim_plate(RimSupport(*place, holds_slope=False))
    clamped = rim_plate(RimSupport(*place))
    assert loose == pytest.approx(bare, rel=1e-6)
    assert np.all(soft > bare * (1.0 - 1e-9))
    assert np.all(soft < pinned * (1.0 + 1e-9))
    assert soft[0] > 1.001 * bare[0]
    # A spring spread over the rim holds its mean; the higher Fourier orders stay free.
    assert firm[0] == pytest.approx(pinned[0], rel=2e-2)
    assert np.all(pinned < clamped)
    stiff = rim_plate(
        RimSupport(*place, holds_slope=False, rotational=1e9)
    )  # held in deflection, sprung in slope
    assert stiff[0] == pytest.approx(clamped[0], rel=2e-2)


def test_rotary_inertia_lowers_tilting_modes_only() -> None:
    """A tall light disc at the centre: the mode that lifts it stays, those that tilt it fall."""

    def modes(rotary: float) -> np.ndarray:
        disc = Inclusion(0.0, 0.0, 5e-3, 5.0, 100.0, rotary)
        geometry = PlateGeometry(0.1, 0.14, 2.0, 0.2, 2.0, inclusions=(disc,), edges=SUPPORTED)
        return RitzPlate(geometry, 0.0).natural_frequencies(3)

    plain, tall = modes(0.0), modes(5.0 * 0.02**2 / 12.0)
    # The disc still bends a little in that mode, so its slopes carry a little inertia.
    assert tall[0] == pytest.approx(plain[0], rel=1e-7)
    assert np.all(tall[1:] < plain[1:] * (1.0 - 1e-3))


def test_a_narrow_strip_is_a_beam() -> None:
    """20:1, ν = 0: free–free beam, (βL)² = 22.3733, 61.6728, 120.903; torsion lies apart."""
    plate = RitzPlate(PlateGeometry(0.05, 1.0, 1.0, 0.0, 1.0), 0.0)
    found = 2.0 * np.pi * plate.natural_frequencies(12)[3:]
    for expected in (22.3733, 61.6728, 120.903):
        assert np.abs(found / expected - 1.0).min() < 1e-4


def test_order_60_is_well_conditioned() -> None:
    """Scaled by its diagonal, the stiffness of order 60 keeps ten digits: condition below 1e6."""
    plate = RitzPlate(PlateGeometry(1.0, 1.0, 1.0, 0.3, 1.0), 0.0)
    basis = Basis(plate.geometry, Resolution(60, 60))
    parity = ParityBasis(basis, parity_classes(plate.mirrors)[0])
    assembly = Assembly(basis, plate.mirrors, (124, 124))
    energy = assembly.stiffness(parity) + 500.0 * assembly.mass(parity, assembly.overlap(parity))
    scale = 1.0 / np.sqrt(np.diag(energy))
    eigenvalues = np.linalg.eigvalsh(energy * scale * scale[:, None])
    assert eigenvalues[-1] / eigenvalues[0] < 1e6


def test_a_square_rounded_all_the_way_is_a_circular_plate() -> None:
    """Free circular plate, ν = 0.3, ωR²√(ρh/D): 5.358, 9.003, 12.439, 20.475 (Leissa)."""
    geometry = PlateGeometry(2.0, 2.0, 1.0, 0.3, 1.0, corner_radius=1.0)
    found = 2.0 * np.pi * RitzPlate(geometry, 0.0).natural_frequencies(10)[3:]
    expected = [5.358, 5.358, 9.003, 12.439, 12.439, 20.475, 20.475]
    assert found == pytest.approx(expected, rel=1e-4)


def test_round_corners_hardly_change_the_prototype(prototype: Board) -> None:
    """5 mm: what the shipped board leaves out, as docs/physics.md states it."""
    rounded = dataclasses.replace(prototype.plate, corner_radius=5e-3)
    square = plate_model(prototype).natural_frequencies(10)
    change = plate_model(dataclasses.replace(prototype, plate=rounded)).natural_frequencies(10)
    relative = change / square - 1.0
    assert np.abs(relative).max() < 3e-4
    assert np.abs(relative).max() > 1e-5


def test_a_force_on_a_round_corner_is_reciprocal_to_one_at_the_centre() -> None:
    """A free circular plate: what a clipped disc on its rim moves the centre by, and the reverse.

    The mean over the disc is taken on a grid of 0.005: its jagged rim counts 3e-3 of what so smooth
    a field changes by over the disc. A force on what is cut off has no field at all.
    """
    plate = RitzPlate(PlateGeometry(2.0, 2.0, 1.0, 0.3, 1.0, corner_radius=1.0), 0.02)
    rim = Load(0.68, 0.68, 0.15)
    axis = np.linspace(-0.995, 0.995, 399)
    on_plate = np.hypot(axis[:, None], axis) < 1.0
    disc = on_plate & (np.hypot(axis[:, None] - rim.x, axis - rim.y) < rim.radius)
    found = plate.respond([rim, Load(0.0, 0.0)], frequency_hz=0.6, x=axis, y=axis, tolerance=5e-3)
    of_rim, of_centre = found.values
    assert found.tolerance_met
    assert of_rim[199, 199] == pytest.approx(of_centre[disc].mean(), rel=5e-3)


def test_a_place_in_a_rounded_off_corner_is_the_nearest_on_the_plate(prototype: Board) -> None:
    """The arc's middle is (1 − √½) · 20 mm from the two edges."""
    plate = dataclasses.replace(prototype.plate, corner_radius=20e-3)
    board = dataclasses.replace(prototype, plate=plate, screws=())
    half = np.array(plate.size) / 2.0
    arc = (half - (1.0 - np.sqrt(0.5)) * 20e-3) / 1e-3
    corner, nearest = disc_fields(board, [tuple(half / 1e-3), tuple(arc)], 5e-3).values
    assert corner == pytest.approx(nearest, rel=1e-9)
