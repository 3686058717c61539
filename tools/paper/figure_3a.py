"""Figure 3A: the pattern of one actuator, on both boards, and by the formula as printed.

    w = Σ φₘₙ Ωₘₙ/(ω²ₘₙ − ω²),  φₘₙ = 2/√(abρh) sin(mπx/a) sin(nπy/b)

Printed: Ωₘₙ = ∫∫ φₘₙ dx dy. Right for a point force: Ωₘₙ = φₘₙ(x₀, y₀).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.problem.problem import solved_board
from chladni.host.figures.fields import (
    INK,
    at_largest_swing,
    draw_board,
    draw_displacement,
    save,
)
from chladni.sim.board.board import Board
from chladni.sim.fields.transfer import target_field
from chladni.sim.image import metrics
from paper import boards
from paper.numbers import Numbers, fixed

FloatArray = NDArray[np.float64]

TARGET_MM = (10.0, 25.0)
MICRO = 1e6
ORDER = 60
"""Half waves each way; what is left out is 1.3e-5 of a corner coil's field, relative, L²."""


def numbers() -> Numbers:
    """Wavelengths, first modes, deflections, and how unlike the printed formula is."""
    found: Numbers = {}
    for name, board in (("written", boards.written()), ("computed", boards.computed())):
        solved = solved_board(board)
        frequency = board.drive.frequency_hz
        first = solved.model.modes(1, [], board.x, board.y).frequencies_hz[0]
        pattern = np.abs(solved.fields.values[boards.MIDDLE])
        found |= {
            f"{name}_wave_mm": fixed(1e3 * board.wavelength(frequency)),
            f"{name}_mode_hz": fixed(first),
            f"{name}_um_per_n": fixed(MICRO * pattern.max(), 1),
        }
    board = boards.written()
    wrong = printed(board)
    right = np.abs(target_field(board, TARGET_MM).values[0])
    return found | {"printed_ssim": fixed(metrics.ssim(np.abs(wrong), right), 3)}


def draw(folder: Path) -> None:
    """Displacement at its largest swing: the middle coil twice, a corner, and the misprint."""
    written, computed = boards.written(), boards.computed()
    right, fr4 = (solved_board(board).fields.values for board in (written, computed))
    wrong = printed(written)
    panels: list[tuple[str, Board, FloatArray, str]] = [
        ("prototype: middle coil", computed, at_largest_swing(fr4[boards.MIDDLE]), "µm/N"),
        ("paper: middle coil", written, at_largest_swing(right[boards.MIDDLE]), "µm/N"),
        ("paper: a corner coil", written, at_largest_swing(right[boards.CORNER]), "µm/N"),
        ("paper, formula as printed:\nany coil", written, wrong / np.abs(wrong).max() / MICRO,
         "share of largest"),
    ]  # fmt: skip
    figure = Figure(figsize=(12.0, 5.0), layout="constrained")
    for axes, (title, board, instant, unit) in zip(
        figure.subplots(1, len(panels), sharey=True), panels, strict=True
    ):
        drawn = draw_displacement(axes, board, instant)
        figure.colorbar(drawn, ax=axes, label=f"displacement / {unit}", shrink=0.8)
        draw_board(axes, board, ink="black")
        axes.set_title(title, fontsize=10, color=INK)
    figure.axes[0].set_ylabel("y / mm")
    save(figure, folder / "paper-3a.png")


def printed(board: Board) -> FloatArray:
    """Displacement by the formula as printed, the same whichever coil is driven, (nx, ny)."""
    width, length = board.plate.size
    m = np.arange(1, ORDER + 1)
    # ∫ sin(mπx/a) dx is 2a/(mπ) for odd m and 0 for even ones.
    halves = np.where(m % 2 == 1, 2.0 / (m * np.pi), 0.0)
    return _sum(board, np.outer(width * halves, length * halves))


def with_place(board: Board, at: tuple[float, float]) -> FloatArray:
    """Displacement by the formula with the load's place (m, from the centre) in it, (nx, ny)."""
    across, along = (
        _sines(np.array([place]), side)[:, 0]
        for place, side in zip(at, board.plate.size, strict=True)
    )
    return _sum(board, np.outer(across, along))


def _sum(board: Board, loads: FloatArray) -> FloatArray:
    """Σ over modes of their load without the factor 2/√(abρh), which comes in here squared."""
    plate = board.plate
    width, length = plate.size
    m = np.arange(1, ORDER + 1)
    waves = (m[:, None] * np.pi / width) ** 2 + (m * np.pi / length) ** 2
    own = plate.bending_stiffness / plate.areal_mass * waves**2
    gain = 1.0 / (own - (2.0 * np.pi * board.drive.frequency_hz) ** 2)
    gain = gain * (4.0 / (width * length * plate.areal_mass))
    return np.asarray(_sines(board.x, width).T @ (gain * loads) @ _sines(board.y, length))


def _sines(places: FloatArray, side: float) -> FloatArray:
    """Sin(mπ(x/a + 1/2)), shape (orders, places): coordinates are from the centre."""
    m = np.arange(1, ORDER + 1)[:, None]
    return np.asarray(np.sin(m * np.pi * (places / side + 0.5)))
