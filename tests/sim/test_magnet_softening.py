"""Magnets side by side: against integrated charges and a rigid disc on an endless plate."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.constants import mu_0
from scipy.special import kei, keip, ker, kerp

from chladni.sim.board.board import Board
from chladni.sim.board.file import board_from_document, load_board
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.magnet_softening import MATTERS, magnet_softening
from chladni.sim.magnetics.magnet_coupling import Magnets
from conftest import ROOT, CommandLine

REMANENCE, RADIUS = 1.28, 3e-3


def energy_of_charges(apart: float, up: float, height: float) -> float:
    """Of two magnets side by side, the charges ±Br/μ₀ of their end faces integrated; J."""
    node, weight = np.polynomial.legendre.leggauss(8)
    r, angle = RADIUS * (node + 1.0) / 2.0, 2.0 * np.pi * np.arange(20) / 20
    x, y = (r[:, None] * np.cos(angle)).ravel(), (r[:, None] * np.sin(angle)).ravel()
    area = np.repeat(weight * RADIUS / 2.0 * r, 20) * 2.0 * np.pi / 20
    total = 0.0
    for sign, level in ((1.0, up), (1.0, up), (-1.0, up + height), (-1.0, up - height)):
        beside = np.hypot(x[:, None] - x - apart, y[:, None] - y)
        total += sign * float(area @ (1.0 / np.hypot(beside, level)) @ area)
    return total * REMANENCE**2 / (4.0 * np.pi * mu_0)


@pytest.mark.parametrize(
    ("apart", "height", "force_over", "stiffness_over"),
    [
        (7e-3, 4e-3, 0.10, 0.15),
        (11e-3, 4e-3, 0.02, 0.035),
        (24e-3, 4e-3, 2e-3, 3e-3),
        (11e-3, 8e-3, 0.45, 0.90),
    ],
)
def test_neighbours_are_bounded_by_what_their_charges_do(
    apart: float, height: float, force_over: float, stiffness_over: float
) -> None:
    """Never less than the integral, and more by so much; of tall ones only the dipole is kept.

    Differences over 10 and 300 µm are exact to 1e-6 and 1e-3.
    """
    magnets = Magnets(np.array([[0.0, 0.0], [apart, 0.0]]), REMANENCE, RADIUS, height)

    def energy(along: float, up: float) -> float:
        return energy_of_charges(apart + along, up, height)

    pushed = (energy(-1e-5, 0.0) - energy(1e-5, 0.0)) / 2e-5
    curved = (energy(0.0, 3e-4) - 2.0 * energy(0.0, 0.0) + energy(0.0, -3e-4)) / 9e-8
    own = magnets.lateral_forces()
    assert own[0] == pytest.approx(-own[1])
    assert 0.999 < own[1, 0] / pushed < 1.0 + force_over
    stiffness = magnets.axial_stiffness()
    assert stiffness @ np.ones(2) == pytest.approx(np.zeros(2), abs=1e-9)
    assert 0.999 < stiffness[0, 0] / curved < 1.0 + stiffness_over


def rigid_disc_on_foam(board: Board, apart: float) -> tuple[float, float]:
    """Stiffness of a rigid disc on an endless plate on foam, N/m, and the plate's share far off.

    w = p ker(r/λ) + q kei(r/λ) with w = 1 and w′ = 0 at the rim; ∇²ker = −kei/λ², ∇²kei = ker/λ².
    The foam under the disc and the shear 2πa D (∇²w)′ hold it.
    """
    assert board.magnet is not None
    bending, k, a = board.plate.bending_stiffness, 3e7, board.magnet.radius
    decay = (bending / k) ** 0.25
    x = a / decay
    p, q = np.linalg.solve([[ker(x), kei(x)], [kerp(x), keip(x)]], [1.0, 0.0])
    shear = 2.0 * np.pi * a * bending * (-p * keip(x) + q * kerp(x)) / decay**3
    far = apart / decay
    return float(k * np.pi * a**2 + shear), float(p * ker(far) + q * kei(far))


@pytest.mark.parametrize("apart", [11e-3, 14e-3])
def test_two_magnets_soften_foam_as_a_spring_below_zero_would(apart: float) -> None:
    """Together two magnets feel nothing; against each other they take 2c/s away.

    c is their spring, and 1/s = H₁₁ − H₁₂ of a rigid disc on an endless plate. The edges change
    H₁₁ by 1 %; that the other magnet is rigid, too, stiffens them against each other by 5 %.
    """
    text = (ROOT / "boards" / "strip5.toml").read_text(encoding="utf-8")
    document = tomllib.loads(text)
    document["plate"]["size_mm"] = [40.0, 60.0]
    del document["winding"]
    document["foundation"].pop("coil_cut_out_mm")
    document["coil"] |= {"resistance_ohm": 13.0, "inductance_mh": 0.4, "force_factor_n_per_a": 0.6}
    document["electronics"] |= {"pwm_pins": [], "sign_pins": [], "coil_ohm": 13.0}
    document["actuators"] = [
        {"name": str(side), "at_mm": [0.0, side * apart * 500.0]} for side in (-1, 1)
    ]
    board = board_from_document(document)
    found = magnet_softening(board, plate_model(board))
    assert found is not None
    stiffness, share = rigid_disc_on_foam(board, apart)
    assert found.held_n_per_mm == pytest.approx(stiffness * 1e-3, rel=0.03)
    softened = -2.0 * found.stiffness_n_per_mm * 1e3 / stiffness * (1.0 - share)
    assert found.softened == pytest.approx(softened, rel=0.08)


def test_magnets_that_nothing_is_known_of_are_left_out(prototype: Board) -> None:
    assert magnet_softening(prototype, plate_model(prototype)) is None


def test_show_says_what_magnets_take_away_where_it_matters(
    chladni: CommandLine, tmp_path: Path
) -> None:
    shipped = load_board("strip5")
    usual = magnet_softening(shipped, plate_model(shipped))
    assert usual is not None
    assert usual.softened is not None
    assert 0.01 < usual.softened < 0.03 < MATTERS
    text = (ROOT / "boards" / "strip5.toml").read_text(encoding="utf-8")
    strong = tmp_path / "strong.toml"
    text = text.replace("remanence_t = 1.28", "remanence_t = 2.0")
    strong.write_text(text.replace("thickness_mm = 2.0", "thickness_mm = 3.0"), encoding="utf-8")
    done = chladni("board", "show", strong, "--json")
    share = done.json["neighbours"]["softened"]
    assert share > 0.05
    assert done.err == (
        f"chladni: the magnets push each other out of their plane and take {share:.0%} of what "
        "holds them: put them farther apart, or turn every other one over\n"
    )
    # What the winding makes with a magnet of so much more remanence.
    winding = done.json["winding"]
    assert winding["force_factor_n_per_a"] == pytest.approx(0.6717 * 2.0 / 1.28, abs=2e-4)
    assert winding["nearer_by_0_1_mm"] == pytest.approx(0.053, abs=1e-3)
    assert winding["farther_by_0_1_mm"] == pytest.approx(-0.050, abs=1e-3)
