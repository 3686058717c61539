"""A sheet under a press: the differential equations on a round one, closed forms and itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.several_fingers.finger_sets import pressed_fields
from chladni.sim.board.file import load_board
from chladni.sim.fields.pressed_sheet import PressedSheet, PressingFingers, is_thin
from chladni.sim.fields.transfer import transfer_fields
from chladni.sim.image.finger import pressing_stiffness
from chladni.sim.plate.geometry import FoundationLayer, PlateGeometry
from chladni.sim.pressed.press import flat, press, vibration
from chladni.sim.pressed.sheet import SHEAR_OF_FOAM, Foam, SplineSheet

SIDE, THICKNESS, MODULUS, POISSON = 50e-3, 0.1e-3, 22e9, 0.15
STIFFNESS = 4e7
BENDING = MODULUS * THICKNESS**3 / (12.0 * (1.0 - POISSON**2))
MEMBRANE = MODULUS * THICKNESS / (1.0 - POISSON**2)
FINGER = 6e-3
OPEN = Foam(STIFFNESS, 0.2, 0.0, 0.7)


def sheet(element: float = 2e-3, foam: Foam = OPEN) -> SplineSheet:
    """`quiet16` without its magnets and the holes round them."""
    geometry = PlateGeometry(
        SIDE, SIDE, BENDING, POISSON, 0.19, foundation=FoundationLayer(STIFFNESS, 0.2)
    )
    return SplineSheet(geometry, MEMBRANE, foam, element)


def round_sheet(newtons: float) -> tuple[float, float]:
    """Mean deflection under the finger (m) and tension in its middle (N/m), by collocation.

    Von Kármán's equations of a round free sheet on springs, axially symmetric: w, its slope, its
    curvature, the shear times r, the motion along the sheet, and N_r.
    """
    pressure = newtons / (np.pi * FINGER**2)

    def slopes(r: np.ndarray, y: np.ndarray) -> np.ndarray:
        w, slope, curved, shear, along, tension = y
        round_it = POISSON * tension + MEMBRANE * (1.0 - POISSON**2) * along / r
        # Steep enough for a finger's rim.
        under = pressure / (1.0 + np.exp(np.clip((r - FINGER) / 5e-5, -50.0, 50.0)))
        return np.stack(
            [
                slope,
                curved - slope / r,
                (shear / r + tension * slope) / BENDING,
                r * (under - STIFFNESS * w),
                tension / MEMBRANE - POISSON * along / r - slope**2 / 2.0,
                (round_it - tension) / r + SHEAR_OF_FOAM * STIFFNESS * along,
            ]
        )

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        moment = b[2] - (1.0 - POISSON) * b[1] / (SIDE / 2.0)
        return np.array([a[1], a[3], a[4], b[3], moment, b[5]])

    r = np.linspace(1e-5, SIDE / 2.0, 600)
    guess = np.zeros((6, r.size))
    found = solve_bvp(slopes, ends, r, guess, tol=1e-5, max_nodes=40_000)
    assert found.success
    fine = np.linspace(1e-5, FINGER, 4000)
    mean = np.trapezoid(found.sol(fine)[0] * 2.0 * fine, fine) / FINGER**2
    # At r = 10 µm the end's u = 0 holds the sheet as a rigid inclusion would. 1 mm is clear of it.
    return float(mean), float(found.sol(1e-3)[5])


@pytest.mark.parametrize("newtons", [0.3, 1.0, 3.0])
def test_a_pressed_sheet_is_that_of_the_differential_equations(newtons: float) -> None:
    """A round one of the same width: its edge is six foam lengths away."""
    own = sheet()
    load = own.mean(0.0, 0.0, FINGER)
    at = press(own, load, newtons, flat(own))
    mean, tension = round_sheet(newtons)
    assert load @ at.deflection == pytest.approx(mean, rel=0.01)
    middle = own.disc(0.0, 0.0, 1e-3)
    assert at.tension[0, middle].mean() == pytest.approx(tension, rel=0.03)
    assert at.tension[1, middle].mean() == pytest.approx(tension, rel=0.03)
    # Three times the press does not go three times as deep.
    assert (tension > 100.0) == (newtons >= 1.0)


def test_a_light_press_is_that_of_kelvin_functions() -> None:
    """A point on an endless plate on springs: w = F/(8 √(kD)). Elements of 1 mm."""
    own = sheet(1e-3)
    load = own.mean(0.0, 0.0, 0.4e-3)
    at = press(own, load, 1e-4, flat(own))
    expected = 1e-4 / (8.0 * np.sqrt(STIFFNESS * BENDING))
    # The disc's own size takes (a/λ)² of it, 1 %, and cubic splines round the point off.
    assert load @ at.deflection == pytest.approx(expected, rel=0.03)


def test_vibration_about_a_press_is_the_press_of_a_little_more() -> None:
    own = sheet()
    load = own.mean(4e-3, -3e-3, FINGER)
    at = press(own, load, 1.0, flat(own))
    more = press(own, load, 1.001, at)
    still = vibration(own, at, load[:, None], 0.0, loss_factor=0.0)[:, 0]
    lossless = SplineSheet(own.geometry, MEMBRANE, Foam(STIFFNESS, 0.0, 0.0, 0.7), 2e-3)
    still = vibration(lossless, at, load[:, None], 0.0, loss_factor=0.0)[:, 0]
    assert np.abs(still.imag).max() == 0.0
    slope = (more.deflection - at.deflection) / 1e-3
    assert load @ still.real == pytest.approx(load @ slope, rel=1e-3)


def test_foam_bottoms_out_and_its_slope_is_its_own() -> None:
    foam = Foam(STIFFNESS, 0.2, 1.5e-3, 0.72)
    deep = np.array([-0.2e-3, 0.0, 0.3e-3, 0.7e-3, 1.0e-3])
    step = 1e-9
    pressure, slope = foam.pressure(deep)
    assert slope == pytest.approx((foam.pressure(deep + step)[0] - pressure) / step, rel=1e-4)
    # A quarter of the thickness: what data sheets measure.
    assert foam.pressure(np.array([0.375e-3]))[0][0] == pytest.approx(
        STIFFNESS * 0.375e-3, rel=0.05
    )
    own = sheet(foam=Foam(STIFFNESS, 0.2, 0.3e-3, 0.7))
    load = own.mean(0.0, 0.0, FINGER)
    at = press(own, load, 10.0, flat(own))
    assert 0.15e-3 < (own.value @ at.deflection).max() < 0.21e-3


def test_a_pressing_finger_is_pulp_before_a_mass() -> None:
    omega = 2.0 * np.pi * 160.0
    pulp, bone = 2e3 + 2j * omega, -(omega**2) * 10e-3
    assert pressing_stiffness(1.0, 160.0) == pytest.approx(1.0 / (1.0 / pulp + 1.0 / bone))
    pulp = 5e3 + 4j * omega
    assert pressing_stiffness(3.0, 160.0) == pytest.approx(1.0 / (1.0 / pulp + 1.0 / bone))
    assert abs(pressing_stiffness(0.3, 160.0)) < abs(pressing_stiffness(1.0, 160.0))


@pytest.mark.parametrize("name", ["quiet5", "pad16"])
def test_free_sheets_in_splines_are_those_of_the_plate(name: str) -> None:
    """So that the difference a press makes is right to as much of itself."""
    board = load_board(name)
    own = PressedSheet(board)
    still = PressingFingers(((0.0, 0.0),), 1e-6, 0.0)
    changed = own.change(still)
    free = own._free[1.0]
    bare = transfer_fields(board).values
    assert np.linalg.norm(free - bare) < 0.06 * np.linalg.norm(bare)
    # Who hardly presses, and neither moves nor holds, changes nothing.
    assert np.linalg.norm(changed) < 1e-4 * np.linalg.norm(free)


def test_two_fingers_on_a_flat_sheet_change_what_they_change_on_the_plate() -> None:
    """Where hardly any press stretches it: fields by the plate with the fingers built in.

    The plate's and the splines' own fields differ by up to 6 %, and so may what fingers change.
    Neither coils nor magnets answer to each other here, which the splines leave out.
    """
    board = load_board("quiet16")
    assert board.magnet is not None
    still = replace(board.magnet, remanence=0.0)
    board = replace(board, magnet=still, coil=None, winding=None)
    places = ((-9e-3, 3e-3), (8e-3, -5e-3))
    stiffness = pressing_stiffness(1.0, 160.0)
    changed = PressedSheet(board).change(PressingFingers(places, 1e-6, stiffness))
    solved = solved_board(board)
    expected = pressed_fields(solved, np.array(places), stiffness) - solved.fields.values
    assert np.linalg.norm(changed - expected) < 0.06 * np.linalg.norm(expected)


def test_fingers_far_apart_press_as_each_alone() -> None:
    """Eight foam lengths between them; both together are their mean."""
    own = PressedSheet(load_board("quiet16"))
    first, second = (-17e-3, 17e-3), (16e-3, -17e-3)
    alone = [own.deflection(PressingFingers((place,), 1.0, 0.0)) for place in (first, second)]
    both = own.deflection(PressingFingers((first, second), 1.0, 0.0))
    assert both == pytest.approx(np.mean(alone), rel=0.01)
    near = own.deflection(PressingFingers((first, (-11e-3, 17e-3)), 1.0, 0.0))
    assert near > 1.1 * both


def test_thick_sheets_are_not_stretched() -> None:
    assert is_thin(load_board("quiet16"), 0.3)
    assert not is_thin(load_board("phone15"), 1.0)
    assert not is_thin(load_board("prototype"), 3.0)
