"""Between regions: where drives are mixed, what is wanted there, and what tables lose."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from chladni.sim.board import Board, Regions
from chladni.sim.board_mirrors import board_mirrors
from chladni.tables.branches import Arranged, Steps
from chladni.tables.build import TableReport, build_table
from chladni.tables.coding import FULL_SCALE, visits
from chladni.tables.compress import LossLimits
from chladni.tables.entry import FINE_STEP, Entry, Wanted
from chladni.tables.folding import UNFOLDED, Folding
from chladni.tables.format import pack
from chladni.tables.halfway import Halfway, own_places
from chladni.tables.lookup import lookup
from chladni.tables.meetings import Coded, Meeting, Uncoded
from chladni.tables.played import FirmwareReader
from chladni.tables.regions import region_grid
from chladni.tables.scene import scene_of
from chladni.tables.table import Table
from made_up import random_table

Drive = np.ndarray
NEXT_TO_NOTHING = LossLimits(field_db=0.002, ssim=2e-5)


class Places:
    """Stands in for `Halfway`, to be told which place a meeting is at."""

    def objectives(self, half_column: int, half_row: int) -> tuple[int, int]:
        return half_column, half_row


def coded_of(table: Table, drives: Drive) -> Coded:
    section = table.section()
    steps = Steps(0.0, 0.0, 0.0)
    arranged = Arranged(drives, section.labels, section.crossings, steps, steps, steps)
    nothing = Wanted(np.zeros((1, 1), np.float32), np.zeros((1, 1), bool), ())  # type: ignore[arg-type]
    entries = [Entry(drive, nothing, 0.0) for drive in drives]
    halfway: Halfway = Places()  # type: ignore[assignment]
    return Coded(Uncoded(table.grid, table.folding, entries, arranged, halfway))


def mixed(meeting: Meeting, drive: Drive) -> Drive:
    return np.asarray(meeting.share * (drive @ meeting.mix + meeting.decoded))


@pytest.mark.parametrize(
    ("folding", "columns", "rows"),
    [
        (UNFOLDED, 7, 9),
        (Folding((0, 2, 1, 4, 3), None), 8, 7),
        (Folding((0, 2, 1, 4, 3), (0, 3, 4, 1, 2)), 8, 10),
        (Folding((0, 2, 1, 4, 3), (0, 3, 4, 1, 2)), 7, 9),
    ],
)
def test_meetings_mix_as_the_device_does(folding: Folding, columns: int, rows: int) -> None:
    """At every half-way point, edge and cut, against the reference of the lookup.

    Two hundredths of a region beside the point, weights are off by so much and drives, which differ
    by up to twice the full scale, by 0.07; a wrong corner, sign or channel is off by far more.
    """
    table = random_table(columns, rows, 5, 0, labels=3, coarse=9, folding=folding)
    section, grid = table.section(), table.grid
    drives = (section.iq[..., 0] + 1j * section.iq[..., 1]) / FULL_SCALE
    coded = coded_of(table, drives)
    stored_columns, _ = folding.shape(grid)
    pitch = np.array(grid.pitch_mm) * 1000.0
    seen = 0
    for at, drive in enumerate(drives):
        row, column = divmod(at, stored_columns)
        centre = np.array(grid.halfway_mm(2 * column, 2 * row)) * 1000.0
        for meeting in coded.meetings(at):
            place = np.array(grid.halfway_mm(*meeting.ssim)) * 1000.0  # type: ignore[arg-type]
            # A little on the region's own side, where its label is what is played; on its middle
            # lines a cut may have two faces, and the meeting is on one of them.
            sides = [[side] if side else [-1.0, 1.0] for side in np.sign(centre - place)]
            errors = []
            for side in product(*sides):
                x_um, y_um = np.rint(place + np.array(side) * pitch / 120.0).astype(int)
                played = lookup(table, section, np.array([x_um]), np.array([y_um]))[0] / FULL_SCALE
                errors.append(np.abs(played @ (1.0, 1j) - mixed(meeting, drive)).max())
            assert min(errors) < 0.07
            seen += 1
    # Eight around every region, less the points beyond a mirror that are others' images.
    assert seen >= 5 * len(drives)


def test_what_is_stored_already_is_mixed_as_stored() -> None:
    table = random_table(5, 5, 2, 0, labels=1, coarse=9, folding=UNFOLDED)
    drives = np.full((25, 2), 0.5 + 0.25j)
    coded = coded_of(table, drives)
    (visit,) = (visit for visit in visits(5, 5) if visit.at == 7)
    coded.put(visit, np.array([8192, 0, 0, -8192]))
    beside = [m for m in coded.meetings(6) if m.ssim == (3, 2)]  # type: ignore[comparison-overlap]
    (meeting,) = beside
    assert meeting.exact == pytest.approx(drives[7])
    assert meeting.decoded * FULL_SCALE == pytest.approx([8192.0, -8192.0j])


@pytest.mark.parametrize("pitch_mm", [7.5, 8.0])
def test_what_is_interpolated_stands_for_the_points_own(prototype: Board, pitch_mm: float) -> None:
    """A quarter of the points of about the widest regions that are interpolated.

    Cubic interpolation over 7 mm leaves 0.0015 of the field in the median and 0.065 at most, beside
    a screw; linear would leave 0.005 and 0.29, and weights for another place 0.015 and 0.48. SSIM
    of some drive is within 0.01, so that a loss, the difference of two such values, is far better.
    """
    board = replace(prototype, regions=Regions(pitch=pitch_mm * 1e-3))
    grid, mirrors = region_grid(board), board_mirrors(board)
    folding = Folding(mirrors.x, mirrors.y)
    scene = scene_of(board)
    targets = [grid.centre_mm(int(region)) for region in folding.stored(grid)]
    entries = [
        Entry(np.zeros(5, np.complex128), Wanted.of(p), 0.0) for p in scene.problems(targets)
    ]
    places = own_places(board, grid, folding)
    problems = scene.problems(list(places.values()))
    wanted = {place: Wanted.of(p) for place, p in zip(places, problems, strict=True)}
    halfway = Halfway(scene, entries, wanted, grid, folding)
    columns, rows = folding.shape(grid)
    points = [(i, j) for i in range(-1, 2 * columns) for j in range(-1, 2 * rows)][::4]
    half = np.array([grid.width_um, grid.length_um]) / 2000.0
    targets = [tuple(np.clip(grid.halfway_mm(*p), -half, half).tolist()) for p in points]
    drive = np.array([1.0, 0.4j, -0.3, 0.2, 0.5 - 0.1j])
    space, level = scene.space, scene.space.nearest_level(FINE_STEP)
    of_field, of_ssim = [], []
    for point, problem in zip(points, scene.problems(targets), strict=True):
        for own, used in zip(Wanted.of(problem).fields, halfway._fields(point), strict=True):
            of_field.append(np.linalg.norm(used - own) / np.linalg.norm(own))
        best = space.value(space.objective_of(level, level.sample(problem.image)), drive)
        of_ssim.append(space.value(halfway.objectives(*point)[1], drive) - best)
    assert np.median(of_field) < 0.003
    assert np.max(of_field) < 0.15
    assert np.median(np.abs(of_ssim)) < 0.001
    assert np.abs(of_ssim).max() < 0.01


def test_points_between_keep_to_the_limits(
    coarse_board: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    """By images solved for the very points, on all image points, as the firmware plays them."""
    table, report = coarse_table
    assert report.between_ssim_loss_p99 <= 0.002
    assert report.between_ssim_loss_max <= 0.005
    exact, _ = build_table(coarse_board, limits=NEXT_TO_NOTHING)
    scene, grid = scene_of(coarse_board), table.grid
    columns, rows = table.folding.shape(grid)
    points = [(i, j) for i in range(2 * columns) for j in range(2 * rows) if i % 2 or j % 2]
    um = np.rint(np.array([grid.halfway_mm(*p) for p in points]) * 1000.0).astype(np.int32)
    x_um, y_um = (np.ascontiguousarray(line) for line in um.T)
    best, got = (FirmwareReader(pack(t), 5).drives(x_um, y_um) for t in (exact, table))
    problems = scene.problems([(x / 1000.0, y / 1000.0) for x, y in um.tolist()])
    lost = []
    for one, other, problem in zip(best, got, problems, strict=True):
        objective = scene.space.objective(scene.space.levels[-1], problem.image)
        lost.append(scene.space.value(objective, one) - scene.space.value(objective, other))
    assert np.mean(np.array(lost) <= 0.002) >= 0.99
    assert np.max(lost) <= 0.005
