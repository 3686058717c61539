"""Build a table: solve every region on all cores, quantise, and say what the quantising cost."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial as partial_function
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board import Board
from chladni.sim.mirrors import board_mirrors
from chladni.tables.batch import Target, over_targets
from chladni.tables.checkpoint import Checkpoint, Result
from chladni.tables.compress import Entry, Packed, compress, least_quadrature
from chladni.tables.format import Limits, Table, check_fits, pack
from chladni.tables.methods import SEED, Options, Progress
from chladni.tables.methods.phasor import phasor
from chladni.tables.packing import PLAIN, Folding, Packing
from chladni.tables.regions import RegionGrid, region_grid
from chladni.tables.scene import Problem, Scene, scene_of
from chladni.tables.solve import check_request, tie_break

CodeArray = NDArray[np.int64]
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
    folding = Folding(mirrors.x, mirrors.y)
    check_fits(_table(board, grid, folding, PLAIN, None))
    targets = [grid.centre_mm(int(region)) for region in folding.stored(grid)]
    scene = scene_of(board)
    key = {
        "board": f"{board.fingerprint():#018x}", "objective": objective, "seed": seed,
        "version": version("chladni"),
    }  # fmt: skip
    with Checkpoint(partial, key) as checkpoint:
        entries, scores = _solve(
            scene, targets, Options(objective, seed, progress=progress), checkpoint, jobs
        )
        packed = compress(scene, entries, jobs=jobs)
    table = _table(board, grid, folding, packed.packing, packed.codes)
    return table, _report(table, scores, packed, time.perf_counter() - started)


def _solve(
    scene: Scene, targets: Sequence[Target], options: Options, checkpoint: Checkpoint,
    jobs: int | None,
) -> tuple[list[Entry], FloatArray]:  # fmt: skip
    """Every target's drive with its image, and their SSIM."""
    images: dict[Target, NDArray[np.float32]] = {}
    work = partial_function(_solve_region, options=options, images=images)
    results = []
    for result in over_targets(scene, targets, work, jobs=jobs, checkpoint=checkpoint):
        results.append(result)
        if options.progress:
            options.progress(len(results), len(targets))
    # What an earlier run had finished came without its image.
    for problem in scene.problems([target for target in targets if target not in images]):
        images[problem.target_mm] = problem.image.astype(np.float32)
    drives = [np.array([complex(*parts) for parts in result["drive"]]) for result in results]
    entries = [Entry(drive, images[at]) for drive, at in zip(drives, targets, strict=True)]
    return entries, np.array([result["ssim"] for result in results])


def _report(table: Table, scores: FloatArray, packed: Packed, seconds: float) -> TableReport:
    """What a table came to; a stored region counts as often as the board has it."""
    sources = [source for source, _ in table.folding.sources(table.grid, table.actuators)]
    every = np.searchsorted(table.folding.stored(table.grid), sources)
    kept = scores - packed.ssim_loss
    return TableReport(
        regions=table.grid.count,
        bytes=len(pack(table)),
        seconds=seconds,
        ssim_mean=float(kept[every].mean()),
        ssim_min=float(kept.min()),
        ssim_loss_p99=float(np.percentile(packed.ssim_loss[every], 99)),
        ssim_loss_max=float(packed.ssim_loss.max()),
        field_error_db_max=float(packed.field_error_db.max()),
    )


def _table(
    board: Board, grid: RegionGrid, folding: Folding, packing: Packing, codes: CodeArray | None
) -> Table:
    """A table of codes (stored regions, actuators, 2); None is silence."""
    if codes is None:
        codes = np.zeros((folding.stored(grid).size, len(board.actuators), 2), dtype=np.int64)
    return Table(
        board_name=board.name,
        board_fingerprint=board.fingerprint(),
        frequency_hz=board.drive.frequency_hz,
        grid=grid,
        full_scale_gain=board.drive.max_gain,
        limits=_limits(board),
        iq=folding.unfold(grid, packing.values(codes)),
        packing=packing,
        folding=folding,
    )


def _limits(board: Board) -> Limits:
    electronics = board.electronics
    return Limits(
        ramp_us=round(electronics.ramp_ms * 1000.0),
        touch_timeout_us=round(electronics.touch_timeout_ms * 1000.0),
        max_on_us=round(electronics.max_on_s * 1e6),
    )


def _solve_region(
    problem: Problem, options: Options, images: dict[Target, NDArray[np.float32]]
) -> Result:
    """One region's drive in units of the largest gain, and its SSIM; leaves its target image.

    SSIM is the kernel's, which is scikit-image's to 1e-6 and twenty times sooner.
    """
    drive = tie_break(problem, phasor(problem, options).drive)
    largest = np.abs(drive).max()
    drive = least_quadrature(drive / largest) if largest > 0.0 else drive
    space = problem.scene.space
    objective = space.objective(space.levels[-1], problem.image)
    images[problem.target_mm] = problem.image.astype(np.float32)
    return {
        "drive": [[float(c.real), float(c.imag)] for c in drive],
        "ssim": space.value(objective, drive),
    }
