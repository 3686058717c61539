"""Coils and magnets of other actuators: straight wires, dipoles, and the balance of forces."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.constants import mu_0

from chladni.sim.board.file import load_board
from chladni.sim.fields import driven as driven_module
from chladni.sim.fields.driven import at_coils, driven_fields, with_coils
from chladni.sim.fields.magnetic_coupling import MagneticCoupling, magnetic_coupling
from chladni.sim.fields.transfer import disc_fields, transfer_fields
from chladni.sim.magnetics.coil_coupling import force_and_couple, loop_field
from chladni.sim.magnetics.windings import RoundWinding, force_per_ampere

WINDING = RoundWinding(turns=250, wire=0.1e-3, inner=3e-3, outer=9e-3, height=1.5e-3)
MAGNET: dict[str, float] = {"remanence": 1.28, "radius": 3e-3, "height": 4e-3}
GAP = 1e-3


def wires(radius: float, at: np.ndarray, sides: int) -> np.ndarray:
    """Flux density per ampere of a loop of straight wires (Biot and Savart), T/A, (points, 3)."""
    angle = 2.0 * np.pi * np.arange(sides + 1) / sides
    corner = radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    middle, step = (corner[1:] + corner[:-1]) / 2.0, np.diff(corner, axis=0)
    off = at[:, None] - middle
    cube = np.linalg.norm(off, axis=2, keepdims=True) ** 3
    return np.asarray(mu_0 / (4.0 * np.pi) * (np.cross(step, off) / cube).sum(axis=1))


@pytest.mark.parametrize(("at", "up"), [(2e-3, 1e-3), (7e-3, 2.5e-3), (12e-3, -3e-3)])
def test_a_loop_is_many_straight_wires(at: float, up: float) -> None:
    radial, axial = loop_field(3e-3, at, up)
    # 2,000 sides of a loop leave (π/2000)²/6 of its area.
    found = wires(3e-3, np.array([[at, 0.0, up]]), 2000)[0]
    assert [radial, axial] == pytest.approx([found[0], found[2]], rel=1e-5)


def test_on_its_own_axis_a_winding_pulls_as_ever() -> None:
    force, couple = force_and_couple(WINDING, gap=GAP, apart=1e-7, **MAGNET)
    own = force_per_ampere(WINDING, gap=GAP, **MAGNET)
    assert force == pytest.approx(own, rel=1e-3)
    assert abs(couple) < 1e-6 * own


def test_a_neighbour_is_pulled_and_turned_as_by_its_wires() -> None:
    apart, turns = 10e-3, 6
    rng = np.random.default_rng(3)
    # Charges of both faces at random points, the winding as 36 loops of 300 wires.
    r, phi = MAGNET["radius"] * np.sqrt(rng.random(400)), 2.0 * np.pi * rng.random(400)
    x, y = r * np.cos(phi), r * np.sin(phi)
    share = (np.arange(turns) + 0.5) / turns
    charge = 1.28 / mu_0 * np.pi * MAGNET["radius"] ** 2 / 400 * WINDING.turns / turns**2
    force = couple = 0.0
    for sign, depth in ((1.0, MAGNET["height"]), (-1.0, 0.0)):
        for across in share:
            for down in share * WINDING.height:
                z = np.full(400, GAP + MAGNET["height"] - depth + down)
                points = np.stack([apart + x, y, z], axis=1)
                field = wires(1.5e-3 + 3e-3 * float(across), points, 300)
                force += sign * charge * float(field[:, 2].sum())
                couple += sign * charge * float((field[:, 2] * x + field[:, 0] * depth).sum())
    # 400 points in a face leave a twentieth of what changes across it.
    assert force_and_couple(WINDING, gap=GAP, apart=apart, **MAGNET) == pytest.approx(
        (force, couple), rel=0.05
    )


def test_far_away_both_are_dipoles() -> None:
    apart = 0.5
    force, _ = force_and_couple(WINDING, gap=GAP, apart=apart, **MAGNET)
    radii = 1.5e-3 + 3e-3 * (np.arange(1000) + 0.5) / 1000
    coil = WINDING.turns * np.pi * float(np.mean(radii**2))
    magnet = 1.28 / mu_0 * np.pi * MAGNET["radius"] ** 2 * MAGNET["height"]
    up = GAP + (WINDING.height + MAGNET["height"]) / 2.0
    # The force of the two dipoles' energy, −∂/∂z μ₀ m m′/(4π) (1 − 3z²/s²)/s³ ≈ 9 z/d⁵.
    assert -force == pytest.approx(
        9.0 * mu_0 * coil * magnet * up / (4 * np.pi * apart**5), rel=0.02
    )


def test_forces_on_every_magnet_are_in_balance() -> None:
    board = load_board("quiet5")
    bare, driven = transfer_fields(board), driven_fields(board)
    coupling = magnetic_coupling(board)
    assert coupling is not None
    assert driven.reaction is not None
    # The couples' own fields are left over where the forces that fit are taken away.
    own = bare.values.reshape(5, -1)
    forces = np.linalg.lstsq(own.T, driven.values.reshape(5, -1).T, rcond=None)[0]
    coil = board.coil
    assert coil is not None
    omega = 2.0 * np.pi * 160.0
    brake = 1j * omega * coil.force_factor**2 / (coil.resistance + 1j * omega * coil.inductance)
    moved = np.stack([at_coils(board, field) for field in driven.values], axis=1)
    asked = coupling.forces - (brake * np.eye(5) + coupling.stiffness) @ moved
    # Couples that forces make up for in the fit are of a twentieth.
    assert np.abs(forces - asked).max() < 0.03
    assert np.abs(coupling.forces - np.eye(5)).max() > 0.01


def test_what_moves_a_magnet_is_what_the_magnet_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reciprocity of a plate with its magnets' springs and brakes, each coil on its own magnet."""
    board = load_board("quiet5")
    coupling = magnetic_coupling(board)
    assert coupling is not None
    only = MagneticCoupling(np.eye(5), 0.0 * coupling.couples, coupling.stiffness)
    monkeypatch.setattr(driven_module, "magnetic_coupling", lambda _: only)
    monkeypatch.setattr(MagneticCoupling, "largest", lambda *_: 1.0)
    driven = driven_fields(board)
    radius = 6e-3
    x, y = np.meshgrid(board.x, board.y, indexing="ij")
    for place in ((0.0, 0.0), (0.0, 8.0)):
        answer = disc_fields(board, [place], radius).values
        to_magnets = at_coils(board, with_coils(board, driven, answer)[0])
        disc = np.hypot(x - place[0] * 1e-3, y - place[1] * 1e-3) <= radius
        to_place = driven.values[:, disc].mean(axis=1)
        # Points of an image fill a disc to a few hundredths.
        assert np.abs(to_magnets - to_place).max() < 0.05 * np.abs(to_place).max()
