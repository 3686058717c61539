"""Figures about the search for drives: an annealing's trace, and maps of methods over a board."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.methods.anneal import read_trace
from chladni.drives.problem.region_grid import RegionGrid
from chladni.drives.scoring.compare import NULLS, Row
from chladni.host.figures.fields import (
    COLOURS,
    INK,
    board_inches,
    draw_board,
    explain_marks,
    is_wide,
)
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM

FloatArray = NDArray[np.float64]


def draw_trace(axes: Axes, trace: Path) -> None:
    """An annealing's SSIM over its steps, like the paper's figure 5C."""
    chain, key = read_trace(trace)
    ssim = np.array(chain.ssim)
    best = np.maximum.accumulate(ssim)
    axes.plot(ssim, color=COLOURS[0], linewidth=0.7, label="present state")
    axes.plot(best, color=COLOURS[1], linewidth=1.3, label="best so far")
    axes.set_xlabel("step")
    axes.set_ylabel("SSIM")
    axes.set_title(f"{key['method']}: {ssim[0]:.3f} → {best[-1]:.4f}", fontsize=10, color=INK)
    axes.legend(frameon=False, fontsize=9, loc="lower right")


MAPS = (
    ("ssim", "SSIM", "viridis", False),
    ("focal_error_mm", "distance to the maximum / mm", "magma_r", True),
    ("second_finger_db", "level over any other finger / dB", "viridis", False),
)
"""Number of a row, title with unit, colours, and whether the scale begins at 0."""
LARGEST_INCHES = (2.6, 2.6)
"""Of one map."""


def compare_figure(board: Board, grid: RegionGrid, rows: Sequence[Row]) -> Figure:
    """A map over the board per method and number, and one scale of colours per number.

    Numbers are lines and methods columns; the other way round where the board is wide.
    """
    names = [
        pair
        for pair in dict.fromkeys((row.method, row.objective) for row in rows)
        if pair[0] not in NULLS
    ]
    figure, panels = _grid(board, len(names))
    for line, (column, title, colours, from_zero) in zip(panels, MAPS, strict=True):
        maps = [_map(rows, pair, column, grid) for pair in names]
        every = np.concatenate([values.ravel() for values in maps])
        scale = Normalize(0.0 if from_zero else float(every.min()), float(every.max()))
        for panel, values in zip(line, maps, strict=True):
            _draw_map(panel, board, values, colours, scale)
        mappable = ScalarMappable(scale, colours)
        location = "bottom" if is_wide(board) else "right"
        figure.colorbar(mappable, ax=list(line), label=title, location=location, shrink=0.8)
    for panel, (method, objective) in zip(panels[0], names, strict=True):
        label = method if method != "phasor" else f"phasor\n{objective}"
        if is_wide(board):
            panel.set_ylabel(f"{label}\ny / mm", fontsize=8, color=INK)
        else:
            panel.set_title(f"{label}\n{panel.get_title()}", fontsize=8, color=INK)
    _label_outer(panels, board)
    figure.suptitle("Medians over the board stand above the maps", fontsize=9, color=INK)
    explain_marks(figure, board)
    return figure


def _grid(board: Board, methods: int) -> tuple[Figure, NDArray[np.object_]]:
    """A figure, and its axes by number and method."""
    width, height = board_inches(board, LARGEST_INCHES)
    if is_wide(board):
        size = (len(MAPS) * (width + 0.3) + 0.5, methods * (height + 0.35) + 1.8)
        figure = Figure(figsize=size, layout="constrained")
        return figure, np.asarray(figure.subplots(methods, len(MAPS), squeeze=False)).T
    size = (methods * (width + 0.25) + 1.2, len(MAPS) * (height + 0.35) + 1.2)
    figure = Figure(figsize=size, layout="constrained")
    return figure, np.asarray(figure.subplots(len(MAPS), methods, squeeze=False))


def _label_outer(panels: NDArray[np.object_], board: Board) -> None:
    """Axes in millimetres, with numbers where no other map stands between them and the edge."""
    left, bottom = (panels[0], panels[:, -1]) if is_wide(board) else (panels[:, 0], panels[-1])
    for panel in panels.ravel():
        panel.tick_params(labelleft=panel in left, labelbottom=panel in bottom)
    for panel in bottom:
        panel.set_xlabel("x / mm", fontsize=8)
    if not is_wide(board):
        for panel in left:
            panel.set_ylabel("y / mm", fontsize=8)


def _draw_map(
    panel: Axes, board: Board, values: FloatArray, colours: str, scale: Normalize
) -> None:
    """One number of one method over the board, its median above it."""
    half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
    panel.imshow(
        values,
        origin="lower",
        extent=(-half_x, half_x, -half_y, half_y),
        cmap=colours,
        norm=scale,
        interpolation="nearest",
    )
    draw_board(panel, board, small=True)
    panel.set_xlabel("")
    panel.tick_params(labelsize=6)
    panel.set_title(f"{np.median(values):.3g}", fontsize=8, color=INK)


def _map(rows: Sequence[Row], pair: tuple[str, str], column: str, grid: RegionGrid) -> FloatArray:
    values = [row.numbers[column] for row in rows if (row.method, row.objective) == pair]
    return np.array(values).reshape(grid.rows, grid.columns)
