"""Micrometres, volts and the finger's load, from a board file to the pins and back."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from chladni.drives.methods.base import Options
from chladni.drives.problem.pressing import pressed_problem, with_finger
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.felt import disagreement, felt
from chladni.drives.solve import solve, solve_problem
from chladni.host.emulation.closed_loop import run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import FINGERS
from chladni.sim.board.parts import Image, Regions
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.fields.transfer import disc_fields, transfer_fields
from chladni.sim.image.finger import dynamic_stiffness
from chladni.tables import build_table
from chladni.tables.build import board_drives
from chladni.tables.felt_survey import survey_of
from chladni.tables.report import TableReport
from chladni.tables.stored_regions import stored_regions
from chladni.tables.table import Table
from conftest import CommandLine

NO_COIL = Path(__file__).parent / "no-coil.toml"
FELT = {
    "finger_um", "um_per_newton", "full_volts", "full_amperes", "limited_by", "sensation_db",
    "static_um", "finger_load",
}  # fmt: skip


def test_the_pins_swing_as_far_as_the_full_drive_says(
    coarse_board: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    """The firmware at level 1: amplitude and mean of every duty on the emulated pins."""
    recording, report = run_loop(
        coarse_table[0], coarse_board, [TouchEvent(20.0, (10.0, 25.0))], 220.0, level=1.0
    )
    full = full_drive(coarse_board, report.promised, 160.0)
    assert full is not None
    settled = recording.duty[recording.t_s > 0.1]
    waves = int(160.0 * len(settled) / recording.carrier_hz)
    settled = settled[: round(waves * recording.carrier_hz / 160.0)]
    wave = np.exp(-2j * np.pi * 160.0 * np.arange(len(settled)) / recording.carrier_hz)
    amplitude = 2.0 * np.abs(settled.T @ wave) / len(settled)
    # The firmware rounds its level down by up to half a step of 1024, and a bias up by one.
    assert amplitude == pytest.approx(full.duties, abs=5e-4)
    assert settled.mean(axis=0) == pytest.approx(full.bias, abs=1.5e-3)


@pytest.mark.parametrize("level", [0.25, 0.8])
def test_a_recording_says_what_its_finger_gets(
    coarse_board: Board, coarse_table: tuple[Table, TableReport], level: float
) -> None:
    """By duties, Ohm's law, and the field of each coil's newton. A share of the limit is another
    number: `prototype` may go on at a duty that is a half of what level 1 asks for.
    """
    place = (10.0, 25.0)
    events = [TouchEvent(20.0, place)]
    recording, report = run_loop(*(coarse_table[0], coarse_board, events), 220.0, level=level)
    settled = recording.duty[recording.t_s > 0.1]
    settled = settled[: round(16 * recording.carrier_hz / 160.0)]
    wave = np.exp(-2j * np.pi * 160.0 * np.arange(len(settled)) / recording.carrier_hz)
    duties = 2.0 * (settled - settled.mean(axis=0)).T @ wave / len(settled)
    coil, own = coarse_board.known_coil, coarse_board.electronics
    ohms = coil.resistance + own.driver_ohm + 2j * np.pi * 160.0 * coil.inductance
    newtons = duties * own.supply_v / ohms * coil.force_factor
    problem = solved_board(coarse_board).problem(place)
    fields = transfer_fields(coarse_board, model=problem.solved.model, allow_unmet=True).values
    moved = np.tensordot(newtons, fields[:, problem.disc].mean(axis=1), axes=1)
    # The carrier's steps are 1/1024 of a duty.
    assert report.touches[-1].played_um == pytest.approx(1e6 * abs(moved), rel=5e-3)


def test_solve_speaks_of_micrometres_and_volts(chladni: CommandLine) -> None:
    answer = chladni("solve", "prototype", "--target", "10,25", "--json")
    assert answer.code == 0
    assert answer.json.keys() >= FELT
    # 11.5 µm/N at the published 0.133 N less rounding.
    assert answer.json["finger_um"] == pytest.approx(1.53, abs=0.05)
    assert answer.json["full_volts"] == pytest.approx(2.5, rel=0.02)
    assert answer.json["sensation_db"] == pytest.approx(20.0 * np.log10(1.53 / 0.36), abs=0.3)
    load = answer.json["finger_load"]
    # A millimetre of FR4: at most 0.7 dB.
    assert 0.0 < load["level_db"] < 0.7
    assert {"level_db", "ssim", "second_finger_db"} == load.keys()


def test_a_board_without_a_coil_is_told_per_newton(chladni: CommandLine) -> None:
    answer = chladni("solve", NO_COIL, "--target", "10,25", "--json")
    assert answer.code == 0
    assert answer.json["finger_um"] is None
    assert answer.json["full_volts"] is None
    assert answer.json["um_per_newton"] > 0.0
    assert "per newton" in answer.err


def test_a_finger_on_a_screw_is_told_that_nothing_moves(chladni: CommandLine) -> None:
    answer = chladni("solve", "prototype", "--target", "25.75,0", "--json")
    assert answer.code == 0
    assert not answer.json["movable"]
    assert "no drive of these actuators moves" in answer.err
    # The fingertip is wider than the screw, so that it feels the plate around it.
    assert 0.0 <= answer.json["finger_um"] < 0.05


def test_a_good_image_without_a_focus_is_said(chladni: CommandLine) -> None:
    """On `prototype` at (20, 30): SSIM 0.97, the maximum 16 mm from the finger."""
    answer = chladni("solve", "prototype", "--target", "20,30", "--json")
    assert answer.json["ssim"] > 0.9
    assert answer.json["focal_error_mm"] > 12.0
    assert "this is no focus" in answer.json["remark"]
    assert answer.json["remark"] in answer.err
    assert disagreement(0.95, 11.0, -3.0) is None
    assert disagreement(0.89, 30.0, -3.0) is None
    assert "3.0 dB more" in (disagreement(0.95, 13.0, -3.0) or "")


def test_tables_comparisons_and_touches_speak_of_them_too(
    chladni: CommandLine, table_file: Path, tmp_path: Path
) -> None:
    shown = chladni("table", "show", table_file, "--at", "10,25", "--json")
    assert shown.json.keys() >= FELT
    recording = tmp_path / "r.npz"
    played = chladni(
        "emulate", table_file, "--touch", "10,25@20", "--ms", "120", "-o", recording, "--json"
    )
    assert played.json.keys() >= FELT
    assert played.json["finger_um"] == pytest.approx(shown.json["finger_um"], rel=2e-3)
    compared = chladni(
        "compare", "prototype", "--pitch", "60", "--methods", "phasor,nearest", "--json"
    )
    for entry in compared.json["methods"]:
        assert {"finger_um", "full_volts", "sensation_db", "remark"} <= entry.keys()


def thin(prototype: Board, thickness: float) -> Board:
    return dataclasses.replace(
        prototype,
        plate=dataclasses.replace(prototype.plate, thickness=thickness),
        regions=Regions(pitch=24e-3),
        image=Image((91, 185)),
    )


def test_a_table_makes_up_for_the_finger_where_it_matters(
    prototype: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    """On 0.4 mm pressing takes 0.5 dB or more of second finger; on 1 mm it does not."""
    assert not coarse_table[1].fingers.compensated
    assert coarse_table[1].fingers.finger_load["level_db"].p90 < 0.7
    _, report = build_table(thin(prototype, 0.35e-3), allow_unmet=True)
    assert report.fingers.compensated
    assert report.fingers.ssim_pressed.median > 0.9


def test_drives_for_a_pressing_finger_are_better_with_it(prototype: Board) -> None:
    board = dataclasses.replace(thin(prototype, 0.4e-3), finger=FINGERS["firm"])
    gained = []
    for target in ((10.0, 25.0), (0.0, -30.0), (-12.0, 50.0)):
        problem = solved_board(board).problem(target)
        pressed = pressed_problem(problem)
        plain = solve_problem(problem, "phasor", Options("ssim", 1, None))
        aware = solve_problem(pressed, "phasor", Options("ssim", 1, None))
        with_plain = felt(problem, plain.drive).finger_load.ssim + plain.ssim
        assert aware.ssim > with_plain - 1e-4
        gained.append(aware.ssim - with_plain)
    assert max(gained) > 0.002


def test_tables_for_a_pressing_finger_store_other_drives(prototype: Board) -> None:
    board = dataclasses.replace(thin(prototype, 0.4e-3), finger=FINGERS["firm"])
    solved, regions = solved_board(board), stored_regions(board)
    options = Options("ssim", 1, None)
    (plain,), (aware,) = (
        board_drives(solved, regions, (160.0,), options, with_finger=is_pressing)
        for is_pressing in (False, True)
    )
    assert np.abs(plain.synchronised.drives - aware.synchronised.drives).max() > 0.01


def test_a_table_for_focus_is_not_told_that_ssim_is_no_focus(prototype: Board) -> None:
    board = dataclasses.replace(prototype, regions=Regions(pitch=24e-3), image=Image((31, 61)))
    solved, regions = solved_board(board), stored_regions(board)
    (drives,) = board_drives(solved, regions, (160.0,), Options("ssim", 1, None), with_finger=False)
    assert "SSIM alone is no focus" in (survey_of(drives).remark or "")
    assert survey_of(dataclasses.replace(drives, objective="focus")).remark is None


def test_solving_again_finds_the_same_numbers(prototype: Board) -> None:
    """A second target on a kept board: what is static was found once, and stays."""
    first = solve(prototype, (10.0, 25.0))
    problem = solved_board(prototype).problem((10.0, 25.0))
    one, other = felt(problem, first.drive), felt(problem, 3.7j * first.drive)
    assert one.finger_um == pytest.approx(other.finger_um)
    assert one.static_um == pytest.approx(other.static_um)


def test_a_finger_meets_coils_that_act_back(prototype: Board) -> None:
    """Against one system of equations for all coils' forces and the finger's, N + 1 of them."""
    assert prototype.coil is not None
    coil = dataclasses.replace(prototype.coil, force_factor=6.0)
    board = dataclasses.replace(thin(prototype, 0.4e-3), coil=coil)
    solved = solved_board(board)
    assert solved.fields.reaction is not None
    problem = solved.problem((10.0, 25.0))
    drive = np.array([1.0, 0.3j, -0.5, 0.2, 0.1])
    found = with_finger(problem, np.tensordot(drive, problem.transfer, axes=1))

    plain = transfer_fields(board, model=solved.model, allow_unmet=True)
    answer = disc_fields(board, [(10.0, 25.0)], 6e-3, model=solved.model, allow_unmet=True)
    fields = np.concatenate((plain.values, answer.values))
    grid = (plain.x, plain.y)
    at = np.array([actuator.at for actuator in board.actuators])
    rows = [RegularGridInterpolator(grid, own)(at) for own in fields]
    moved = np.concatenate((np.array(rows).T, fields[:, problem.disc].mean(axis=1)[None]))
    omega = 2.0 * np.pi * 160.0
    brake = 1j * omega * coil.force_factor**2 / (coil.resistance + 1j * omega * coil.inductance)
    resists = np.diag([*[brake] * 5, dynamic_stiffness(FINGERS["usual"], 160.0)])
    forces = np.linalg.solve(np.eye(6) + resists @ moved, np.array([*drive, 0.0]))
    expected = np.tensordot(forces, fields, axes=1)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    open_coils = np.tensordot(drive, plain.values, axes=1)
    assert np.abs(found - open_coils).max() > 0.05 * np.abs(expected).max()


def test_a_fingerprint_follows_what_drives_make_up_for(prototype: Board) -> None:
    """A table for another finger, or for coils that act back otherwise, is another table."""
    assert prototype.coil is not None
    stronger = dataclasses.replace(prototype.coil, force_factor=0.9)
    firm = dataclasses.replace(prototype, finger=FINGERS["firm"])
    boards = [prototype, firm, dataclasses.replace(prototype, coil=stronger)]
    assert len({board.fingerprint() for board in boards}) == 3
    louder = dataclasses.replace(prototype.coil, rms_voltage=2.0)
    same = dataclasses.replace(prototype, coil=louder)
    assert same.fingerprint() == prototype.fingerprint()
