"""Fewest bits for a board's drives: what is reported is what is lost, and the limits hold."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.sim import metrics
from chladni.sim.board import Board
from chladni.tables.build import TableReport
from chladni.tables.compress import Entry, LossLimits, Packed, compress, least_quadrature
from chladni.tables.format import Table
from chladni.tables.methods import Options
from chladni.tables.packing import FULL_SCALE
from chladni.tables.scene import Problem, scene_of
from chladni.tables.solve import solve_problem

TARGETS = [(10.0, 25.0), (-20.0, 50.0), (30.0, -66.0), (0.0, 0.0), (-33.0, 3.0), (5.0, -40.0)]


@pytest.fixture(scope="module")
def problems(prototype: Board) -> list[Problem]:
    return list(scene_of(prototype).problems(TARGETS))


@pytest.fixture(scope="module")
def entries(problems: list[Problem]) -> list[Entry]:
    solved = [solve_problem(problem, "phasor", Options()).drive for problem in problems]
    drives = [least_quadrature(drive / np.abs(drive).max()) for drive in solved]
    return [Entry(d, p.image.astype(np.float32)) for d, p in zip(drives, problems, strict=True)]


@pytest.fixture(scope="module")
def packed(prototype: Board, entries: list[Entry]) -> Packed:
    return compress(scene_of(prototype), entries)


def decoded(packed: Packed, k: int) -> np.ndarray:
    values = packed.packing.values(packed.codes[k]) / FULL_SCALE
    return np.asarray(values[:, 0] + 1j * values[:, 1])


def test_losses_are_those_of_the_decoded_drives(
    packed: Packed, entries: list[Entry], problems: list[Problem]
) -> None:
    """By scikit-image and the plate's fields, at full scale and with nothing refitted."""
    for k, (entry, problem) in enumerate(zip(entries, problems, strict=True)):
        images = [
            np.abs(np.tensordot(drive, problem.transfer, axes=1))
            for drive in (entry.drive, decoded(packed, k))
        ]
        exact, stored = (metrics.ssim(image, np.abs(problem.wanted)) for image in images)
        assert exact - stored == pytest.approx(packed.ssim_loss[k], abs=2e-6)
        error = np.abs(images[1] - images[0]).max() / images[0].max()
        assert packed.field_error_db[k] == pytest.approx(20.0 * np.log10(1.0 + error), rel=1e-9)


def test_limits_hold_and_fewer_bits_break_them(
    prototype: Board, packed: Packed, entries: list[Entry]
) -> None:
    assert packed.ssim_loss.max() <= 0.005
    assert packed.field_error_db.max() <= 0.25
    assert sum(packed.packing.bits) <= 16
    looser = compress(scene_of(prototype), entries, LossLimits(1.0, 0.02, 0.05))
    tighter = compress(scene_of(prototype), entries, LossLimits(0.02, 1e-4, 2e-4))
    bits = [sum(found.packing.bits) for found in (looser, packed, tighter)]
    assert bits == sorted(set(bits))
    assert tighter.field_error_db.max() <= 0.02


def test_no_gain_is_beyond_the_limit(packed: Packed) -> None:
    """In-phase and quadrature together: a coil gets no more than full scale."""
    values = packed.packing.values(packed.codes).astype(float)
    assert np.hypot(values[..., 0], values[..., 1]).max() <= FULL_SCALE


def test_moving_codes_beats_plain_rounding(packed: Packed, entries: list[Entry]) -> None:
    """Where single codes were moved, they are one or two steps from the nearest, and not more."""
    parts = np.stack([[e.drive.real, e.drive.imag] for e in entries]).transpose(0, 2, 1)
    plain = packed.packing.codes(parts * FULL_SCALE)
    assert np.abs(packed.codes - plain).max() <= 6


def test_the_gauge_makes_the_quadrature_part_least() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        drive = rng.normal(size=5) + 1j * rng.normal(size=5)
        turned = least_quadrature(drive)
        assert np.abs(turned) == pytest.approx(np.abs(drive))
        least = min(
            np.sum((drive * np.exp(1j * phase)).imag ** 2) for phase in np.linspace(0, np.pi, 181)
        )
        assert np.sum(turned.imag**2) <= least + 1e-12
        assert turned.real[np.abs(turned).argmax()] >= 0.0


def test_a_silent_region_stays_silent(prototype: Board, entries: list[Entry]) -> None:
    silent = Entry(np.zeros(5, dtype=np.complex128), entries[0].image)
    found = compress(scene_of(prototype), [*entries, silent])
    assert not found.codes[-1].any()
    assert found.ssim_loss[-1] == 0.0


def test_the_report_is_within_the_default_limits(coarse_table: tuple[Table, TableReport]) -> None:
    table, report = coarse_table
    assert report.ssim_loss_max <= 0.005
    assert report.field_error_db_max <= 0.25
    assert table.folding.flags == 3
