"""Build a table: solve every region on all cores, arrange, compress, and say what that cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial as partial_function
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board import Board
from chladni.sim.board_mirrors import board_mirrors
from chladni.sim.errors import InputError
from chladni.tables.branches import Steps
from chladni.tables.compress import (
    LIMITS,
    Losses,
    LossLimits,
    losses,
)
from chladni.tables.folding import Folding
from chladni.tables.format import check_fits, pack
from chladni.tables.methods import SEED, Options, Progress
from chladni.tables.played import FirmwareReader
from chladni.tables.regions import RegionGrid, region_grid
from chladni.tables.solve import check_request
from chladni.tables.table import Section, Table
from chladni.tables.threads import one_blas_thread
from chladni.tables.work import Work, table_of

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

OBJECTIVE = "ssim"
"""What a table's drives are best at unless somebody asks for something else."""
BUDGET_RANGE, BUDGET_STRIDE, BUDGET_HALVINGS = (-8, 8), 2, 4
"""Powers of two by which limits are scaled to meet a budget, and how they are searched."""


@dataclass(frozen=True)
class SectionReport:
    """What one section came to; see `TableReport` for the losses."""

    frequency_hz: float
    objective: str
    bytes: int
    labels: int
    ssim_mean: float
    ssim_min: float
    ssim_loss_p99: float
    ssim_loss_max: float
    field_error_db_max: float
    level_error_db_max: float
    between_ssim_loss_p99: float
    between_ssim_loss_max: float
    between_field_error_db_max: float
    steps_before: Steps
    steps_after: Steps
    steps_within: Steps


@dataclass(frozen=True)
class TableReport:
    """What a table came to.

    Attributes
    ----------
    ssim_mean, ssim_min
        SSIM of the table's entries over all regions, as the firmware decodes them.
    ssim_loss_p99, ssim_loss_max
        SSIM that the entries lose against the unquantised best drives; the 99th percentile over
        all regions, and the worst.
    field_error_db_max
        20·log₁₀(1 + max‖Ŵ|−|W‖ / max|W|) of the worst region: what a finger could feel of it.
    level_error_db_max
        Largest change of the level in a target's disc.
    between_ssim_loss_p99, between_ssim_loss_max, between_field_error_db_max
        Losses of SSIM and the worst field error half-way between regions, against the unquantised
        drives interpolated in the same way.
    sections
        The same per frequency; above stands the worst of them.
    """

    regions: int
    stored_regions: int
    bytes: int
    seconds: float
    ssim_mean: float
    ssim_min: float
    ssim_loss_p99: float
    ssim_loss_max: float
    field_error_db_max: float
    level_error_db_max: float
    between_ssim_loss_p99: float
    between_ssim_loss_max: float
    between_field_error_db_max: float
    sections: list[SectionReport]


def build_table(
    board: Board,
    *,
    objective: str = OBJECTIVE,
    seed: int = SEED,
    frequencies_hz: Sequence[float] = (),
    limits: LossLimits = LIMITS,
    budget_bytes: int | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
    partial: Path | None = None,
) -> tuple[Table, TableReport]:
    """Solve every region of a board and compress the drives.

    Parameters
    ----------
    frequencies_hz
        A section is made for each; by default one for the board's own.
    limits
        What may be lost; the table is the smallest found within.
    budget_bytes
        Instead: the best table of at most so many bytes.
    jobs
        Threads; all cores by default. The bytes do not depend on it.
    progress
        Called as progress(done regions, all regions).
    partial
        File for what is finished; with it, work that was interrupted goes on.

    Raises
    ------
    InputError
        The board has more regions, actuators or millimetres than a table holds, or no table is as
        small as the budget.

    Notes
    -----
    A stored region of a mirrored board stands for its images, whose drives follow by exchanging the
    actuators as the mirror does.
    """
    started = time.perf_counter()
    check_request("phasor", objective, seed, None, None)
    boards = [
        at_frequency(board, frequency)
        for frequency in frequencies_hz or (board.drive.frequency_hz,)
    ]
    grid, mirrors = region_grid(board), board_mirrors(board)
    folding = Folding(mirrors.x, mirrors.y)
    blank = [_blank(one, grid, folding, objective) for one in boards]
    check_fits(table_of(board, grid, folding, blank))
    all_regions = len(boards) * folding.stored(grid).size
    works = []
    with one_blas_thread():
        for number, one in enumerate(boards):
            before = number * (all_regions // len(boards))
            told = partial_function(_tell, progress, before, all_regions) if progress else None
            options = Options(objective, seed, progress=told)
            name = partial.with_name(f"{partial.name}-{number}") if partial and number else partial
            works.append(Work.begin(one, grid, folding, options, name, jobs))

        def table_within(limits: LossLimits) -> Table:
            return table_of(board, grid, folding, [work.section(limits) for work in works])

        if budget_bytes is None:
            table = table_within(limits)
        else:
            table = _within_budget(table_within, limits, budget_bytes)
        return table, _report(table, works, time.perf_counter() - started)


def at_frequency(board: Board, frequency_hz: float) -> Board:
    """The board driven at another frequency."""
    if frequency_hz == board.drive.frequency_hz:
        return board
    return replace(board, drive=replace(board.drive, frequency_hz=frequency_hz))


def _tell(progress: Progress, before: int, all_regions: int, done: int, _: int) -> None:
    progress(before + done, all_regions)


def _within_budget(
    table_within: Callable[[LossLimits], Table], limits: LossLimits, budget_bytes: int
) -> Table:
    """The table of least losses that is no larger: limits are scaled until it just fits."""
    exponent, fitting, too_large = 0, {}, {}
    while BUDGET_RANGE[0] <= exponent <= BUDGET_RANGE[1]:
        table = table_within(limits.times(2.0**exponent))
        if len(pack(table)) <= budget_bytes:
            fitting[float(exponent)] = table
            exponent -= BUDGET_STRIDE
        else:
            too_large[float(exponent)] = len(pack(table))
            exponent += BUDGET_STRIDE
        if fitting and too_large:
            break
    if not fitting:
        expected = f"{min(too_large.values())} or more for this board"
        raise InputError("budget_bytes", budget_bytes, expected)
    low, high = max(too_large, default=min(fitting)), min(fitting)
    for _ in range(BUDGET_HALVINGS if too_large else 0):
        middle = (low + high) / 2.0
        table = table_within(limits.times(2.0**middle))
        if len(pack(table)) <= budget_bytes:
            fitting[middle] = table
            high = middle
        else:
            low = middle
    return fitting[high]


def _blank(board: Board, grid: RegionGrid, folding: Folding, objective: str) -> Section:
    stored = folding.stored(grid).size
    return Section(
        board.drive.frequency_hz, objective, board.drive.max_gain, np.zeros(stored, np.uint8),
        np.zeros((1, 2), np.uint8), np.zeros((stored, len(board.actuators), 2), np.int16),
    )  # fmt: skip


def _report(table: Table, works: Sequence[Work], seconds: float) -> TableReport:
    """What a table came to, decoded by the firmware's code."""
    cells = table.folding.regions(table.grid).stored
    sections = []
    for work, section in zip(works, table.sections, strict=True):
        reader = work.reader(section)
        decoded = reader.regions()[table.folding.stored(table.grid)]
        found = losses(work.scene, work.uncoded.entries, decoded)
        sections.append(_section_report(section, work, reader, found, cells))

    def worst(name: str) -> float:
        return float(max(getattr(section, name) for section in sections))

    return TableReport(
        regions=table.grid.count,
        stored_regions=table.folding.stored(table.grid).size,
        bytes=len(pack(table)),
        seconds=seconds,
        ssim_mean=float(np.mean([section.ssim_mean for section in sections])),
        ssim_min=min(section.ssim_min for section in sections),
        ssim_loss_p99=worst("ssim_loss_p99"),
        ssim_loss_max=worst("ssim_loss_max"),
        field_error_db_max=worst("field_error_db_max"),
        level_error_db_max=worst("level_error_db_max"),
        between_ssim_loss_p99=worst("between_ssim_loss_p99"),
        between_ssim_loss_max=worst("between_ssim_loss_max"),
        between_field_error_db_max=worst("between_field_error_db_max"),
        sections=sections,
    )


def _section_report(
    section: Section, work: Work, reader: FirmwareReader, found: Losses, cells: NDArray[np.intp]
) -> SectionReport:
    # A stored region counts as often as the board has it.
    kept = np.array([entry.best for entry in work.uncoded.entries]) - found.ssim
    between_ssim = work.between_ssim(reader)
    return SectionReport(
        frequency_hz=section.frequency_hz,
        objective=section.objective,
        bytes=reader.bytes,
        labels=len(section.crossings),
        ssim_mean=float(kept[cells].mean()),
        ssim_min=float(kept.min()),
        ssim_loss_p99=float(np.percentile(found.ssim[cells], 99)),
        ssim_loss_max=float(found.ssim.max()),
        field_error_db_max=float(found.field_db.max()),
        level_error_db_max=float(np.abs(found.level_db).max()),
        between_ssim_loss_p99=float(np.percentile(between_ssim, 99)),
        between_ssim_loss_max=float(between_ssim.max()),
        between_field_error_db_max=work.between_db(reader),
        steps_before=work.uncoded.arranged.before,
        steps_after=work.uncoded.arranged.after,
        steps_within=work.uncoded.arranged.within,
    )
