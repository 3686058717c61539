"""Build a table: solve every region on all cores, arrange, compress, and say what that cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial as partial_function
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board import Board
from chladni.sim.errors import InputError
from chladni.sim.mirrors import board_mirrors
from chladni.tables.batch import Target, over_targets
from chladni.tables.branches import Arranged, Steps, arrange
from chladni.tables.checkpoint import Checkpoint, Result
from chladni.tables.coding import FULL_SCALE
from chladni.tables.compress import (
    LIMITS,
    LOUDEST,
    Losses,
    LossLimits,
    compress,
    field_errors_db,
    losses,
)
from chladni.tables.entry import Entry
from chladni.tables.folding import Folding
from chladni.tables.format import check_fits, pack
from chladni.tables.methods import SEED, Options, Progress
from chladni.tables.methods.phasor import phasor
from chladni.tables.played import FirmwareReader
from chladni.tables.regions import RegionGrid, region_grid
from chladni.tables.rivals import smoothest
from chladni.tables.scene import Problem, Scene, scene_of
from chladni.tables.solve import check_request, tie_break
from chladni.tables.table import Limits, Section, Table, quantise
from chladni.tables.threads import one_blas_thread

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

OBJECTIVE = "ssim"
"""What a table's drives are best at unless somebody asks for something else."""
TIGHTEN = 0.85
TIGHTENINGS = 6
"""Where points between regions lose too much, all limits are multiplied by this, so often."""
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
    between_field_error_db_max
        The worst field error half-way between regions, against the unquantised drives interpolated
        in the same way.
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
    check_fits(_table(board, grid, folding, blank))
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
            return _table(board, grid, folding, [work.section(limits) for work in works])

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


@dataclass(frozen=True)
class Work:
    """One frequency's drives, solved and arranged; compressed as often as limits are tried."""

    board: Board
    scene: Scene
    grid: RegionGrid
    folding: Folding
    objective: str
    arranged: Arranged
    entries: list[Entry]
    jobs: int | None

    @classmethod
    def begin(
        cls, board: Board, grid: RegionGrid, folding: Folding, options: Options,
        partial: Path | None, jobs: int | None,
    ) -> Work:  # fmt: skip
        """Solve and arrange."""
        scene = scene_of(board)
        targets = [grid.centre_mm(int(region)) for region in folding.stored(grid)]
        key = {
            "board": f"{board.fingerprint():#018x}", "objective": options.objective,
            "seed": options.seed, "version": version("chladni"),
        }  # fmt: skip
        with Checkpoint(partial, key) as checkpoint:
            solved = _solve(scene, targets, options, checkpoint, jobs)
            columns, _ = folding.shape(grid)
            drives = smoothest(scene, solved, columns, options.objective, jobs=jobs)
        arranged = arrange(scene.space, grid, folding, np.array(drives))
        entries = [
            replace(region, drive=drive)
            for drive, region in zip(arranged.drives, solved, strict=True)
        ]
        return cls(board, scene, grid, folding, options.objective, arranged, entries, jobs)

    def section(self, limits: LossLimits) -> Section:
        """The smallest section within limits, points between regions included."""
        for _ in range(TIGHTENINGS):
            iq = compress(
                self.scene, self.entries, self.arranged, self.grid, self.folding, limits,
                jobs=self.jobs,
            )  # fmt: skip
            section = self.with_drives(iq)
            if self.between_db(section) <= limits.field_db:
                break
            limits = limits.times(TIGHTEN)
        return section

    def with_drives(self, iq: NDArray[np.int16]) -> Section:
        """A section of these regions with given integers."""
        return Section(
            frequency_hz=self.board.drive.frequency_hz,
            objective=self.objective,
            full_scale_gain=self.board.drive.max_gain,
            labels=self.arranged.labels,
            crossings=self.arranged.crossings,
            iq=iq,
        )

    def between_db(self, section: Section) -> float:
        """The worst field error half-way between stored regions and their neighbours."""
        exact = self.with_drives(quantise(self.arranged.drives * (LOUDEST / FULL_SCALE), 1.0))
        x_um, y_um = _between(self.grid, self.folding)
        table = _table(self.board, self.grid, self.folding, [section])
        drives = [FirmwareReader.of(table, one).drives(x_um, y_um) for one in (exact, section)]
        return float(field_errors_db(self.scene, *drives).max(initial=0.0))


def _between(grid: RegionGrid, folding: Folding) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Places half-way from every stored region to the next ones in x, in y and in both, µm."""
    centres = np.array([grid.centre_mm(int(region)) for region in folding.stored(grid)]) * 1000.0
    half = np.array([grid.width_um / grid.columns, grid.length_um / grid.rows]) / 2.0
    places = [centres + half * step for step in ((1, 0), (0, 1), (1, 1))]
    x_um, y_um = np.rint(np.concatenate(places)).astype(np.int32).T
    return np.ascontiguousarray(x_um), np.ascontiguousarray(y_um)


def _solve(
    scene: Scene, targets: Sequence[Target], options: Options, checkpoint: Checkpoint,
    jobs: int | None,
) -> list[Entry]:  # fmt: skip
    """Every target's drive, and what it was meant to do."""
    problems: dict[Target, tuple[NDArray[np.float32], NDArray[np.bool_]]] = {}
    work = partial_function(_solve_region, options=options, problems=problems)
    results = []
    for result in over_targets(scene, targets, work, jobs=jobs, checkpoint=checkpoint):
        results.append(result)
        if options.progress:
            options.progress(len(results), len(targets))
    # What an earlier run had finished came without its image.
    for problem in scene.problems([target for target in targets if target not in problems]):
        problems[problem.target_mm] = _kept(problem)
    return [
        Entry(np.array([complex(*parts) for parts in result["drive"]]), *problems[at],
               result["ssim"])
        for result, at in zip(results, targets, strict=True)
    ]  # fmt: skip


def _kept(problem: Problem) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    return problem.image.astype(np.float32), problem.disc


def _solve_region(
    problem: Problem, options: Options,
    problems: dict[Target, tuple[NDArray[np.float32], NDArray[np.bool_]]],
) -> Result:  # fmt: skip
    """One region's drive in units of the largest gain, and its SSIM; leaves its target image."""
    drive = tie_break(problem, phasor(problem, options).drive)
    largest = np.abs(drive).max()
    drive = drive / largest if largest > 0.0 else drive
    space = problem.scene.space
    ssim = space.objective(space.levels[-1], problem.image)
    problems[problem.target_mm] = _kept(problem)
    return {
        "drive": [[float(c.real), float(c.imag)] for c in drive],
        "ssim": space.value(ssim, drive),
    }


def _blank(board: Board, grid: RegionGrid, folding: Folding, objective: str) -> Section:
    stored = folding.stored(grid).size
    return Section(
        board.drive.frequency_hz, objective, board.drive.max_gain, np.zeros(stored, np.uint8),
        np.zeros((1, 2), np.uint8), np.zeros((stored, len(board.actuators), 2), np.int16),
    )  # fmt: skip


def _table(board: Board, grid: RegionGrid, folding: Folding, sections: Sequence[Section]) -> Table:
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
        folding=folding,
    )


def _report(table: Table, works: Sequence[Work], seconds: float) -> TableReport:
    """What a table came to, decoded by the firmware's code."""
    cells = table.folding.regions(table.grid).stored
    sections = []
    for work, section in zip(works, table.sections, strict=True):
        reader = FirmwareReader.of(table, section)
        decoded = reader.regions()[table.folding.stored(table.grid)]
        found = losses(work.scene, work.entries, decoded)
        alone = replace(table, sections=(section,))
        sections.append(_section_report(section, work, found, cells, len(pack(alone))))

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
        between_field_error_db_max=worst("between_field_error_db_max"),
        sections=sections,
    )


def _section_report(
    section: Section, work: Work, found: Losses, cells: NDArray[np.intp], size: int
) -> SectionReport:
    # A stored region counts as often as the board has it.
    kept = np.array([entry.best for entry in work.entries]) - found.ssim
    return SectionReport(
        frequency_hz=section.frequency_hz,
        objective=section.objective,
        bytes=size,
        labels=len(section.crossings),
        ssim_mean=float(kept[cells].mean()),
        ssim_min=float(kept.min()),
        ssim_loss_p99=float(np.percentile(found.ssim[cells], 99)),
        ssim_loss_max=float(found.ssim.max()),
        field_error_db_max=float(found.field_db.max()),
        level_error_db_max=float(np.abs(found.level_db).max()),
        between_field_error_db_max=work.between_db(section),
        steps_before=work.arranged.before,
        steps_after=work.arranged.after,
        steps_within=work.arranged.within,
    )
