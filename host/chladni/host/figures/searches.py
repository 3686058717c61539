"""Figures about the search for drives: an annealing's trace, and maps of methods over a board."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.methods.anneal import read_trace
from chladni.drives.problem.places import RegionGrid
from chladni.drives.scoring.compare import NULLS, Row
from chladni.drives.solve import Solution
from chladni.host.figures.fields import COLOURS, INK, draw_board
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM

FloatArray = NDArray[np.float64]


def trace_figure(trace: Path, solution: Solution) -> Figure:
    """An annealing's SSIM over its steps, like the paper's figure 5C."""
    chain, key = read_trace(trace)
    ssim = np.array(chain.ssim)
    best = np.maximum.accumulate(ssim)
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.plot(ssim, color=COLOURS[0], linewidth=0.7, label="present state")
    axes.plot(best, color=COLOURS[1], linewidth=1.3, label="best so far")
    axes.set_xlabel("step")
    axes.set_ylabel("SSIM")
    axes.set_title(
        f"{key['method']} for ({solution.target_mm[0]:g}, {solution.target_mm[1]:g}) mm: "
        f"{ssim[0]:.3f} → {best[-1]:.4f}",
        fontsize=10,
        color=INK,
    )
    axes.legend(frameon=False, fontsize=9, loc="lower right")
    return figure


MAPS = (
    ("ssim", "SSIM", "viridis", False),
    ("focal_error_mm", "focal error / mm", "magma_r", True),
    ("second_finger_db", "here over elsewhere / dB", "viridis", False),
)
"""Column of a row, title, colours, and whether the scale begins at 0."""


def compare_figure(board: Board, grid: RegionGrid, rows: Sequence[Row]) -> Figure:
    """A map over the board per method and number; every line of maps has one scale."""
    names = [
        pair
        for pair in dict.fromkeys((row.method, row.objective) for row in rows)
        if pair[0] not in NULLS
    ]
    figure = Figure(figsize=(1.5 * len(names) + 1.0, 3.1 * len(MAPS) + 0.4), layout="constrained")
    panels = np.atleast_2d(figure.subplots(len(MAPS), len(names), squeeze=False))
    half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
    for line, (column, title, colours, from_zero) in enumerate(MAPS):
        maps = [_map(rows, pair, column, grid) for pair in names]
        every = np.concatenate([values.ravel() for values in maps])
        low, high = (0.0 if from_zero else float(every.min())), float(every.max())
        for panel, values, (method, objective) in zip(panels[line], maps, names, strict=True):
            drawn = panel.imshow(
                values, origin="lower", extent=(-half_x, half_x, -half_y, half_y), cmap=colours,
                vmin=low, vmax=high, interpolation="nearest",
            )  # fmt: skip
            draw_board(panel, board, small=True)
            panel.set_xlabel("")
            panel.set_xticks([])
            panel.set_yticks([])
            label = method if method != "phasor" else f"phasor\n{objective}"
            median = np.median(values)
            panel.set_title(f"{label}\n{median:.3g}" if line == 0 else f"{median:.3g}",
                            fontsize=8, color=INK)  # fmt: skip
        figure.colorbar(drawn, ax=panels[line].tolist(), label=title, shrink=0.8)
    figure.suptitle("Medians over the board stand above the maps", fontsize=9, color=INK)
    return figure


def _map(rows: Sequence[Row], pair: tuple[str, str], column: str, grid: RegionGrid) -> FloatArray:
    values = [row.numbers[column] for row in rows if (row.method, row.objective) == pair]
    return np.array(values).reshape(grid.rows, grid.columns)
