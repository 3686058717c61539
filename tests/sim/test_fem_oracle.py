"""Tests of the finite-element oracle against exact and published solutions."""

import numpy as np
import pytest
from scipy.special import j1

from plate_fem.mesh import Disc, FloatArray, plate_mesh
from plate_fem.plate import ArgyrisPlate, Inclusion, Material


def test_free_square_plate_matches_published_frequencies() -> None:
    """Leissa's frequency parameters of the completely free square plate, nu = 0.3."""
    material = Material(12.0 * (1.0 - 0.3**2) * 1e6, 0.3, 100.0, 0.01)  # D = rho h = 1
    plate = ArgyrisPlate(plate_mesh(1.0, 1.0, [], [], 0.2), material)
    omega = 2.0 * np.pi * plate.natural_frequencies(9)
    expected = [13.4682, 19.5961, 24.2702, 34.8009, 34.8009, 61.0932]
    assert omega[:3] == pytest.approx(0.0, abs=1e-3)
    assert omega[3:] == pytest.approx(expected, rel=1e-5)


def test_supported_plate_matches_exact_frequencies() -> None:
    """NAFEMS simply supported thin plate; exact D pi^4 (m^2 + n^2)^2 / a^4."""
    material = Material(200e9, 0.3, 8000.0, 0.05)
    plate = ArgyrisPlate(plate_mesh(10.0, 10.0, [], [], 2.0), material, edges="supported")
    stiffness = 200e9 * 0.05**3 / 12.0 / (1.0 - 0.3**2)
    exact = np.pi / 200.0 * np.sqrt(stiffness / 400.0) * np.array([2.0, 5.0, 5.0, 8.0, 10.0])
    assert plate.natural_frequencies(5) == pytest.approx(exact, rel=5e-5)


def navier(
    size: tuple[float, float], xy: tuple[float, float], radius: float, hertz: float, at: FloatArray
) -> FloatArray:
    """Return the exact response of a supported plate with D = rho h = 1, eta = 0.05."""
    m, n = np.meshgrid(np.arange(1, 121), np.arange(1, 121), indexing="ij")
    kx, ky = m * np.pi / size[0], n * np.pi / size[1]

    def shape(x: float, y: float) -> FloatArray:
        return np.asarray(np.sin(kx * (x + size[0] / 2)) * np.sin(ky * (y + size[1] / 2)))

    wave = np.hypot(kx, ky)
    mean = 2.0 * j1(wave * radius) / (wave * radius)
    gain = wave**4 * (1.0 + 0.05j) - (2.0 * np.pi * hertz) ** 2
    weight = 4.0 / (size[0] * size[1]) * mean * shape(*xy) / gain
    return np.array([np.sum(weight * shape(*point)) for point in at.tolist()])


@pytest.mark.parametrize("hertz", [0.0, 4.0, 30.0])
def test_disc_load_matches_navier_series(hertz: float) -> None:
    """A disc load's response; the mean of a mode over a disc is exactly 2 J1(kr) / (kr)."""
    material = Material(12.0 * (1.0 - 0.3**2) * 1e6, 0.3, 100.0, 0.01, 0.05)
    mesh = plate_mesh(1.0, 1.5, [], [], 0.05)
    plate = ArgyrisPlate(mesh, material, edges="supported")
    at = np.array([[0.11, 0.2], [-0.3, -0.5], [0.2, 0.1], [0.0, 0.6]])
    found = plate.response((0.1, 0.2), 0.08, hertz, at)
    exact = navier((1.0, 1.5), (0.1, 0.2), 0.08, hertz, at)
    assert np.linalg.norm(found - exact) < 2e-5 * np.linalg.norm(exact)


def test_stiff_inclusion_and_clamped_hole_converge_from_above() -> None:
    """Frequencies on a coarse and a fine mesh agree, although the stiffness jumps 1000-fold."""
    material = Material(22e9, 0.15, 1900.0, 1e-3)
    found = []
    for h, segments in ((8e-3, 16), (5e-3, 40)):
        mesh = plate_mesh(
            0.06, 0.08, [Disc(-0.02, 0.0, 1.5e-3)], [Disc(0.01, 0.0, 5e-3)], h, segments=segments
        )
        plate = ArgyrisPlate(mesh, material, [Inclusion(30.0, 1000.0)])
        found.append(plate.natural_frequencies(4))
    assert np.all(found[0] > found[1])
    assert found[0] == pytest.approx(found[1], rel=3e-3)


def test_response_is_reciprocal_and_clips_its_load() -> None:
    """Two loads see each other's mean alike; a load half off the plate stays a unit force."""
    material = Material(22e9, 0.15, 1900.0, 1e-3, 0.02)
    mesh = plate_mesh(0.06, 0.08, [Disc(-0.02, 0.0, 1.5e-3)], [], 6e-3, segments=16)
    plate = ArgyrisPlate(mesh, material)
    first, second = (0.03, 0.04), (0.01, -0.02)
    there = plate.response(first, 0.0, 50.0, np.array([second]))
    back = plate.response(second, 0.0, 50.0, np.array([first]))
    assert there == pytest.approx(back, rel=1e-7)
    small = plate.response(first, 1e-4, 50.0, np.array([second]))
    assert small == pytest.approx(there, rel=1e-2)
    off = plate.response(second, 0.0, 50.0, np.array([[-0.02, 0.0], [0.1, 0.0]]))
    assert not np.any(off)
