"""Tables: bytes against what they lose, and what a lookup costs.

    .venv/bin/python bench/tables.py          prints tables, writes docs/images/tables.png

The drives of a quarter of `prototype` (105 regions at 5 mm; the mirrors give the rest) are stored
in every way there is: rounded and packed as they are, rounded and coded by their differences
(tables/coding.py), and searched for few bits within a limit (tables/compress.py). Losses are
against the unquantised drives, through the plate's fields. The paper's 1800 gains of 5 bits and ten
bytes a region are marked.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.host.figures import COLOURS, save
from chladni.sim.board import Board, Regions
from chladni.sim.board_file import load_board
from chladni.sim.board_mirrors import board_mirrors
from chladni.tables.build import TableReport, build_table
from chladni.tables.coding import FULL_SCALE, BitWriter, write_drives, write_labels
from chladni.tables.compress import LIMITS, LOUDEST, losses
from chladni.tables.folding import Folding
from chladni.tables.format import pack
from chladni.tables.layout import CRC_BYTES, HEADER_BYTES, SECTION_BYTES
from chladni.tables.methods import Options
from chladni.tables.methods.phasor import phasor
from chladni.tables.played import FirmwareReader
from chladni.tables.regions import region_grid
from chladni.tables.scene import scene_of
from chladni.tables.table import Table
from chladni.tables.threads import in_threads
from chladni.tables.work import Work

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))
from instruction_counts import PROCESSORS, count, missing  # noqa: E402

HEADERS = HEADER_BYTES + SECTION_BYTES + CRC_BYTES
PAPER_BYTES = 406 * 1800 * 5 // 8
PLAIN_BYTES = 406 * 10
BITS = (6, 7, 8, 9, 10, 12)
FACTORS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
OBJECTIVES = ("ssim", "balanced", "contrast")
PLACES = 60
SEED = 5


@dataclass(frozen=True)
class Row:
    """One way of storing one objective's drives."""

    objective: str
    way: str
    how: str
    size: int
    ssim_p99: float
    ssim_max: float
    field_db: float


def rows_of(board: Board, objective: str) -> list[Row]:
    """All ways for one objective."""
    grid, mirrors = region_grid(board), board_mirrors(board)
    folding = Folding(mirrors.x, mirrors.y)
    work = Work.begin(board, grid, folding, Options(objective), None, None)
    columns, _ = folding.shape(grid)
    arranged, entries = work.uncoded.arranged, work.uncoded.entries
    exact = np.stack((arranged.drives.real, arranged.drives.imag), axis=-1) * LOUDEST
    rows = []

    def add(way: str, how: str, iq: NDArray[np.int16], size: int) -> None:
        found = losses(work.scene, entries, (iq[..., 0] + 1j * iq[..., 1]) / FULL_SCALE)
        rows.append(Row(objective, way, how, size, float(np.percentile(found.ssim, 99)),
                        float(found.ssim.max()), float(found.field_db.max())))  # fmt: skip

    def coded(iq: NDArray[np.int16], shift: int) -> int:
        writer = BitWriter()
        labels = arranged.labels
        write_labels(writer, labels, columns, len(arranged.crossings))
        write_drives(writer, labels, columns, iq, shift)
        return HEADERS + len(writer.to_bytes())

    for bits in BITS:
        shift = 16 - bits
        most = LOUDEST >> shift << shift
        iq = (np.rint(exact / (1 << shift)).astype(np.int64) << shift).clip(-most, most)
        rounded = iq.astype(np.int16)
        add("rounded", f"{bits} bits", rounded, HEADERS + (iq.size * bits + 7) // 8)
        add("rounded, differences", f"{bits} bits", rounded, coded(rounded, shift))
    for factor in FACTORS:
        section = work.section(LIMITS.times(factor))
        add("searched", f"limits × {factor:g}", section.iq, coded(section.iq, section.start_shift))
    return rows


def between(board: Board, table: Table, objective: str) -> tuple[float, float, float]:
    """SSIM lost at places drawn at random, against the best drive for the very place: quantiles.

    Returns
    -------
    tuple[float, float, float]
        Median, 90th percentile and worst.
    """
    rng = np.random.default_rng(SEED)
    half = np.array(board.plate.size) * 500.0
    places = np.round(rng.uniform(-half, half, (PLACES, 2)), 3)
    x_um, y_um = (np.rint(axis * 1000.0).astype(np.int32) for axis in places.T)
    played = FirmwareReader(pack(table), table.actuators).drives(x_um, y_um)
    scene = scene_of(board)

    def lost(case: tuple[object, NDArray[np.complex128]]) -> float:
        problem, drive = case
        best = phasor(problem, Options(objective)).drive
        full = scene.space.objective(scene.space.levels[-1], problem.image)
        return scene.space.value(full, best) - scene.space.value(full, drive)

    targets = [(float(x), float(y)) for x, y in places]
    found = list(in_threads(lost, zip(scene.problems(targets), played, strict=True)))
    median, ninety, worst = np.percentile(found, [50, 90, 100])
    return float(median), float(ninety), float(worst)


def draw(rows: list[Row]) -> Figure:
    """Bytes against the worst field error and loss of SSIM; the best trade-offs are joined."""
    figure = Figure(figsize=(11.0, 4.8), layout="constrained")
    for axes, value, limit, label in zip(
        figure.subplots(1, 2), ("field_db", "ssim_max"), (LIMITS.field_db, LIMITS.ssim),
        ("worst field error, dB", "worst loss of SSIM"), strict=True,
    ):  # fmt: skip
        for objective, colour in zip(OBJECTIVES, COLOURS, strict=False):
            for way, mark in (("rounded", "x"), ("rounded, differences", "+"), ("searched", "o")):
                own = [row for row in rows if (row.objective, row.way) == (objective, way)]
                points = [(row.size, max(getattr(row, value), 1e-5)) for row in own]
                axes.loglog(*zip(*points, strict=True), mark, color=colour, markersize=5,
                            linestyle="-" if way == "searched" else "", linewidth=1.0,
                            label=f"{objective}, {way}")  # fmt: skip
        axes.axhline(limit, color="#999999", linewidth=0.8, linestyle="--")
        for size, what in (
            (PLAIN_BYTES, " ten bytes a region"),
            (PAPER_BYTES, " the paper's gains"),
        ):
            axes.axvline(size, color="#999999", linewidth=0.8, linestyle=":")
            axes.text(size, 0.99, what, fontsize=8, rotation=90, va="top",
                      transform=axes.get_xaxis_transform())  # fmt: skip
        axes.set_xlabel("bytes, headers included")
        axes.set_ylabel(label)
    figure.axes[0].legend(frameon=False, fontsize=7, loc="lower right")
    return figure


def default_tables() -> list[tuple[str, float, str, Table, TableReport, Board]]:
    """Default tables: both boards as they ship, and `prototype` at 2 mm."""
    found = []
    for name, pitch in (("prototype", 5.0), ("prototype", 2.0), ("paper", 5.0)):
        board = replace(load_board(name), regions=Regions(pitch=pitch * 1e-3))
        for objective in OBJECTIVES:
            scene_of.cache_clear()
            table, report = build_table(board, objective=objective)
            found.append((name, pitch, objective, table, report, board))
    return found


def print_ways(rows: list[Row]) -> None:
    """Every way of storing."""
    print("## Tables: bytes against what they lose, `prototype`, 406 regions\n")
    print("![Worst field error and SSIM loss against bytes](images/tables.png)\n")
    print("Limits of the default: 0.002 of SSIM and 0.25 dB of field, everywhere.\n")
    print("| drives | stored | | bytes | SSIM loss, 99 % | worst | worst field, dB |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        print(f"| {row.objective} | {row.way} | {row.how} | {row.size} | {row.ssim_p99:.4f} "
              f"| {row.ssim_max:.4f} | {row.field_db:.3f} |")  # fmt: skip


def print_tables(tables: list[tuple[str, float, str, Table, TableReport, Board]]) -> None:
    """Default tables, what is lost between regions, and steps."""
    print("\n| board | pitch, mm | objective | bytes | build, s | SSIM loss | field, dB "
          "| half-way: SSIM, dB | level, dB | labels |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|")
    for name, pitch, objective, _, report, _ in tables:
        print(f"| {name} | {pitch:g} | {objective} | {report.bytes} | {report.seconds:.1f} "
              f"| {report.ssim_loss_max:.4f} | {report.field_error_db_max:.3f} "
              f"| {report.between_ssim_loss_max:.4f}, {report.between_field_error_db_max:.3f} "
              f"| {report.level_error_db_max:.2f} "
              f"| {report.sections[0].labels} |")  # fmt: skip
    print("\nSteps between the unit fields of neighbouring regions: every drive turned by itself, "
          "then arranged over the whole board, then within labels only.\n")  # fmt: skip
    print("| board | pitch, mm | objective | median before, after, within "
          "| largest | share above 0.3 |\n|---|---|---|---|---|---|")  # fmt: skip
    for name, pitch, objective, _, report, _ in tables:
        section = report.sections[0]
        steps = (section.steps_before, section.steps_after, section.steps_within)
        cells = [", ".join(f"{getattr(step, key):.2f}" for step in steps)
                 for key in ("median", "largest", "share_above")]  # fmt: skip
        print(f"| {name} | {pitch:g} | {objective} | {' | '.join(cells)} |")
    print(f"\nSSIM lost at {PLACES} places drawn at random, against the best drive for the very "
          "place: what a pitch costs a finger between regions.\n")  # fmt: skip
    print("| board | pitch, mm | median | 90 % | worst |\n|---|---|---|---|---|")
    for name, pitch, objective, table, _, board in tables:
        if objective == "ssim":
            cells = [f"{value:.4f}" for value in between(board, table, objective)]
            print(f"| {name} | {pitch:g} | {' | '.join(cells)} |")


def print_counts(tables: list[tuple[str, float, str, Table, TableReport, Board]]) -> None:
    """Instructions on both processors."""
    if missing():
        print(f"\nInstructions not counted: {', '.join(missing())} not installed.")
        return
    print("\nInstructions (not cycles: no cache, no pipeline) under QEMU; 2 ms at 240 MHz are "
          "480,000 of them.\n")  # fmt: skip
    print("| table | processor | check and decode | lookup, worst of 4000 | mean |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "t.chl"
        for name, pitch, objective, table, _, _ in tables:
            path.write_bytes(pack(table))
            for processor in PROCESSORS if name == "prototype" else ():
                found = count(processor, path)
                print(f"| {name}, {pitch:g} mm, {objective} | {found.processor} | {found.load} "
                      f"| {found.lookup_most} | {found.lookup_mean:.0f} |")  # fmt: skip


def main() -> None:
    """Print the tables, write the figure."""
    board = load_board("prototype")
    rows = [row for objective in OBJECTIVES for row in rows_of(board, objective)]
    print_ways(rows)
    tables = default_tables()
    print_tables(tables)
    print_counts(tables)
    print()
    save(draw(rows), ROOT / "docs" / "images" / "tables.png")


if __name__ == "__main__":
    main()
