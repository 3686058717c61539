"""What a driven coil makes the others read: reciprocity, Neumann's integral, far fields."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.errors import MissingError
from chladni.sim.fields.driven import at_coils, driven_fields
from chladni.sim.fields.induced import induced_voltages, open_coils, shared_inductances
from chladni.sim.fields.transfer import transfer_fields
from chladni.sim.magnetics.coil_coupling import mutual_inductance
from chladni.sim.magnetics.constants import MU_0
from chladni.sim.magnetics.windings import RoundWinding

WINDING = RoundWinding(250, 1e-4, 3e-3, 9e-3, 1.5e-3)


@pytest.fixture(scope="module")
def strip() -> Board:
    return load_board("strip5")


def test_coils_read_of_each_other_alike(strip: Board) -> None:
    """Reciprocity, couples and pulls on neighbours' magnets included: no formula here has it."""
    felt = open_coils(strip, 160.0).compliance
    assert strip.has_magnetic_coupling
    assert np.abs(felt - felt.T).max() < 2e-3 * np.abs(felt).max()


def test_without_magnets_pull_a_coil_reads_the_plate_under_it(strip: Board) -> None:
    """BL iω w, with w from the transfer fields, and no brake however strong its coil is."""
    assert strip.coil is not None
    board = dataclasses.replace(strip, winding=None)
    coils = open_coils(board, 160.0)
    plain = transfer_fields(board, allow_unmet=True)
    moved = np.stack([at_coils(board, own) for own in plain.values], axis=1)
    assert coils.compliance == pytest.approx(moved, rel=1e-9)
    volts = induced_voltages(board, coils.compliance, 160.0)
    expected = 2j * np.pi * 160.0 * strip.coil.force_factor**2 * moved
    assert volts == pytest.approx(expected, rel=1e-9)


def test_a_board_without_a_coil_reads_nothing(strip: Board) -> None:
    with pytest.raises(MissingError, match=r"\[coil\] is required"):
        induced_voltages(dataclasses.replace(strip, coil=None), np.eye(5, dtype=complex), 160.0)


def test_coils_far_apart_share_a_dipoles_flux() -> None:
    """-µ₀ (N A)²/(4π d³), with the mean area of all turns."""
    radii = np.linspace(WINDING.inner, WINDING.outer, 2001) / 2.0
    area = np.pi * float(np.mean(radii**2))
    apart = 0.2
    dipole = -MU_0 * (WINDING.turns * area) ** 2 / (4.0 * np.pi * apart**3)
    assert mutual_inductance(WINDING, apart) == pytest.approx(dipole, rel=3e-3)


def test_coils_side_by_side_share_what_neumann_says() -> None:
    """Of thin rings: µ₀/4π ∮∮ dl·dl′/r, which converges at once on circles that do not touch."""
    ring = RoundWinding(1, 1e-5, 7.999e-3, 8.001e-3, 1e-6)
    angle = 2.0 * np.pi * np.arange(400) / 400
    points = 4e-3 * np.exp(1j * angle)
    steps = 1j * points * (2.0 * np.pi / 400)
    for apart in (0.011, 0.03):
        away = np.abs(points[:, None] - (points + apart))
        along = np.real(steps[:, None] * steps.conj())
        neumann = MU_0 / (4.0 * np.pi) * float((along / away).sum())
        assert mutual_inductance(ring, apart) == pytest.approx(neumann, rel=5e-3)


def test_every_pair_is_in_the_matrix(strip: Board) -> None:
    shared = shared_inductances(strip)
    assert shared == pytest.approx(shared.T)
    assert np.all(np.diag(shared) == 0.0)
    at = np.array([own.at for own in strip.actuators])
    assert strip.winding is not None
    apart = float(np.hypot(*(at[0] - at[3])))
    assert shared[0, 3] == pytest.approx(mutual_inductance(strip.winding.round, apart))
    assert not shared_inductances(dataclasses.replace(strip, winding=None)).any()


def test_a_dead_coil_makes_no_field_and_breaks_the_mirror(strip: Board) -> None:
    from chladni.sim.fields.board_mirrors import board_mirrors  # noqa: PLC0415

    first, *others = strip.actuators
    dead = dataclasses.replace(strip, actuators=(dataclasses.replace(first, is_dead=True), *others))
    fields, plain = driven_fields(dead), driven_fields(strip)
    assert not fields.values[0].any()
    assert fields.values[1:] == pytest.approx(plain.values[1:])
    assert board_mirrors(strip) != board_mirrors(dead)
