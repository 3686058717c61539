"""Labelled: phases over the whole graph, and cuts where fields differ."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.drives.problem.field_space import FieldSpace
from chladni.drives.problem.region_grid import RegionGrid
from chladni.tables.mirror_symmetry import CUT, JOINED, NEGATED, NO_MIRRORS, MirrorSymmetry
from chladni.tables.phase_synchronisation import JOIN, Synchronised, neighbours, synchronise
from chladni.tables.report import TableReport
from chladni.tables.stored_regions import StoredRegions
from chladni.tables.table import Table


def orthonormal_space(size: int) -> FieldSpace:
    """Fields for which drives and unit fields are the same: smooth, orthonormal, 20 × 20 points."""
    rng = np.random.default_rng(5)
    planes = np.linalg.qr(rng.normal(size=(400, size)))[0].T * 20.0
    return FieldSpace(planes.reshape(size, 20, 20).astype(np.complex128))


def smooth_drives(columns: int, rows: int) -> np.ndarray:
    """A drive that turns slowly from one coil to another over the grid, unit length."""
    angle = np.linspace(0.0, min(0.9, 0.1 * columns * rows), columns * rows)
    return np.stack((np.cos(angle), 1j * np.sin(angle), 0.0 * angle), axis=1)


def steps(synchronised: Synchronised, pairs: np.ndarray) -> np.ndarray:
    apart = synchronised.drives[pairs[:, 0]] - synchronised.drives[pairs[:, 1]]
    return np.asarray(np.linalg.norm(apart, axis=1))


@settings(max_examples=20, deadline=None)
@given(columns=st.integers(1, 8), rows=st.integers(1, 8), seed=st.integers(0, 99))
def test_random_common_phases_are_undone(columns: int, rows: int, seed: int) -> None:
    """Neighbours of a smooth table are as near as before, whatever phases they came with."""
    drives = smooth_drives(columns, rows)
    phases = np.exp(2j * np.pi * np.random.default_rng(seed).random(len(drives)))
    grid = RegionGrid(columns, rows, 71500, 146700)
    found = synchronise(
        orthonormal_space(3), StoredRegions(grid, NO_MIRRORS), drives * phases[:, None]
    )
    pairs = neighbours(columns, rows)
    smooth = np.linalg.norm(drives[pairs[:, 0]] - drives[pairs[:, 1]], axis=1)
    assert np.all(steps(found, pairs) <= smooth + 1e-6)
    assert not found.labels.any()


def test_phases_that_circle_a_place_are_cut_not_torn() -> None:
    """A vortex has no smooth gauge: a cut must run from it, and no step within a label is long."""
    columns = rows = 8
    x, y = np.meshgrid(np.arange(8) - 3.5, np.arange(8) - 3.5)
    angle = np.arctan2(y, x).ravel()
    # The overlap of neighbours turns once around the centre: spin-½ states carry such a phase.
    drives = np.stack((np.full(64, np.cos(0.7)), np.sin(0.7) * np.exp(1j * angle)), axis=1)
    tilt = np.sqrt(0.5) * np.ones((64, 1))
    found = synchronise(
        orthonormal_space(3),
        StoredRegions(RegionGrid(8, 8, 71500, 146700), NO_MIRRORS),
        np.concatenate((drives * np.sqrt(0.5), tilt * np.exp(2j * angle[:, None])), axis=1),
    )
    pairs = neighbours(columns, rows)
    inside = found.labels[pairs[:, 0]] == found.labels[pairs[:, 1]]
    assert found.labels.max() >= 1
    assert np.all(steps(found, pairs)[inside] <= JOIN + 1e-9)


def test_fields_that_differ_are_cut_and_those_that_agree_are_not() -> None:
    """Two halves with different optima, one of which jumps back in a corner."""
    columns, rows = 6, 5
    drives = np.zeros((30, 3), dtype=np.complex128)
    second = (np.arange(30) % columns >= 3) ^ (np.arange(30) == 29)
    drives[~second, 0], drives[second, 1] = 1.0, 1.0
    grid = RegionGrid(columns, rows, 71500, 146700)
    found = synchronise(orthonormal_space(3), StoredRegions(grid, NO_MIRRORS), drives)
    pairs = neighbours(columns, rows)
    is_cut = found.labels[pairs[:, 0]] != found.labels[pairs[:, 1]]
    assert np.array_equal(is_cut, second[pairs[:, 0]] != second[pairs[:, 1]])
    assert len(found.crossings) == 3
    assert found.after.largest == pytest.approx(np.sqrt(2.0))
    assert found.within.largest == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("drive", "expected"),
    [((1.0, 1.0), JOINED), ((1.0, -1.0), NEGATED), ((1.0, 0.0), CUT), ((1.0, 0.75), JOINED)],
)
@pytest.mark.parametrize("columns", [4, 5])
def test_mirrors_are_crossed_where_the_image_continues_the_drive(
    drive: tuple[float, float], expected: int, columns: int
) -> None:
    grid = RegionGrid(columns, 3, 71500, 146700)
    regions = StoredRegions(grid, MirrorSymmetry((1, 0)))
    drives = np.tile(np.array(drive, np.complex128), (regions.count, 1))
    found = synchronise(orthonormal_space(2), regions, drives)
    assert found.crossings.tolist() == [[expected, CUT]]


def test_a_silent_region_stands_alone() -> None:
    drives = smooth_drives(4, 4)
    drives[5] = 0.0
    found = synchronise(
        orthonormal_space(3), StoredRegions(RegionGrid(4, 4, 71500, 146700), NO_MIRRORS), drives
    )
    assert np.count_nonzero(found.labels == found.labels[5]) == 1
    assert not found.drives[5].any()
    assert len(found.crossings) == 2


def test_reports_say_what_arranging_gained(coarse_table: tuple[Table, TableReport]) -> None:
    section = coarse_table[1].sections[0]
    assert section.steps_after.median < section.steps_before.median
    assert section.steps_within.largest <= JOIN
    assert section.steps_within.share_above <= section.steps_after.share_above
