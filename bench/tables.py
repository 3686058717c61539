"""Tables: bytes and losses by width, what places between regions lose, and what a lookup costs.

    .venv/bin/python bench/tables.py          prints tables, writes docs/images/tables.png

Every table is built from the same drives in integers of 8, 12 and 16 bits, and measured as the
firmware plays it against the unrounded drives, at regions and half-way between them. The paper's
1800 gains of 5 bits a region are marked.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.methods import Options
from chladni.drives.methods.phasor import phasor
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.problem.problem import Problem, SolvedBoard, solved_board
from chladni.drives.problem.threads import in_threads, one_blas_thread
from chladni.host.figures.fields import COLOURS, save
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Regions
from chladni.tables.build import board_drives, losses_of, table_of
from chladni.tables.felt_survey import Fingers, survey_of
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import pack
from chladni.tables.layout import BITS
from chladni.tables.quantisation_loss import LIMITS
from chladni.tables.report import TableReport, report
from chladni.tables.stored_regions import stored_regions
from chladni.tables.table import Table

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))
from instruction_counts import PROCESSORS, count, missing  # noqa: E402

PAPER_BYTES = 406 * 1800 * 5 // 8
BOARDS = ("prototype", "paper")
PITCHES_MM = (5.0, 2.0, 1.0)
PLACES = 60
SEED = 5


@dataclass(frozen=True)
class Built:
    """One table and what it came to."""

    board: Board
    pitch_mm: float
    objective: str
    table: Table
    report: TableReport


def built_tables() -> list[Built]:
    """Both boards, every objective, pitch and width; drives are solved once for all widths."""
    found = []
    for name in BOARDS:
        for pitch_mm in PITCHES_MM:
            board = replace(load_board(name), regions=Regions(pitch=pitch_mm * 1e-3))
            for objective in OBJECTIVES:
                print(f"{name} {pitch_mm:g} mm {objective}", file=sys.stderr)
                started = time.perf_counter()
                frequencies = (board.drive.frequency_hz,)
                with one_blas_thread():
                    regions = stored_regions(board)
                    solved = SolvedBoard.of(board)
                    drives = board_drives(solved, regions, frequencies, Options(objective))
                    felt = Fingers(**vars(survey_of(drives[0])), compensated=False)
                    for bits in BITS:
                        sections = [one.section(bits) for one in drives]
                        table = table_of(board, regions, sections, bits)
                        losses = losses_of(table, drives)
                        seconds = time.perf_counter() - started
                        came_to = report(table, drives, losses, len(pack(table)), seconds, felt)
                        found.append(Built(board, pitch_mm, objective, table, came_to))
    return found


def between(board: Board, table: Table) -> tuple[float, float, float]:
    """SSIM lost at places drawn at random, against the best drive for the very place: quantiles.

    Returns
    -------
    tuple[float, float, float]
        Median, 90th percentile and worst.
    """
    rng = np.random.default_rng(SEED)
    half = np.array(board.plate.size) * 500.0
    places = np.round(rng.uniform(-half, half, (PLACES, 2)), 3)
    x_um, y_um = np.rint(places.T * 1000.0).astype(np.int64)
    frequency = board.drive.frequency_hz
    played = FirmwareReader(pack(table), table.actuators).drives(frequency, x_um, y_um)
    solved = solved_board(board)

    def lost(case: tuple[Problem, NDArray[np.complex128]]) -> float:
        problem, drive = case
        best = phasor(problem, Options()).drive
        full = solved.space.objective(solved.space.levels[-1], problem.image)
        return solved.space.value(full, best) - solved.space.value(full, drive)

    targets = [(float(x), float(y)) for x, y in places]
    found = list(in_threads(lost, zip(solved.problems(targets), played, strict=True)))
    median, ninety, worst = np.percentile(found, [50, 90, 100])
    return float(median), float(ninety), float(worst)


def draw(tables: list[Built]) -> Figure:
    """Bytes against the worst field error and loss of SSIM of every table."""
    figure = Figure(figsize=(11.0, 4.8), layout="constrained")
    for axes, value, limit, label in zip(
        figure.subplots(1, 2),
        (_field_db, _ssim),
        (LIMITS.field_db, LIMITS.ssim),
        ("worst field error, dB", "worst loss of SSIM"),
        strict=True,
    ):
        for bits, colour in zip(BITS, COLOURS, strict=False):
            for name, mark in zip(BOARDS, ("o", "x"), strict=True):
                own = [t for t in tables if t.table.bits == bits and t.board.name == name]
                points = [(t.report.bytes, max(value(t.report), 1e-6)) for t in own]
                axes.loglog(
                    *zip(*points, strict=True),
                    mark,
                    color=colour,
                    markersize=5,
                    linestyle="",
                    label=f"{name}, {bits} bits",
                )
        axes.axhline(limit, color="#999999", linewidth=0.8, linestyle="--")
        axes.axvline(PAPER_BYTES, color="#999999", linewidth=0.8, linestyle=":")
        axes.text(
            PAPER_BYTES,
            0.99,
            " the paper's gains",
            fontsize=8,
            rotation=90,
            va="top",
            transform=axes.get_xaxis_transform(),
        )
        axes.set_xlabel("bytes, headers included")
        axes.set_ylabel(label)
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(),
        loc="outside upper center",
        ncols=6,
        frameon=False,
        fontsize=8,
    )
    return figure


def _ssim(report: TableReport) -> float:
    return max(report.ssim_loss_max, report.between_ssim_loss_max)


def _field_db(report: TableReport) -> float:
    return max(report.field_error_db_max, report.between_field_error_db_max)


def print_tables(tables: list[Built]) -> None:
    """Every table: bytes and losses."""
    print("## Tables: bytes against what they lose\n")
    print("![Worst field error and SSIM loss against bytes](../images/tables.png)\n")
    print(
        f"[Limits](../tables.md#the-width-and-what-it-loses): {LIMITS.ssim:g} of SSIM and "
        f"{LIMITS.field_db:g} dB of field. Seconds are from the board to the measured table of "
        "8 bits, on all cores.\n"
    )
    print(
        "| board | pitch, mm | objective | bits | bytes | SSIM loss | field, dB "
        "| half-way: SSIM, dB | within limits | labels | s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for one in tables:
        report = one.report
        seconds = f"{report.seconds:.1f}" if report.bits == BITS[0] else ""
        print(
            f"| {one.board.name} | {one.pitch_mm:g} | {one.objective} | {report.bits} "
            f"| {report.bytes} | {report.ssim_loss_max:.4f} | {report.field_error_db_max:.3f} "
            f"| {report.between_ssim_loss_max:.4f}, {report.between_field_error_db_max:.3f} "
            f"| {'yes' if report.is_within_limits else 'no'} "
            f"| {report.sections[0].labels} | {seconds} |"
        )
    print(
        "\nSteps between the unit fields of neighbouring regions: each drive turned by itself, "
        "phases chosen over the board, within labels only.\n"
    )
    print(
        "| board | pitch, mm | objective | median before, after, within "
        "| largest | share above 0.3 |\n|---|---|---|---|---|---|"
    )
    for one in tables:
        section = one.report.sections[0]
        if one.report.bits != BITS[0]:
            continue
        steps = (section.steps_before, section.steps_after, section.steps_within)
        cells = [
            ", ".join(f"{getattr(step, key):.2f}" for step in steps)
            for key in ("median", "largest", "share_above")
        ]
        print(f"| {one.board.name} | {one.pitch_mm:g} | {one.objective} | {' | '.join(cells)} |")
    print(
        f"\nSSIM lost at {PLACES} random places against the best drive for the place, in 12 bits.\n"
    )
    print("| board | pitch, mm | median | 90 % | worst |\n|---|---|---|---|---|")
    for one in tables:
        if one.objective == "ssim" and one.report.bits == BITS[1]:
            cells = [f"{value:.4f}" for value in between(one.board, one.table)]
            print(f"| {one.board.name} | {one.pitch_mm:g} | {' | '.join(cells)} |")


def print_counts(tables: list[Built]) -> None:
    """Instructions on both processors."""
    if missing():
        print(f"\nInstructions not counted: {', '.join(missing())} not installed.")
        return
    print("\nInstructions (not cycles: no cache, no pipeline) under QEMU.\n")
    print("| table | bits | processor | loading | per byte | lookup, worst of 4000 | mean |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "t.chl"
        for one in tables:
            if one.board.name != "prototype" or one.objective != "ssim":
                continue
            path.write_bytes(pack(one.table))
            for processor in PROCESSORS:
                found = count(processor, path)
                print(
                    f"| {one.pitch_mm:g} mm | {one.table.bits} | {found.processor} "
                    f"| {found.load} | {found.load / one.report.bytes:.1f} "
                    f"| {found.lookup_most} | {found.lookup_mean:.0f} |"
                )


def main() -> None:
    """Print the tables, write the figure."""
    tables = built_tables()
    print_tables(tables)
    print_counts(tables)
    print()
    save(draw(tables), ROOT / "docs" / "images" / "tables.png")


if __name__ == "__main__":
    main()
