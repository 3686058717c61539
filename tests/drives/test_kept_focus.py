"""What is left of a focus by a click and on stiffer foam."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.drives.methods import SEED
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.best_drives import best_drives
from chladni.drives.scoring.board_score import score_board
from chladni.drives.scoring.kept_focus import click_um
from chladni.drives.scoring.several_fingers.finger_sets import pressed_fields
from chladni.drives.scoring.survey import active_lattice, score_drives
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.image import metrics
from chladni.sim.image.finger import pressing_stiffness
from conftest import shipped_board


def test_a_click_keeps_what_the_real_part_of_its_drive_keeps_at_200_hz() -> None:
    """Found another way: phases by a scan, the finger on a board that is solved for 200 Hz."""
    board = shipped_board("strip5")
    score = score_board(board, samples=0, pitch=12e-3, in_full=True)
    at_200 = replace(board, drive=replace(board.drive, frequency_hz=200.0))
    solved, found = solved_board(at_200), []
    places = active_lattice(board, 12e-3).places
    turns = np.exp(1j * np.linspace(0.0, np.pi, 2001))
    for place, drive in zip(
        places, best_drives(solved_board(board), places, "focus", SEED), strict=True
    ):
        parts = np.real(drive * turns[:, None])
        real = parts[np.argmax(np.sum(parts**2, axis=1))]
        discs = metrics.FingertipDiscs(board.x, board.y)
        fields = pressed_fields(solved, np.array([place]), pressing_stiffness(1.0, 200.0))
        moved = np.tensordot(real.astype(complex), fields, axes=1)
        found.append(discs.second_finger_db(moved, place, [20e-3])[0])
    assert score.click_20mm_db is not None
    assert score.click_20mm_db.median == pytest.approx(float(np.median(found)), abs=0.01)
    assert score_board(board, samples=0, pitch=24e-3).click_20mm_db is None


def test_a_click_s_peak_is_of_a_pressed_plate_at_the_coils_limit() -> None:
    """The finger as a spring on the plate that is solved with it, the drive at a volt's limit."""
    board = shipped_board("strip5")
    place = (0.0, 12e-3)
    drive = best_drives(solved_board(board), [place], "focus", SEED)[0]
    found = click_um(solved_board(board), [place], [drive])
    turned = drive * np.exp(-0.5j * np.angle(np.sum(drive**2)))
    full = full_drive(board, turned.real.astype(complex), 160.0)
    fields = pressed_fields(solved_board(board), np.array([place]), pressing_stiffness(1.0, 160.0))
    disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
    assert full is not None
    share = turned.real / np.abs(turned.real).max()
    moved = abs(np.tensordot(share, fields, axes=1)[disc].mean()) * full.newtons
    assert found is not None
    assert found.median == pytest.approx(0.89e6 * moved, rel=1e-3)


def test_stiffer_foam_leaves_what_the_same_drives_leave_on_its_plate() -> None:
    """Which a survey of the plate on that foam says, of drives that were found on the drawn one."""
    board = shipped_board("strip5")
    score = score_board(board, samples=0, pitch=12e-3, in_full=True)
    assert board.foundation is not None
    stiff = replace(board, foundation=board.foundation.stiffer(2.0))
    lattice = active_lattice(board, 12e-3)
    drives = best_drives(solved_board(board), lattice.places, "focus", SEED)
    found = score_drives(solved_board(stiff), lattice, drives, samples=0, seed=SEED)
    assert score.foam_twice is not None
    spreads = [
        (own.second_finger_20mm_db, own.finger_um) for own in (score.foam_twice, found, score)
    ]
    (away, um), (same, moved), (_, before) = (
        [0.0 if one is None else one.median for one in own] for own in spreads
    )
    assert away == pytest.approx(same, abs=0.1)
    assert um == pytest.approx(moved, rel=0.01)
    assert 0.0 < um < 0.6 * before
    assert score_board(board, samples=0, pitch=24e-3).foam_twice is None
