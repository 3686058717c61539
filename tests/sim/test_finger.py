"""What a finger feels and changes: against built-in springs, an ODE, and coupled electronics."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Coil
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import FINGERS, Finger
from chladni.sim.board.foundation import Foundation
from chladni.sim.board.parts import Actuator, Edges, Pin, Screw, Spring
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.driven import back_emf_coupling, driven_fields
from chladni.sim.fields.static import is_held, static_fields
from chladni.sim.fields.transfer import transfer_fields
from chladni.sim.image.finger import (
    dynamic_stiffness,
    fields_under_finger,
    sensation_db,
    threshold_um,
)
from chladni.sim.plate.geometry import PlateGeometry, PointFeature, RimSupport
from chladni.sim.plate.loads import Load
from chladni.sim.ritz.plate import RitzPlate
from wired_boards import limits_used


@pytest.mark.parametrize(("stiffness", "mass_g"), [(600.0, 2.0), (0.0, 5.0), (3000.0, 0.0)])
def test_a_pressing_finger_is_a_spring_and_a_mass_built_in(stiffness: float, mass_g: float) -> None:
    """At a point: the rank-one change against a plate that was solved with both on it."""
    hz = 240.0
    x, y = np.linspace(-0.04, 0.04, 41), np.linspace(-0.06, 0.06, 49)
    i, j = 26, 31
    place = (float(x[i]), float(y[j]))
    rims = (RimSupport(0.03, 0.05, 2e-3), RimSupport(-0.03, -0.05, 2e-3))
    bare = PlateGeometry(0.09, 0.13, 0.4, 0.2, 1.0, rims=rims)
    mass = mass_g * 1e-3
    feature = PointFeature(*place, stiffness=stiffness, mass=mass)
    built_in = dataclasses.replace(bare, points=(feature,))
    loads = [Load(-0.02, 0.01, 4e-3), Load(*place)]

    def fields(geometry: PlateGeometry) -> np.ndarray:
        return (
            RitzPlate(geometry, 0.02)
            .respond(loads, frequency_hz=hz, x=x, y=y, tolerance=1e-5)
            .values
        )

    plain, expected = fields(bare), fields(built_in)
    # A built-in spring loses what the plate does, η of its force.
    z = dynamic_stiffness(Finger(mass, 0.02 * stiffness / (2.0 * np.pi * hz), stiffness), hz)
    found = fields_under_finger(plain, plain[:, i, j], plain[1], complex(plain[1, i, j]), z)
    assert np.abs(expected - plain).max() > 0.02 * np.abs(plain).max()  # it does change something
    # Each is asked for 1e-5.
    assert np.abs(found - expected).max() < 2e-5 * np.abs(expected).max()


def test_a_finger_of_pure_damping_takes_energy_and_one_of_infinite_stiffness_holds() -> None:
    own, means = 2e-4 - 1e-6j, np.array([3e-4 + 1e-5j])
    fields = means[:, None, None] * np.ones((1, 2, 2), complex)
    answer = own * np.ones((2, 2), complex)
    held = fields_under_finger(fields, means, answer, own, 1e12)
    assert np.abs(held).max() < 1e-6 * np.abs(means[0])
    damper = 1j * 2.0 * np.pi * 160.0 * 5.0
    braked = fields_under_finger(fields, means, answer, own, damper)[0, 0, 0]
    # Power into the damper, ½ Re(F* iω w): never negative.
    assert np.real(np.conj(damper * braked) * 1j * braked) > 0.0


def test_detection_thresholds_meet_their_anchors() -> None:
    """Verrillo: −20 dB re 1 µm at 250 Hz and +12 dB at 40 Hz on 2.9 cm², less contact since."""
    from_area = 10.0 * np.log10(2.9 / 1.13)
    at_250 = threshold_um(250.0)
    assert at_250 is not None
    assert 20.0 * np.log10(at_250) == pytest.approx(-20.0 + from_area, abs=0.3)
    assert threshold_um(40.0) == pytest.approx(10.0 ** (12.0 / 20.0), rel=0.01)
    assert threshold_um(39.9) is None
    assert threshold_um(801.0) is None
    assert sensation_db(0.36, 160.0) == pytest.approx(0.0, abs=1e-9)
    assert sensation_db(0.0, 160.0) is None
    assert [sensation_db(v, 160.0) for v in (0.36, 3.6)] == pytest.approx([0.0, 20.0])


def held(board: Board, **parts: object) -> Board:
    bare = {"screws": (), "pins": (), "springs": (), "magnet": None}
    plate = dataclasses.replace(board.plate, edges=parts.pop("edges", Edges()))  # type: ignore[arg-type]
    return dataclasses.replace(board, plate=plate, **{**bare, **parts})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        ({}, False),
        ({"screws": (Screw((0.0, 0.03), 1e-3),)}, True),
        ({"screws": (Screw((0.0, 0.03), 1e-3, "sprung", 0.0, 1.0),)}, False),
        ({"pins": (Pin((0.01, 0.02)), Pin((-0.01, -0.02)))}, False),
        ({"pins": (Pin((0.01, 0.02)), Pin((-0.01, -0.02)), Pin((0.02, 0.0)))}, True),
        ({"pins": (Pin((0.01, 0.02)), Pin((0.0, 0.0)), Pin((-0.01, -0.02)))}, False),
        ({"springs": (Spring((0.01, 0.02), 1e3),), "edges": Edges(left="simply supported")}, True),
        ({"edges": Edges(left="simply supported")}, False),
        ({"edges": Edges(top="clamped")}, True),
        ({"foundation": Foundation(1e6)}, True),
    ],
)
def test_a_board_is_held_where_no_rigid_motion_is_left(
    prototype: Board, parts: dict[str, object], expected: bool
) -> None:
    assert is_held(held(prototype, **parts)) == expected


def test_static_deflection_is_navier_s(paper: Board) -> None:
    """Double sum of a point force on a supported plate, at rest."""
    found = static_fields(paper, plate_model(paper))
    assert found is not None
    plate = paper.plate
    m, n = np.arange(1, 300)[:, None], np.arange(1, 600)[None]
    kx, ky = m * np.pi / plate.size[0], n * np.pi / plate.size[1]
    shape = np.sin(kx * plate.size[0] / 2.0) * np.sin(ky * plate.size[1] / 2.0)
    total = shape**2 / (plate.bending_stiffness * (kx**2 + ky**2) ** 2)
    centre = 4.0 / (plate.size[0] * plate.size[1]) * float(total.sum())
    # Fields are asked for 5e-3.
    assert found[0].max() == pytest.approx(centre, rel=5e-3)


def rigid_board(paper: Board, coil: Coil, mass_kg: float) -> Board:
    """A small stiff free plate of a known mass with one coil in its middle."""
    side = 0.02
    plate = dataclasses.replace(
        paper.plate,
        size=(side, side),
        thickness=1e-3,
        youngs_modulus=1e12,
        edges=Edges(),
        density=mass_kg / side**2 / 1e-3,
    )
    image = dataclasses.replace(paper.image, points=(21, 21))
    electronics = dataclasses.replace(paper.electronics, pwm_pins=(), coil_ohm=coil.resistance)
    return dataclasses.replace(
        paper,
        plate=plate,
        coil=coil,
        image=image,
        electronics=electronics,
        panel=None,
        actuators=(Actuator("one", (0.0, 0.0)),),
    )


def test_a_coil_that_moves_is_driven_as_its_circuit_says(paper: Board) -> None:
    """A rigid mass on one coil: L di/dt + R i + BL v = V cos ωt, m dv/dt = BL i, integrated."""
    coil = Coil(3.0, 0.4e-3, 2.5, 1e-3, 160.0, 12.0, 1.8)
    mass, hz = 2e-3, 90.0
    board = rigid_board(paper, coil, mass)
    board = dataclasses.replace(board, drive=dataclasses.replace(board.drive, frequency_hz=hz))
    plain, driven = transfer_fields(board), driven_fields(board)
    assert np.linalg.norm(back_emf_coupling(board, plain)) > 0.5
    blocked = coil.force_factor / (coil.resistance + 2j * np.pi * hz * coil.inductance)
    found = complex(driven.values[0, 10, 10] * blocked)  # metres per volt
    omega = 2.0 * np.pi * hz

    def motion(t: float, state: np.ndarray) -> list[float]:
        i, v, _ = state
        di = (np.cos(omega * t) - coil.resistance * i - coil.force_factor * v) / coil.inductance
        return [di, coil.force_factor * i / mass, v]

    # The slowest decay is m R/BL² = 1 ms; a constant of integration stays in the deflection.
    end = 60.0 / hz
    t = np.linspace(end - 4.0 / hz, end, 4001)
    run = solve_ivp(motion, (0.0, end), [0.0] * 3, t_eval=t, rtol=1e-9, atol=1e-14, method="LSODA")
    w = run.y[2] - run.y[2][:-1].mean()
    expected = 2.0 * np.mean(w[:-1] * np.exp(-1j * omega * t[:-1]))
    assert found == pytest.approx(expected, rel=3e-3)
    assert abs(found / (plain.values[0, 10, 10] * blocked) - 1.0) > 0.3


def test_forces_take_no_notice_of_motion_below_the_tolerance(prototype: Board) -> None:
    """6.6e-4 on `prototype`: fields stay what they were, to the bit."""
    plain = transfer_fields(prototype, model=(model := plate_model(prototype)))
    assert np.linalg.norm(back_emf_coupling(prototype, plain), 2) == pytest.approx(6.6e-4, rel=0.05)
    assert np.array_equal(driven_fields(prototype, model=model).values, plain.values)


@pytest.mark.parametrize(
    ("limits", "limited_by"),
    [
        ({}, "duty"),
        ({"max_duty": 0.5}, "duty"),
        ({"supply_limit_ma": 150.0}, "supply"),
        ({"coil_limit_k": 15.0}, "heat"),
    ],
)
def test_full_drive_keeps_every_limit_and_uses_one_up(
    prototype: Board, limits: dict[str, float], limited_by: str
) -> None:
    own = dataclasses.replace(prototype.electronics, **limits)  # type: ignore[arg-type]
    board = dataclasses.replace(prototype, electronics=own)
    drive = np.array([1.0, 0.4j, -0.7, 0.0, 0.2])
    full = full_drive(board, drive, 160.0)
    assert full is not None
    assert full.limited_by == limited_by
    amplitude = full.duties
    t = np.arange(1000) / 1000.0
    duty = full.bias[:, None] + amplitude[:, None] * np.sin(2.0 * np.pi * t)
    used = limits_used(own, duty, own.coil_ohm, crests=1)
    assert duty.min() >= 0.0
    assert full.bias[3] == 0.0
    # The amplitude leaves up to five steps of 1024 of the duty.
    assert used[limited_by] == pytest.approx(1.0, abs=0.01)
    assert max(used.values()) < 1.0 + 1e-9


def test_the_full_drive_of_prototype_is_the_published_force(prototype: Board) -> None:
    """5 V half up and half down at 15 Ω and 0.8 N/A: 0.133 N, less what rounding keeps back."""
    full = full_drive(prototype, np.ones(5, complex), 160.0)
    assert full is not None
    assert full.newtons == pytest.approx(0.133, rel=0.02)
    assert full_drive(dataclasses.replace(prototype, coil=None), np.ones(5, complex), 160.0) is None
    assert full_drive(prototype, np.zeros(5, complex), 160.0) is None


def test_shipped_fingers_are_those_of_the_design() -> None:
    assert [FINGERS[name] for name in ("light", "usual", "firm")] == [
        Finger(1e-3, 1.0, 300.0),
        Finger(2e-3, 2.0, 600.0),
        Finger(5e-3, 3.0, 1000.0),
    ]
    assert load_board("prototype").finger is None


def test_what_is_steady_loses_nothing(prototype: Board) -> None:
    """Foam of a loss factor of 2 lies under a steady force as one of 0 does."""
    image = dataclasses.replace(prototype.image, points=(21, 41))
    bare = dataclasses.replace(prototype, image=image)
    found = []
    for loss in (0.0, 2.0):
        board = dataclasses.replace(bare, foundation=Foundation(3e6, loss))
        static = static_fields(board, plate_model(board))
        assert static is not None
        found.append(static)
    assert found[1] == pytest.approx(found[0], rel=1e-3, abs=1e-3 * float(np.abs(found[0]).max()))
    lossy = dataclasses.replace(bare, plate=dataclasses.replace(bare.plate, loss_factor=1.0))
    still = dataclasses.replace(bare, plate=dataclasses.replace(bare.plate, loss_factor=0.0))
    one, other = (static_fields(board, plate_model(board)) for board in (lossy, still))
    assert one is not None
    assert other is not None
    assert one == pytest.approx(other, rel=1e-3, abs=1e-3 * float(np.abs(other).max()))
