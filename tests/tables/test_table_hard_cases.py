"""Boards that tables must hold: without mirrors, thin, tiny, with one coil or sixteen."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.sim.board.board import Board
from chladni.sim.board.parts import Actuator, Regions
from chladni.sim.errors import InputError
from chladni.sim.fields.board_mirrors import board_mirrors
from chladni.tables import build
from chladni.tables.build import build_table, table_of
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import pack, unpack
from chladni.tables.report import TableReport
from chladni.tables.stored_regions import stored_regions
from chladni.tables.table import Section, Table
from conftest import ROOT


def with_actuators(board: Board, places: list[tuple[float, float]], pitch: float) -> Board:
    """The board with coils at other places (m) and other regions."""
    coils = tuple(
        replace(board.actuators[0], name=f"a{k}", at=place) for k, place in enumerate(places)
    )
    electronics = replace(board.electronics, pwm_pins=())
    return replace(board, actuators=coils, regions=Regions(pitch=pitch), electronics=electronics)


def checked(board: Board, **options: Any) -> tuple[Table, TableReport]:
    """A table built, whose limits hold and which the firmware plays as the reference says."""
    table, report = build_table(board, **options)
    assert report.ssim_loss_max <= 0.002
    assert report.between_ssim_loss_max <= 0.002
    assert report.field_error_db_max <= 0.25
    assert report.between_field_error_db_max <= 0.25
    assert report.is_within_limits
    data = pack(table)
    assert len(data) == report.bytes
    reader = FirmwareReader(data, table.actuators)
    rng = np.random.default_rng(0)
    half = table.grid.width_um // 2, table.grid.length_um // 2
    x_um, y_um = (rng.integers(-h, h + 1, 500) for h in half)
    played = reader.integers(table.section().frequency_hz, x_um, y_um)
    assert np.array_equal(played, unpack(data).lookup(table.section(), x_um, y_um))
    return table, report


def test_a_board_without_mirrors_stores_every_region(prototype: Board) -> None:
    moved = Actuator("bottom-left", (-20e-3, -40e-3))
    board = replace(
        prototype, actuators=(*prototype.actuators[:4], moved), regions=Regions(pitch=36e-3)
    )
    table, report = checked(board)
    assert table.symmetry.flags == 0
    assert report.stored_regions == report.regions == table.grid.count


@pytest.mark.parametrize("axis", [0, 1])
def test_a_mirror_in_one_direction_only_is_used(paper: Board, axis: int) -> None:
    places = np.array([[20e-3, 30e-3], [20e-3, -50e-3], [0.0, 10e-3]])
    places = np.concatenate((places, places[:2] * (-1, 1)))
    if axis:
        places = np.concatenate(
            ([[20e-3, 30e-3], [-25e-3, 30e-3], [10e-3, 0.0]], [[20e-3, -30e-3], [-25e-3, -30e-3]])
        )
    board = with_actuators(paper, [(float(x), float(y)) for x, y in places], 36e-3)
    mirrors = board_mirrors(board)
    assert (mirrors.x is None, mirrors.y is None) == (bool(axis), not axis)
    table, report = checked(board)
    assert table.symmetry.flags == 1 << axis
    assert report.stored_regions == report.regions // 2


def test_one_actuator_and_sixteen(paper: Board) -> None:
    one, _ = checked(with_actuators(paper, [(0.0, 0.0)], 30e-3))
    assert one.actuators == 1
    # One coil has one field: its gain is full everywhere, and its phase free.
    assert np.abs(one.drives(one.section())).min() > 0.95 * one.section().full_scale_gain
    rng = np.random.default_rng(3)
    places = [(float(x), float(y)) for x, y in rng.uniform((-0.03, -0.065), (0.03, 0.065), (16, 2))]
    sixteen, _ = checked(with_actuators(paper, places, 60e-3))
    assert sixteen.actuators == 16


def test_a_strip_of_twenty_to_one(paper: Board) -> None:
    coils = tuple(Actuator(f"a{k}", (0.0, y * 1e-3)) for k, y in enumerate((-80, -40, 0, 40, 80)))
    strip = replace(
        paper,
        plate=replace(paper.plate, size=(10e-3, 200e-3)),
        actuators=coils,
        regions=Regions(pitch=10e-3),
    )
    table, _ = checked(strip)
    assert (table.grid.columns, table.grid.rows) == (1, 20)


@pytest.mark.parametrize(("actuators", "bits"), [(5, 16), (16, 8)])
def test_a_board_that_no_slot_holds_is_refused_before_it_is_solved(
    prototype: Board, paper: Board, actuators: int, bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """1 mm without mirrors: 10,584 regions of five gains fit in 16 bits, of sixteen in none."""

    class SolvedError(Exception):
        pass

    def solve(_: Board) -> None:
        raise SolvedError

    monkeypatch.setattr(build, "solved_board", solve)
    places = [(x * 1e-3, y * 1e-3) for x, y in np.linspace((-30, -65), (28, 69), actuators)]
    board = with_actuators(paper, [(x, y + 1e-3 * (x > 0)) for x, y in places], 1e-3)
    with pytest.raises(SolvedError if actuators == 5 else InputError) as caught:
        build_table(board, bits=bits)
    if actuators == 16:
        assert "slot: a larger regions.pitch_mm" in str(caught.value)


def test_tables_of_2_and_1_mm_are_as_large_as_their_regions(prototype: Board, paper: Board) -> None:
    """666 and 2,664 stored regions of 16 bytes, a header of 80 and one of 12 bytes, and a CRC."""
    for board, pitch, count in ((prototype, 2e-3, 666), (paper, 1e-3, 2664)):
        regions = stored_regions(replace(board, regions=Regions(pitch=pitch)))
        assert regions.count == count
        section = Section(
            160.0,
            "ssim",
            10.0,
            np.zeros(count, np.uint8),
            np.zeros((3, 2), np.uint8),
            np.zeros((count, 5, 2), np.int16),
        )
        blank = table_of(board, regions, [section], 12)
        assert len(pack(blank)) == 80 + 12 + 3 + 16 * count + 4


@pytest.mark.soak
def test_tables_of_2_and_1_mm_keep_their_limits(prototype: Board, paper: Board) -> None:
    """Of the fine one a thousand regions are measured."""
    table, coarse = checked(replace(prototype, regions=Regions(pitch=2e-3)), objective="contrast")
    assert coarse.stored_regions == coarse.measured_regions == 666
    assert table.bits == 12
    assert coarse.bytes <= 11_000
    _, fine = checked(replace(paper, regions=Regions(pitch=1e-3)), objective="contrast")
    assert fine.regions == 72 * 147
    assert fine.measured_regions == fine.measured_between == 1000
    assert fine.bytes <= 43_000


def test_two_frequencies_are_two_sections(prototype: Board) -> None:
    board = replace(prototype, regions=Regions(pitch=36e-3))
    table, report = checked(board, frequencies_hz=(160.0, 120.0))
    assert [section.frequency_hz for section in table.sections] == [160.0, 120.0]
    alone = build_table(board)[0]
    assert np.array_equal(alone.section().iq, table.sections[0].iq)
    assert not np.array_equal(table.sections[0].iq, table.sections[1].iq)
    assert [section.frequency_hz for section in report.sections] == [160.0, 120.0]


def test_the_bytes_do_not_depend_on_threads(tmp_path: Path) -> None:
    """One core or many, and either setting of NumPy's own threads, each in a fresh process.

    `jobs` alone is tested beside the builds, in one process.
    """
    found = set()
    for number, (jobs, blas) in enumerate((("1", "1"), ("2", "2"))):
        out = tmp_path / f"{number}.chl"
        code = (
            "from dataclasses import replace\n"
            "from chladni.sim.board.parts import Regions\n"
            "from chladni.sim.board.file import load_board\n"
            "from chladni.drives import solve\n"
            "from chladni.tables import build_table, pack\n"
            "board = replace(load_board('prototype'), regions=Regions(pitch=36e-3))\n"
            f"solve(board, (3.0, 4.0)) if {number} == 1 else None\n"
            f"open({str(out)!r}, 'wb').write(pack(build_table(board, jobs={jobs})[0]))\n"
        )
        environment = {"OPENBLAS_NUM_THREADS": blas, "OMP_NUM_THREADS": blas, "PATH": "/usr/bin"}
        subprocess.run([sys.executable, "-c", code], check=True, env=environment, cwd=ROOT)
        found.add(out.read_bytes())
    assert len(found) == 1
