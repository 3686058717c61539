"""Tables of drives that focus: their limit is the second finger, not SSIM."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.drives.methods.base import Options
from chladni.drives.methods.focus import GAP_DB, focus
from chladni.drives.objectives import default_objective
from chladni.drives.problem.pressing import pressed_problem
from chladni.drives.problem.problem import solved_board
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import FINGERS
from chladni.sim.image import metrics
from chladni.tables.build import build_table
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import pack, unpack
from chladni.tables.mirror_symmetry import JOINED
from chladni.tables.quantisation_loss import LIMITS
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from conftest import shipped_board, shipped_table

Place = tuple[float, float]


@pytest.fixture(scope="module")
def strip5() -> Board:
    return shipped_board("strip5")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Table, TableReport]:
    return shipped_table(tmp_path_factory, "strip5")


def second_fingers(board: Board, table: Table, places_mm: list[Place]) -> list[float]:
    """Of what the firmware plays at places on the middle line, from 20 mm on."""
    fields = solved_board(board).fields.values
    discs = metrics.FingertipDiscs(board.x, board.y)
    um = np.round(np.array(places_mm) * 1e3).astype(np.int64)
    drives = FirmwareReader(pack(table), table.actuators).drives(160.0, um[:, 0], um[:, 1])
    return [
        discs.second_finger_db(np.tensordot(drive, fields, axes=1), (x * 1e-3, y * 1e-3), [20e-3])[
            0
        ]
        for drive, (x, y) in zip(drives, places_mm, strict=True)
    ]


def test_a_focus_table_is_held_to_its_second_finger(built: tuple[Table, TableReport]) -> None:
    """Eight bits lose SSIM that another objective would not allow, and nothing that is felt."""
    table, report = built
    assert report.objective == table.sections[0].objective == "focus"
    assert unpack(pack(table)).sections[0].objective == "focus"
    assert report.bits == 8
    assert report.is_within_limits
    own, between = report.second_finger_loss_db_max, report.between_second_finger_loss_db_max
    assert own is not None
    assert between is not None
    assert 0.0 < own < LIMITS.second_finger_db
    assert 0.0 < between < LIMITS.second_finger_db
    assert report.between_ssim_loss_max > LIMITS.ssim
    assert "second finger" in report.lost


def test_what_a_focus_table_plays_focuses_between_regions_too(
    strip5: Board, built: tuple[Table, TableReport]
) -> None:
    """On the strip's middle line, at centres and half-way: as well as drives solved there.

    Interpolation costs some; 10 dB at the next finger is left everywhere but in half a region.
    """
    table, _ = built
    grid = table.grid
    rows = range(2, 2 * grid.rows - 3)
    levels = second_fingers(strip5, table, [(0.0, grid.halfway_mm(0, j)[1]) for j in rows])
    assert np.median(levels) > 14.0
    assert np.mean(np.array(levels) > 8.0) > 0.9


def test_boards_made_to_focus_are_the_ones_whose_file_says_so() -> None:
    names = ("paper", "prototype", "strip5", "pad16", "phone15")
    assert [default_objective(shipped_board(name)) for name in names] == [
        "ssim",
        "ssim",
        "focus",
        "focus",
        "focus",
    ]


def test_every_region_moves_its_own_finger_in_phase_0(
    strip5: Board, built: tuple[Table, TableReport]
) -> None:
    """So all of them may be mixed, across the mirrors too: one label, nothing cut.

    Gains of 8 bits turn a phase by half a step of 127 a coil, 0.5°, and that of their sum by more
    where coils work against each other.
    """
    table, _ = built
    section = table.sections[0]
    assert section.labels.max() == 0
    assert section.crossings.tolist() == [[JOINED, JOINED]]
    fields = solved_board(strip5).fields.values
    for region, drive in enumerate(table.drives(section)):
        x, y = table.grid.centre_mm(region)
        disc = metrics.disc_mask(strip5.x, strip5.y, (x * 1e-3, y * 1e-3), 6e-3)
        assert abs(np.degrees(np.angle(drive @ fields[:, disc].mean(axis=1)))) < 3.0


def test_other_tables_have_no_second_finger_to_lose(strip5: Board) -> None:
    few = replace(strip5, regions=replace(strip5.regions, pitch=12e-3))
    _, report = build_table(few, objective="contrast")
    assert report.objective == "contrast"
    assert report.second_finger_loss_db_max is None
    assert "SSIM" in report.lost


def test_a_pressing_finger_is_made_up_for(strip5: Board) -> None:
    """With the finger's own field in every disc, the drive is certified as without."""
    firm = replace(strip5, finger=FINGERS["firm"])
    problem = pressed_problem(solved_board(firm).problem((0.0, 6.0)))
    found = focus(problem, Options("focus"))
    assert found.details["gap_db"] <= GAP_DB
    assert found.details["margin_db"] >= 2.5 - GAP_DB
