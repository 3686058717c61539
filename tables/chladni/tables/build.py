"""Build a table: places, drives, phases and labels, integers of the width they need, bytes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial as partial_function
from pathlib import Path

import numpy as np

from chladni.drives.methods import SEED, Options, Progress
from chladni.drives.problem.places import RegionGrid, region_grid
from chladni.drives.problem.problem import scene_of
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.solve import check_request
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError
from chladni.sim.fields.board_mirrors import board_mirrors
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import check_fits, pack, table_bytes
from chladni.tables.layout import BITS, LARGEST_FILE, one_of_bits
from chladni.tables.losses import LIMITS, Losses
from chladni.tables.mirror_symmetry import Folding
from chladni.tables.one_frequency import LossesOfTable, OneFrequency
from chladni.tables.phase_synchronisation import Steps
from chladni.tables.table import Limits, Section, Table

OBJECTIVE = "ssim"
"""What a table's drives are best at unless something else is asked for."""


@dataclass(frozen=True)
class SectionReport:
    """What one frequency's section came to.

    Attributes
    ----------
    ssim_mean, ssim_min
        SSIM over the regions that were measured, as the firmware plays them.
    ssim_loss_p99, ssim_loss_max
        SSIM lost there against the unrounded drives: the 99th percentile, and the worst.
    field_error_db_max
        20·log₁₀(1 + max‖Ŵ|−|W‖ / max|W|) of the worst region: what a finger could feel of it.
    between_ssim_loss_p99, between_ssim_loss_max, between_field_error_db_max
        The same half-way between regions, against the unrounded drives interpolated alike.
    steps_before, steps_after, steps_within
        Steps between neighbours before and after phases were chosen, and within labels.
    """

    frequency_hz: float
    objective: str
    labels: int
    ssim_mean: float
    ssim_min: float
    ssim_loss_p99: float
    ssim_loss_max: float
    field_error_db_max: float
    between_ssim_loss_p99: float
    between_ssim_loss_max: float
    between_field_error_db_max: float
    steps_before: Steps
    steps_after: Steps
    steps_within: Steps


@dataclass(frozen=True)
class TableReport:
    """What a table came to: of several sections the mean SSIM and the worst of all else.

    Attributes
    ----------
    bits
        Width of the integers.
    is_within_limits
        Whether no measured point loses more than `LIMITS`.
    measured_regions, measured_between
        Points of every section at which losses were measured.
    sections
        The same per frequency, and more.
    """

    regions: int
    stored_regions: int
    bytes: int
    bits: int
    seconds: float
    is_within_limits: bool
    measured_regions: int
    measured_between: int
    ssim_mean: float
    ssim_min: float
    ssim_loss_p99: float
    ssim_loss_max: float
    field_error_db_max: float
    between_ssim_loss_p99: float
    between_ssim_loss_max: float
    between_field_error_db_max: float
    sections: list[SectionReport]

    @property
    def lost(self) -> str:
        """What was lost at most, beside the limits, in words."""
        ssim = max(self.ssim_loss_max, self.between_ssim_loss_max)
        field_db = max(self.field_error_db_max, self.between_field_error_db_max)
        return (f"{ssim:.4f} of SSIM (limit {LIMITS.ssim:g}) and {field_db:.3f} dB of field "
                f"(limit {LIMITS.field_db:g})")  # fmt: skip


@dataclass(frozen=True)
class SolvedBoard:
    """The drives of every region of a board, at every frequency: tables of any width from here."""

    board: Board
    grid: RegionGrid
    folding: Folding
    frequencies: list[OneFrequency]

    def table(self, bits: int) -> Table:
        """The table of integers of so many bits."""
        sections = [one.section(bits) for one in self.frequencies]
        return _table_of(self.board, self.grid, self.folding, sections, bits)

    def losses(self, table: Table, *, until_beyond: bool = False) -> list[LossesOfTable]:
        """What a table loses as the firmware plays it, per frequency."""
        reader = FirmwareReader(pack(table), table.actuators)
        return [one.losses(reader, until_beyond=until_beyond) for one in self.frequencies]

    def report(self, table: Table, losses: Sequence[LossesOfTable], seconds: float) -> TableReport:
        """What a table came to."""
        cases = zip(self.frequencies, losses, strict=True)
        sections = [_section_report(one, *lost) for one, lost in cases]

        def worst(name: str) -> float:
            return float(max(getattr(section, name) for section in sections))

        return TableReport(
            regions=table.grid.count,
            stored_regions=table.folding.stored(table.grid).size,
            bytes=table_bytes(table),
            bits=table.bits,
            seconds=seconds,
            is_within_limits=_are_within(losses),
            measured_regions=len(self.frequencies[0].at_regions),
            measured_between=len(self.frequencies[0].halfway),
            ssim_mean=float(np.mean([section.ssim_mean for section in sections])),
            ssim_min=min(section.ssim_min for section in sections),
            ssim_loss_p99=worst("ssim_loss_p99"),
            ssim_loss_max=worst("ssim_loss_max"),
            field_error_db_max=worst("field_error_db_max"),
            between_ssim_loss_p99=worst("between_ssim_loss_p99"),
            between_ssim_loss_max=worst("between_ssim_loss_max"),
            between_field_error_db_max=worst("between_field_error_db_max"),
            sections=sections,
        )


def build_table(
    board: Board,
    *,
    objective: str = OBJECTIVE,
    seed: int = SEED,
    frequencies_hz: Sequence[float] = (),
    bits: int | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
    partial: Path | None = None,
) -> tuple[Table, TableReport]:
    """Solve every region of a board and pack the drives.

    Parameters
    ----------
    frequencies_hz
        A section is made for each; by default one for the board's own.
    bits
        Of each integer: 8, 12 or 16. By default the narrowest that keeps to `LIMITS`, and the
        widest that a device's slot holds where none does.
    jobs
        Threads; all cores by default. The bytes do not depend on it.
    progress
        Called as progress(done regions, all regions).
    partial
        File for what is finished; with it, work that was interrupted goes on.

    Raises
    ------
    InputError
        There are no such bits, or a device holds fewer regions, actuators or millimetres.
    """
    started = time.perf_counter()
    if bits is not None and bits not in BITS:
        raise InputError("bits", bits, one_of_bits())
    frequencies = frequencies_hz or (board.drive.frequency_hz,)
    check_request("phasor", objective, seed, None, None)
    widths = _widths_that_fit(board, frequencies, objective, [bits] if bits else BITS)
    with one_blas_thread():
        solved = solve_board(
            board, frequencies, Options(objective, seed, progress=progress), partial=partial,
            jobs=jobs,
        )  # fmt: skip
        for width in widths:
            table = solved.table(width)
            losses = solved.losses(table, until_beyond=width != widths[-1])
            if _are_within(losses):
                break
    return table, solved.report(table, losses, time.perf_counter() - started)


def solve_board(
    board: Board, frequencies_hz: Sequence[float], options: Options, *,
    partial: Path | None = None, jobs: int | None = None,
) -> SolvedBoard:  # fmt: skip
    """Find the drives of every region, one frequency after the other on the same plate.

    A stored region of a mirrored board stands for its images, whose drives follow by exchanging the
    actuators as the mirror does.
    """
    grid, folding, scene = region_grid(board), _folding_of(board), scene_of(board)
    regions, found = folding.stored(grid).size, []
    for number, frequency in enumerate(frequencies_hz):
        own = options
        if options.progress:
            span = number * regions, len(frequencies_hz) * regions
            own = replace(options, progress=partial_function(_tell, options.progress, *span))
        name = partial.with_name(f"{partial.name}-{number}") if partial and number else partial
        one = scene.at_frequency(frequency)
        found.append(OneFrequency.solve(one, grid, folding, own, name, jobs))
    return SolvedBoard(board, grid, folding, found)


def _tell(progress: Progress, before: int, all_regions: int, done: int, _: int) -> None:
    progress(before + done, all_regions)


def _folding_of(board: Board) -> Folding:
    mirrors = board_mirrors(board)
    return Folding(mirrors.x, mirrors.y)


def _widths_that_fit(
    board: Board, frequencies_hz: Sequence[float], objective: str, widths: Sequence[int]
) -> list[int]:
    """Widths of which a table fits into a slot, known before any drive is.

    Raises
    ------
    InputError
        There is none.
    """
    grid, folding = region_grid(board), _folding_of(board)
    stored = folding.stored(grid).size
    blank = [
        Section(
            frequency, objective, board.drive.max_gain, np.zeros(stored, np.uint8),
            np.zeros((1, 2), np.uint8), np.zeros((stored, len(board.actuators), 2), np.int16),
        )
        for frequency in frequencies_hz
    ]  # fmt: skip
    tables = [_table_of(board, grid, folding, blank, width) for width in widths]
    check_fits(tables[0])
    return [table.bits for table in tables if table_bytes(table) <= LARGEST_FILE]


def _are_within(losses: Sequence[LossesOfTable]) -> bool:
    return all(lost.are_within for pair in losses for lost in pair)


def _table_of(
    board: Board, grid: RegionGrid, folding: Folding, sections: Sequence[Section], bits: int
) -> Table:
    electronics = board.electronics
    return Table(
        board_name=board.name,
        board_fingerprint=board.fingerprint(),
        grid=grid,
        limits=Limits(
            ramp_us=round(electronics.ramp_ms * 1000.0),
            touch_timeout_us=round(electronics.touch_timeout_ms * 1000.0),
            max_on_us=round(electronics.max_on_s * 1e6),
        ),
        sections=tuple(sections),
        bits=bits,
        folding=folding,
    )


def _section_report(one: OneFrequency, regions: Losses, between: Losses) -> SectionReport:
    # A stored region counts as often as the board has it.
    often = one.weights
    return SectionReport(
        frequency_hz=one.scene.board.drive.frequency_hz,
        objective=one.objective,
        labels=len(one.arranged.crossings),
        ssim_mean=float(np.average(regions.kept, weights=often)),
        ssim_min=float(regions.kept.min()),
        ssim_loss_p99=float(np.percentile(np.repeat(regions.ssim, often), 99)),
        ssim_loss_max=float(regions.ssim.max()),
        field_error_db_max=float(regions.field_db.max()),
        between_ssim_loss_p99=float(np.percentile(between.ssim, 99)),
        between_ssim_loss_max=float(between.ssim.max()),
        between_field_error_db_max=float(between.field_db.max()),
        steps_before=one.arranged.before,
        steps_after=one.arranged.after,
        steps_within=one.arranged.within,
    )
