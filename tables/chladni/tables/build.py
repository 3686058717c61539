"""Build a table: solve every region on all cores, quantise, and say what the quantising cost."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial as partial_function
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board import Board
from chladni.sim.energy import compose
from chladni.sim.mirrors import BoardMirrors, board_mirrors
from chladni.tables.batch import over_targets
from chladni.tables.checkpoint import Checkpoint, Result
from chladni.tables.format import Limits, Table, check_fits, dequantise, pack, quantise
from chladni.tables.methods import SEED, Options, Progress
from chladni.tables.methods.phasor import phasor
from chladni.tables.regions import RegionGrid, region_grid
from chladni.tables.scene import Problem, scene_of
from chladni.tables.search import as_reals
from chladni.tables.solve import check_request, gauge, tie_break

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

OBJECTIVE = "ssim"
"""What a table's drives are best at unless somebody asks for something else."""


@dataclass(frozen=True)
class TableReport:
    """What a table build came to.

    `ssim_loss_*` is the SSIM lost to quantising; `field_error_db_max` is the worst of
    20 log₁₀(1 + max ||Ŵ| − |W|| / max |W|) over the regions, nothing refitted.
    """

    regions: int
    bytes: int
    seconds: float
    ssim_mean: float
    ssim_min: float
    ssim_loss_p99: float
    ssim_loss_max: float
    field_error_db_max: float


@dataclass(frozen=True)
class _Solved:
    """One region's drive, and its scores before and after quantising."""

    drive: ComplexArray
    ssim: float
    ssim_loss: float
    field_error_db: float

    @classmethod
    def of(cls, result: Result) -> _Solved:
        """From the numbers a worker gave."""
        drive = np.array([complex(*parts) for parts in result["drive"]])
        return cls(drive, result["ssim"], result["ssim_loss"], result["field_error_db"])


def build_table(
    board: Board,
    *,
    objective: str = OBJECTIVE,
    seed: int = SEED,
    jobs: int | None = None,
    progress: Progress | None = None,
    partial: Path | None = None,
) -> tuple[Table, TableReport]:
    """Solve all regions of a board and pack their drives.

    Regions that a mirror of the board maps onto each other are solved once.

    Parameters
    ----------
    board
        The board.
    objective
        What the drives are best at, a key of `OBJECTIVES`.
    seed
        Of the solver; same board, seed and version give the same table.
    jobs
        Threads; all cores by default.
    progress
        Called after each place that is solved.
    partial
        Where finished places are kept until all are; a build that was cut off goes on from it.
    """
    check_request("phasor", objective, seed, None, None)
    started = time.perf_counter()
    grid, mirrors = region_grid(board), board_mirrors(board)
    empty = np.zeros((grid.count, len(board.actuators)), dtype=np.complex128)
    check_fits(_table(board, grid, empty))
    sources = _sources(grid, mirrors, len(board.actuators))
    places = sorted({source for source, _ in sources})
    solved: dict[int, _Solved] = {}
    key = {
        "board": f"{board.fingerprint():#018x}", "objective": objective, "seed": seed,
        "version": version("chladni"),
    }  # fmt: skip
    with Checkpoint(partial, key) as checkpoint:
        results = over_targets(
            scene_of(board),
            [grid.centre_mm(region) for region in places],
            partial_function(_solve_region, options=Options(objective, seed)),
            jobs=jobs,
            checkpoint=checkpoint,
        )
        for number, (region, result) in enumerate(zip(places, results, strict=True), 1):
            solved[region] = _Solved.of(result)
            if progress:
                progress(number, len(places))
    drives = np.stack([solved[source].drive[list(permutation)] for source, permutation in sources])
    table = _table(board, grid, drives)
    every = [solved[source] for source, _ in sources]
    losses = np.array([item.ssim_loss for item in every])
    scores = np.array([item.ssim for item in every])
    report = TableReport(
        regions=grid.count,
        bytes=len(pack(table)),
        seconds=time.perf_counter() - started,
        ssim_mean=float(scores.mean()),
        ssim_min=float(scores.min()),
        ssim_loss_p99=float(np.percentile(losses, 99)),
        ssim_loss_max=float(losses.max()),
        field_error_db_max=max(item.field_error_db for item in every),
    )
    return table, report


def _table(board: Board, grid: RegionGrid, drives: ComplexArray) -> Table:
    return Table(
        board_name=board.name,
        board_fingerprint=board.fingerprint(),
        frequency_hz=board.drive.frequency_hz,
        grid=grid,
        full_scale_gain=board.drive.max_gain,
        limits=_limits(board),
        iq=quantise(drives, board.drive.max_gain),
    )


def _limits(board: Board) -> Limits:
    electronics = board.electronics
    return Limits(
        ramp_us=round(electronics.ramp_ms * 1000.0),
        touch_timeout_us=round(electronics.touch_timeout_ms * 1000.0),
        max_on_us=round(electronics.max_on_s * 1e6),
    )


def _sources(
    grid: RegionGrid, mirrors: BoardMirrors, actuators: int
) -> list[tuple[int, tuple[int, ...]]]:
    """For every region, the region whose solution it takes and the actuators' permutation."""
    sources: list[tuple[int, tuple[int, ...]]] = []
    for region in range(grid.count):
        column, row = region % grid.columns, region // grid.columns
        flip_x = mirrors.x is not None and 2 * column >= grid.columns
        flip_y = mirrors.y is not None and 2 * row >= grid.rows
        order = np.arange(actuators)
        if flip_x:
            order = order[list(mirrors.x or ())]
        if flip_y:
            order = order[list(mirrors.y or ())]
        sources.append((grid.mirrored(region, x=flip_x, y=flip_y), tuple(order.tolist())))
    return sources


def _solve_region(problem: Problem, options: Options) -> Result:
    """One region's drive, and what storing it costs.

    SSIM is the kernel's, which is scikit-image's to 1e-6 and twenty times sooner.
    """
    drive = gauge(problem, tie_break(problem, phasor(problem, options).drive))
    gain, space = problem.board.drive.max_gain, problem.scene.space
    stored = dequantise(quantise(drive, gain), gain)
    objective = space.objective(space.levels[-1], problem.image)
    best, kept = (objective.value(as_reals(space.coordinates(c))) for c in (drive, stored))
    exact, decoded = (compose(problem.transfer, c) for c in (drive, stored))
    return {
        "drive": [[float(c.real), float(c.imag)] for c in drive],
        "ssim": kept,
        "ssim_loss": best - kept,
        "field_error_db": field_error_db(decoded, exact),
    }


def field_error_db(decoded: ComplexArray, exact: ComplexArray) -> float:
    """20 log₁₀(1 + max ||Ŵ| − |W|| / max |W|); 0 when nothing moves."""
    largest = float(np.abs(exact).max())
    if largest == 0.0:
        return 0.0
    error = float(np.abs(np.abs(decoded) - np.abs(exact)).max())
    return float(20.0 * np.log10(1.0 + error / largest))
