"""Regions, and tables built over them."""

from __future__ import annotations

import dataclasses

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from chladni.sim.board import Board, Regions
from chladni.sim.mirrors import board_mirrors
from chladni.tables.build import TableReport, build_table
from chladni.tables.format import Table, pack
from chladni.tables.regions import RegionGrid, region_grid
from chladni.tables.scene import scene_of
from chladni.tables.solve import solve

GRIDS = st.builds(
    RegionGrid, st.integers(1, 64), st.integers(1, 64), st.integers(1000, 500_000),
    st.integers(1000, 500_000),
)  # fmt: skip


def test_prototype_at_5_mm_has_406_regions(prototype: Board) -> None:
    grid = region_grid(prototype)
    assert (grid.columns, grid.rows, grid.count) == (14, 29, 406)


@given(grid=GRIDS, data=st.data())
def test_a_place_is_in_the_region_around_it(grid: RegionGrid, data: st.DataObject) -> None:
    """Against floor division of exact fractions; off the board the nearest region answers."""
    x = data.draw(st.integers(-600_000, 600_000))
    y = data.draw(st.integers(-600_000, 600_000))
    expected = []
    for place, span, cells in (
        (x, grid.width_um, grid.columns), (y, grid.length_um, grid.rows),
    ):  # fmt: skip
        inside = min(max((2 * place + span) // 2, 0), span - 1)
        expected.append(inside * cells // span)
    assert grid.region_at(x, y) == expected[1] * grid.columns + expected[0]


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
    mirrors = board_mirrors(coarse_board)
    assert mirrors.x == (0, 2, 1, 4, 3)
    assert mirrors.y == (0, 3, 4, 1, 2)
    for region in (1, 6, 9):
        for x, y in ((True, False), (False, True), (True, True)):
            order = np.arange(5)
            order = order[list(mirrors.x)] if x else order
            order = order[list(mirrors.y)] if y else order
            other = table.grid.mirrored(region, x=x, y=y)
            assert np.array_equal(table.iq[other], table.iq[region][order])


def test_a_table_holds_what_the_solver_finds(
    coarse_board: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    table, report = coarse_table
    region = 5
    direct = solve(coarse_board, table.grid.centre_mm(region))
    # The same field up to the common phase: 0.25 dB is 3 % of the largest amplitude.
    scene = scene_of(coarse_board)
    stored = np.abs(np.tensordot(table.drive(region), scene.fields.values, axes=1))
    exact = np.abs(direct.field)
    assert np.abs(stored - exact).max() < 0.03 * exact.max()
    assert report.regions == table.grid.count == 32
    assert report.bytes == len(pack(table)) < 300
    assert report.ssim_loss_p99 <= 0.002
    assert report.ssim_loss_max <= 0.005
    assert 0.0 < report.field_error_db_max <= 0.25
    assert report.ssim_min <= report.ssim_mean <= 1.0


def test_one_process_or_two_give_the_same_bytes(coarse_board: Board) -> None:
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
