"""Tables: bytes against what they lose, packing by packing.

    .venv/bin/python bench/tables.py          prints tables, writes docs/images/tables.png

Every drive of a quarter of `prototype` (105 regions at 5 mm; the mirrors give the rest), rounded to
each width, plainly and with single codes moved (tables/compress.py). Losses are against the drives
as they were found, through the plate's fields. The paper's 1800 gains of 5 bits and plain 16-bit
numbers for every region are marked.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from chladni.host.figures import COLOURS, save
from chladni.sim.board_file import load_board
from chladni.sim.mirrors import board_mirrors
from chladni.tables.build import build_table
from chladni.tables.compress import Entry, LossLimits, least_quadrature, lose, scales_for
from chladni.tables.format import CRC_BYTES, HEADER_BYTES
from chladni.tables.methods import Options
from chladni.tables.methods.phasor import phasor
from chladni.tables.packing import Folding, Packing
from chladni.tables.regions import region_grid
from chladni.tables.scene import scene_of

ROOT = Path(__file__).resolve().parents[1]
BITS = ((6, 4), (7, 4), (7, 5), (8, 4), (8, 5), (8, 6), (8, 7), (9, 6), (9, 7), (10, 8), (12, 10))
PAPER_BYTES = 406 * 1800 * 5 // 8
NO_LIMITS = LossLimits(field_db=0.0, ssim_p99=1e9, ssim_max=1e9)
"""Under these no code is moved."""


@dataclass(frozen=True)
class Row:
    """One packing of one objective's drives."""

    objective: str
    rounding: str
    bits: tuple[int, int]
    size: int
    ssim_p99: float
    ssim_max: float
    field_db: float


def rows_of(objective: str) -> list[Row]:
    """All packings of one objective."""
    board = load_board("prototype")
    scene, grid, mirrors = scene_of(board), region_grid(board), board_mirrors(board)
    stored = Folding(mirrors.x, mirrors.y).stored(grid)
    entries = []
    for problem in scene.problems([grid.centre_mm(int(region)) for region in stored]):
        drive = phasor(problem, Options(objective)).drive
        entries.append(Entry(least_quadrature(drive), problem.image.astype(np.float32)))
    result = []
    for bits in BITS:
        packing = Packing(bits, scales_for(entries))
        size = HEADER_BYTES + CRC_BYTES + packing.size(len(entries) * len(board.actuators))
        for rounding, limits in (("plain", NO_LIMITS), ("moved", LossLimits())):
            packed = lose(scene, entries, packing, limits)
            result.append(Row(objective, rounding, bits, size,
                              float(np.percentile(packed.ssim_loss, 99)),
                              float(packed.ssim_loss.max()),
                              float(packed.field_error_db.max())))  # fmt: skip
    return result


def draw(rows: list[Row]) -> Figure:
    """Bytes against the worst loss of SSIM."""
    figure = Figure(figsize=(7.5, 4.5), layout="constrained")
    axes = figure.subplots()
    pairs = dict.fromkeys((row.objective, row.rounding) for row in rows)
    for (objective, rounding), colour in zip(pairs, COLOURS, strict=False):
        own = [row for row in rows if (row.objective, row.rounding) == (objective, rounding)]
        axes.loglog([row.size for row in own], [row.ssim_max for row in own], "o", color=colour,
                    label=f"{objective}, {rounding}", markersize=5)  # fmt: skip
    axes.axhline(0.005, color="#999999", linewidth=0.8, linestyle="--")
    axes.axvline(8196, color="#999999", linewidth=0.8, linestyle=":")
    axes.text(8196, axes.get_ylim()[1], " 16 bits, every region", fontsize=8, rotation=90, va="top")
    axes.axvline(PAPER_BYTES, color="#999999", linewidth=0.8, linestyle=":")
    axes.text(PAPER_BYTES, axes.get_ylim()[1], " the paper's 1800 gains", fontsize=8, rotation=90,
              va="top")  # fmt: skip
    axes.set_xlabel("bytes, header included")
    axes.set_ylabel("worst loss of SSIM")
    axes.legend(frameon=False, fontsize=8)
    return figure


def main() -> None:
    """Print the tables, write the figure."""
    rows = rows_of("ssim") + rows_of("balanced")
    print("## Tables: bytes against what they lose, `prototype`, 406 regions\n")
    print("![Worst SSIM loss against bytes](images/tables.png)\n")
    print("Limits of the default: 0.002 of SSIM for 99 %, 0.005 for all, 0.25 dB of field.\n")
    print("| drives | rounding | bits I + Q | bytes | SSIM loss, 99 % | worst | worst field, dB |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        print(f"| {row.objective} | {row.rounding} | {row.bits[0]} + {row.bits[1]} | {row.size} "
              f"| {row.ssim_p99:.4f} | {row.ssim_max:.4f} | {row.field_db:.3f} |")  # fmt: skip
    print("\n| board | objective | default table, bytes | build, s |\n|---|---|---|---|")
    for name in ("prototype", "paper"):
        for objective in ("ssim", "balanced", "contrast"):
            scene_of.cache_clear()
            report = build_table(load_board(name), objective=objective)[1]
            print(f"| {name} | {objective} | {report.bytes} | {report.seconds:.1f} |")
    print()
    save(draw(rows), ROOT / "docs" / "images" / "tables.png")


if __name__ == "__main__":
    main()
