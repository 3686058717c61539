"""Loops, windings and magnets: against sums over segments, closed forms and published values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.constants import mu_0

from chladni.sim.magnetics.loops import shared_flux, vector_potential
from chladni.sim.magnetics.windings import RoundWinding, force_per_ampere

FLAT = RoundWinding(180, 1e-4, 4e-3, 10e-3, 1e-3)
ROUND = RoundWinding(150, 1e-4, 7e-3, 9.4e-3, 2e-3)
REMANENCE, RADIUS, HEIGHT = 1.28, 3e-3, 4e-3


def force(winding: RoundWinding, gap: float) -> float:
    return force_per_ampere(winding, remanence=REMANENCE, radius=RADIUS, height=HEIGHT, gap=gap)


def field_of_segments(radius: float, count: int, at: np.ndarray) -> np.ndarray:
    """Biot and Savart's law for a polygon of unit current, of a circle's area; T, shape (n, 3)."""
    angle = 2.0 * np.pi * np.arange(count) / count
    own = radius * np.sqrt(2.0 * np.pi / count / np.sin(2.0 * np.pi / count))
    points = own * np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1)
    along = np.roll(points, -1, axis=0) - points
    away = at[:, None] - (points + along / 2.0)
    cube = np.linalg.norm(away, axis=2)[..., None] ** 3
    return np.asarray(mu_0 / (4.0 * np.pi) * (np.cross(along, away) / cube).sum(axis=1))


@pytest.mark.parametrize("other", [0.4e-3, 2.9e-3, 3.1e-3, 8e-3])
@pytest.mark.parametrize("apart", [0.3e-3, -2e-3, 9e-3])
def test_a_loop_s_flux_is_what_segments_send_through_a_disc(other: float, apart: float) -> None:
    """Gauss points along the disc's radius, inside the loop and outside it.

    600 sides of the polygon leave 2e-5, as their number squared, and the points 1e-5.
    """
    node, weight = np.polynomial.legendre.leggauss(60)
    expected = 0.0
    for start, end in ((0.0, min(other, 3e-3)), (3e-3, max(other, 3e-3))):
        r = (start + end) / 2.0 + node * (end - start) / 2.0
        places = np.stack((r, 0.0 * r, apart + 0.0 * r), axis=1)
        up = field_of_segments(3e-3, 600, places)[:, 2]
        expected += np.pi * (end - start) * float((weight * up * r).sum())
    assert shared_flux(3e-3, other, apart) == pytest.approx(expected, rel=1e-4, abs=0.0)


def test_on_the_axis_a_loop_s_field_is_the_closed_form() -> None:
    """B = μ₀a²/(2(a² + z²)^3/2); a disc of a thousandth of the radius has 1e-6 of curvature."""
    z = np.array([0.0, 1e-3, 4e-3, -0.1, 2.0])
    flux = shared_flux(3e-3, 3e-6, z)
    exact = mu_0 * 3e-3**2 / (2.0 * (3e-3**2 + z**2) ** 1.5)
    assert flux / (np.pi * 3e-6**2) == pytest.approx(exact, rel=2e-6, abs=0.0)


def test_flux_is_shared() -> None:
    """Φ of one through the other is that of the other through the one, whichever is larger."""
    rng = np.random.default_rng(3)
    a, b = rng.uniform(1e-4, 2e-2, (2, 200))
    z = rng.uniform(-0.05, 0.05, 200)
    assert shared_flux(a, b, z) == pytest.approx(shared_flux(b, a, z), rel=1e-9, abs=0.0)


def test_two_circles_share_what_tables_say() -> None:
    """20 and 25 cm of radius, 10 cm apart: 248.787 nH, an example since Grover (NBS, 1912)."""
    assert shared_flux(0.20, 0.25, 0.10) == pytest.approx(248.787e-9, rel=2e-6, abs=0.0)


@pytest.mark.parametrize("m", [1e-8, 1e-5, 0.999e-3, 1.001e-3, 0.01, 0.3])
def test_a_potential_is_the_integral_round_its_loop(m: float) -> None:
    """A = μ₀a/4π ∮ cos φ dφ/√(a² + ρ² − 2aρ cos φ), on both sides of where a series takes over.

    A smooth periodic function, summed at 200 angles, is exact but for rounding: 1e-16 of parts that
    cancel to m/8 of them. The series leaves 5e-10 out, and the closed form loses as much.
    """
    angle = 2.0 * np.pi * np.arange(200) / 200
    rho = 3e-3 * (2.0 - m - 2.0 * np.sqrt(1.0 - m)) / m if m > 1e-4 else 3e-3 * m / 4.0
    parts = np.cos(angle) / np.sqrt(3e-3**2 + rho**2 - 2.0 * 3e-3 * rho * np.cos(angle))
    exact = mu_0 * 3e-3 / 2.0 * parts.mean()
    assert vector_potential(3e-3, rho, 0.0) == pytest.approx(exact, rel=1e-9 + 1e-14 / m, abs=0.0)


@pytest.mark.parametrize(("winding", "gap"), [(FLAT, 1e-3), (FLAT, 0.2e-3), (ROUND, -1e-3)])
def test_a_magnet_pushes_as_a_sheet_of_segments_does(winding: RoundWinding, gap: float) -> None:
    """The other model: a current Br/μ₀ per length round the magnet, F = ∮ B_r dl of all turns.

    100 loops, one per 0.04 mm, of 120 segments each, and 12 × 12 turns. Nearest to a rim the turns
    see single loops: 1e-3.
    """
    node, weight = np.polynomial.legendre.leggauss(12)
    turn = (winding.mean + node * (winding.outer - winding.inner) / 2.0) / 2.0
    down = -gap - (1.0 + node) / 2.0 * winding.height
    x, z = (axis.ravel() for axis in np.meshgrid(turn, down, indexing="ij"))
    shares = np.outer(weight, weight).ravel() / 4.0
    sheet = HEIGHT * (np.arange(100) + 0.5) / 100
    total = 0.0
    for level in sheet:
        places = np.stack((x, 0.0 * x, z - level), axis=1)
        across = field_of_segments(RADIUS, 120, places)[:, 0]
        total += float((shares * 2.0 * np.pi * x * across).sum())
    total *= winding.turns * REMANENCE / mu_0 * HEIGHT / 100
    assert force(winding, gap) == pytest.approx(-total, rel=1e-3)


@pytest.mark.parametrize("gap", [0.5e-3, 3e-3])
def test_a_tiny_coil_feels_the_slope_of_the_field_on_the_axis(gap: float) -> None:
    """F/I = πε² dB/dz, B = Br/2 ((z + h)/√((z + h)² + R²) − z/√(z² + R²)) on the axis.

    A turn of 0.02 mm is 1e-4 of the magnet's radius squared; its cross-section is as small.
    """
    tiny = RoundWinding(1, 1e-6, 39e-6, 41e-6, 2e-6)

    def slope(z: float) -> float:
        return float(RADIUS**2 / (z**2 + RADIUS**2) ** 1.5)

    middle = gap + 1e-6
    steep = REMANENCE / 2.0 * (slope(middle) - slope(middle + HEIGHT))
    area = np.pi * (20e-6) ** 2
    assert force(tiny, gap) == pytest.approx(area * steep, rel=1e-3, abs=0.0)


def test_far_away_a_magnet_is_a_dipole() -> None:
    """F/I = N m dB/dz of a loop on its axis; 0.3 m away sizes of 4 mm leave their square, 2e-4."""
    far = 0.3
    moment = REMANENCE / mu_0 * np.pi * RADIUS**2 * HEIGHT
    z, a = far + HEIGHT / 2.0 + FLAT.height / 2.0, FLAT.mean / 2.0
    steep = mu_0 / 2.0 * a**2 * 3.0 * z / (a**2 + z**2) ** 2.5
    # The mean of a² over the cross-section is above the square of its mean.
    spread = 1.0 + (FLAT.outer - FLAT.inner) ** 2 / 48.0 / a**2
    assert force(FLAT, far) == pytest.approx(
        FLAT.turns * moment * steep * spread, rel=5e-4, abs=0.0
    )


def test_force_turns_round_in_the_middle_and_grows_with_every_part() -> None:
    centred = -(HEIGHT + ROUND.height) / 2.0
    assert abs(force(ROUND, centred)) < 1e-12
    assert force(ROUND, centred - 1e-3) == pytest.approx(-force(ROUND, centred + 1e-3))
    assert force(replace(FLAT, turns=360), 1e-3) == pytest.approx(2.0 * force(FLAT, 1e-3))


@pytest.mark.parametrize(
    "winding",
    [
        FLAT,
        ROUND,
        RoundWinding(300, 1e-4, 3e-3, 10e-3, 1.5e-3),
        RoundWinding(150, 1e-4, 13e-3, 17e-3, 2e-3),
    ],
)
def test_wheeler_s_inductance_is_that_of_all_pairs_of_turns(winding: RoundWinding) -> None:
    """L = N² ⟨M⟩ over pairs of places of the cross-section, on two grids that never meet.

    Wheeler promises 1 % where his three terms are alike; on a winding as flat as 3 : 1 he is 5 %
    off. The logarithm where turns meet costs the grids 0.3 %.
    """

    def grid(count: int) -> tuple[np.ndarray, np.ndarray]:
        share = (np.arange(count) + 0.5) / count
        a = (winding.inner + share * (winding.outer - winding.inner)) / 2.0
        x, z = np.meshgrid(a, share * winding.height, indexing="ij")
        return x.ravel(), z.ravel()

    (a, z), (b, y) = grid(20), grid(21)
    pairs = shared_flux(a[:, None], b, z[:, None] - y)
    assert winding.inductance == pytest.approx(winding.turns**2 * pairs.mean(), rel=0.05)


def test_resistance_is_that_of_the_wire() -> None:
    """The paper's coil: 150 turns of 0.1 mm on 15 mm are 7.07 m, 15.1 Ω and 0.5 g."""
    paper = RoundWinding(150, 1e-4, 13e-3, 17e-3, 2e-3)
    assert paper.length == pytest.approx(7.07, abs=5e-3)
    assert paper.resistance == pytest.approx(15.1, abs=0.05)
    assert paper.mass == pytest.approx(0.5e-3, rel=0.01)
