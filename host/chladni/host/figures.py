"""Figures that people look at: images of the board and the duties that made them."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.host.console import write_whole
from chladni.host.emulator import Recording
from chladni.sim.board import MM, Board
from chladni.sim.metrics import image_of

ComplexArray = NDArray[np.complex128]

mpl.use("Agg")
INK = "#222222"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8c6d00")
"""Okabe and Ito's palette, which the colour-blind tell apart."""


def save(figure: Figure, path: Path) -> None:
    """Write a figure whole, in the format its name asks for."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=path.suffix.lstrip(".") or "png", dpi=150, bbox_inches="tight")
    write_whole(path, buffer.getvalue())


def draw_board(axes: Axes, board: Board, *, target_mm: tuple[float, float] | None = None) -> None:
    """Outline, screws, actuators and target on axes in mm."""
    half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
    axes.set_xlim(-half_x, half_x)
    axes.set_ylim(-half_y, half_y)
    axes.set_aspect("equal")
    axes.set_xlabel("x / mm")
    for screw in board.screws:
        x, y = np.divide(screw.at, MM)
        axes.plot(x, y, "x", color="white", markersize=5)
    for k, actuator in enumerate(board.actuators):
        x, y = np.divide(actuator.at, MM)
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(x, y, "o", markerfacecolor="none", markeredgecolor="white", markersize=9)
        axes.plot(x, y, "o", color=colour, markersize=5)
    if target_mm is not None:
        axes.plot(*target_mm, "+", color="white", markersize=14, markeredgewidth=2)


def draw_image(axes: Axes, board: Board, field: ComplexArray) -> None:
    """The normalised energy image of a displacement field."""
    half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
    axes.imshow(
        image_of(field).T,
        origin="lower",
        extent=(-half_x, half_x, -half_y, half_y),
        cmap="viridis",
        interpolation="bilinear",
    )


def chain_figure(
    board: Board,
    target_mm: tuple[float, float],
    wanted: ComplexArray,
    achieved: ComplexArray,
    recording: Recording,
    *,
    span_ms: tuple[float, float],
    captions: Sequence[str],
) -> Figure:
    """Target image, image of the PWM's field, and the duties of the channels.

    Parameters
    ----------
    span_ms
        Stretch of the recording that is drawn.
    captions
        Titles of the two images.
    """
    figure = Figure(figsize=(11.0, 6.0), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=[1.0, 1.0, 1.9])
    for axes, field, caption in zip((left, middle), (wanted, achieved), captions, strict=True):
        draw_image(axes, board, field)
        draw_board(axes, board, target_mm=target_mm)
        axes.set_title(caption, fontsize=10, color=INK)
    left.set_ylabel("y / mm")
    start, stop = (int(ms * 1e-3 * recording.carrier_hz) for ms in span_ms)
    time_ms = recording.t_s[start:stop] * 1e3
    duty = recording.duty[start:stop]
    for k, actuator in enumerate(board.actuators):
        offset = len(board.actuators) - 1 - k
        colour = COLOURS[k % len(COLOURS)]
        right.plot(time_ms, duty[:, k] + offset, color=colour, linewidth=0.9)
        right.axhline(offset, color="#cccccc", linewidth=0.6, zorder=0)
        right.text(
            time_ms[0], offset + 0.86, f" {actuator.name}, GPIO {board.electronics.pwm_pins[k]}",
            fontsize=9, color=colour, va="top",
        )  # fmt: skip
    right.set_xlim(time_ms[0], time_ms[-1])
    right.set_ylim(-0.05, len(board.actuators))
    right.set_yticks([0, 1], ["0", "1"])
    right.set_xlabel("t / ms")
    right.set_ylabel("duty, one unit per channel")
    right.set_title("What the pins do on a touch", fontsize=10, color=INK)
    return figure
