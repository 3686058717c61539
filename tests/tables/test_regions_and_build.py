"""Regions, and tables built over them."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chladni.drives.problem.problem import solved_board
from chladni.drives.problem.region_grid import RegionGrid, region_grid
from chladni.drives.solve import solve
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Regions
from chladni.sim.fields.board_mirrors import board_mirrors
from chladni.tables.build import build_table
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.table import Table

GRIDS = st.builds(
    RegionGrid,
    st.integers(1, 64),
    st.integers(1, 64),
    st.integers(1000, 500_000),
    st.integers(1000, 500_000),
)


def test_prototype_at_5_mm_has_406_regions(prototype: Board) -> None:
    grid = region_grid(prototype)
    assert (grid.columns, grid.rows, grid.count) == (14, 29, 406)


@given(grid=GRIDS, data=st.data())
def test_a_position_is_the_exact_fraction_of_a_cell(grid: RegionGrid, data: st.DataObject) -> None:
    """Against exact fractions; the integers' step is short by up to 1/4000 of the board.

    k is at least 2²³ · 256 / 500000 = 4294, so that rounding it down loses less than 1/4294 of a
    place; and u is rounded down to 1/256 cell.
    """
    x = data.draw(st.integers(-600_000, 600_000))
    y = data.draw(st.integers(-600_000, 600_000))
    found = [int(u) for u in grid.position(np.array(x), np.array(y))]
    for u, place, span, cells in (
        (found[0], x, grid.width_um, grid.columns),
        (found[1], y, grid.length_um, grid.rows),
    ):
        exact = Fraction(min(max((2 * place + span) // 2, 0), span - 1) * cells * 256, span)
        assert exact * (1 - Fraction(1, 4294)) - 1 <= u <= exact
        assert u < cells * 256
    assert grid.region_at(x, y) == (found[1] >> 8) * grid.columns + (found[0] >> 8)


@given(grid=GRIDS, data=st.data())
def test_a_regions_centre_is_in_it(grid: RegionGrid, data: st.DataObject) -> None:
    region = data.draw(st.integers(0, grid.count - 1))
    x, y = grid.centre_mm(region)
    assert grid.region_at(round(x * 1000.0), round(y * 1000.0)) == region


def test_mirrored_regions_hold_permuted_drives(
    coarse_board: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    """Field of the mirrored region = mirrored field, checked through the plate itself."""
    table, _ = coarse_table
    iq = table.region_iq(table.section())
    mirrors = board_mirrors(coarse_board)
    assert mirrors.x == (0, 2, 1, 4, 3)
    assert mirrors.y == (0, 3, 4, 1, 2)
    for region in (1, 6, 9):
        for x, y in ((True, False), (False, True), (True, True)):
            order = np.arange(5)
            order = order[list(mirrors.x)] if x else order
            order = order[list(mirrors.y)] if y else order
            row, column = divmod(region, 4)
            other = (7 - row if y else row) * 4 + (3 - column if x else column)
            mirrored = iq[region][order]
            # A label that is odd across the mirror continues with the other sign.
            assert np.array_equal(iq[other], mirrored) or np.array_equal(iq[other], -mirrored)


def test_a_table_holds_what_the_solver_finds(
    coarse_board: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    table, report = coarse_table
    region = 5
    direct = solve(coarse_board, table.grid.centre_mm(region))
    # The same field up to the common phase: 0.25 dB is 3 % of the largest amplitude.
    solved = solved_board(coarse_board)
    stored = np.abs(
        np.tensordot(table.drives(table.section())[region], solved.fields.values, axes=1)
    )
    exact = np.abs(direct.field)
    assert np.abs(stored - exact).max() < 0.03 * exact.max()
    assert report.regions == table.grid.count == 32
    assert report.bytes == len(pack(table))
    assert report.is_within_limits
    assert report.ssim_loss_max <= 0.002
    assert 0.0 < report.field_error_db_max <= 0.25
    assert report.ssim_min <= report.ssim_mean <= 1.0


def test_one_thread_or_two_give_the_same_bytes(coarse_board: Board) -> None:
    board = dataclasses.replace(coarse_board, regions=Regions(pitch=36e-3))
    first, second = (pack(build_table(board, jobs=jobs)[0]) for jobs in (1, 2))
    assert first == second


def test_a_board_without_mirrors_is_solved_region_by_region(prototype: Board) -> None:
    moved = dataclasses.replace(
        prototype,
        actuators=(
            *prototype.actuators[:4],
            dataclasses.replace(prototype.actuators[4], at=(-20e-3, -40e-3)),
        ),
    )
    assert board_mirrors(moved).x is None
    assert board_mirrors(moved).y is None
