"""Figures that people look at: images of the board and the duties that made them."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from chladni.host.emulation.emulator import Recording
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Coil
from chladni.sim.board.quantity import MM
from chladni.sim.coil.actuator import WaveResponse, motion
from chladni.sim.coil.waveforms import WAVEFORMS, Waveform, harmonics, synthesise
from chladni.sim.files import write_whole
from chladni.sim.image.metrics import image_of
from chladni.sim.plate.modes import ModeShapes

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

INK = "#222222"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8c6d00")
"""Okabe and Ito's palette, which the colour-blind tell apart."""


FORMATS = (".png", ".svg", ".pdf")
UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""Metadata without the time, by format."""


def save(figure: Figure, path: Path) -> None:
    """Write a figure whole, in the format its name asks for; the same figure is the same bytes.

    An SVG's texts stay texts, which can be searched.
    """
    buffer = io.BytesIO()
    kind = path.suffix.lstrip(".") or "png"
    # matplotlib names an SVG's parts at random unless it is given a salt.
    with mpl.rc_context({"svg.hashsalt": "chladni", "svg.fonttype": "none"}):
        figure.savefig(
            buffer, format=kind, dpi=150, bbox_inches="tight", metadata=UNDATED.get(kind)
        )
    write_whole(path, buffer.getvalue())


def is_wide(board: Board) -> bool:
    """Whether pictures of a board go below each other: it is wider than it is long."""
    return board.plate.size[0] > board.plate.size[1]


def board_inches(board: Board, most: tuple[float, float]) -> tuple[float, float]:
    """Width and height of a picture of a board that fills a room, in inches."""
    width, length = board.plate.size
    scale = min(most[0] / width, most[1] / length)
    return width * scale, length * scale


def draw_board(
    axes: Axes,
    board: Board,
    *,
    target_mm: tuple[float, float] | None = None,
    ink: str = "white",
    small: bool = False,
) -> None:
    """Outline, screws, actuators and target on axes in mm."""
    size = 0.5 if small else 1.0
    half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
    axes.set_xlim(-half_x, half_x)
    axes.set_ylim(-half_y, half_y)
    axes.set_aspect("equal")
    axes.set_xlabel("x / mm")
    for screw in board.screws:
        x, y = np.divide(screw.at, MM)
        axes.plot(x, y, "x", color=ink, markersize=5 * size)
    for k, actuator in enumerate(board.actuators):
        x, y = np.divide(actuator.at, MM)
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(x, y, "o", markerfacecolor="none", markeredgecolor=ink, markersize=9 * size)
        axes.plot(x, y, "o", color=colour, markersize=5 * size)
    if target_mm is not None:
        axes.plot(*target_mm, "+", color=ink, markersize=14, markeredgewidth=2)


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


def at_largest_swing(field: ComplexArray) -> FloatArray:
    """A displacement at the instant at which some place is farthest out, shape of the field."""
    peak = field.flat[int(np.abs(field).argmax())]
    return np.asarray((field * np.exp(-1j * np.angle(peak))).real)


def draw_displacement(
    axes: Axes, board: Board, instant: FloatArray, *, scale: float | None = None
) -> AxesImage:
    """A displacement at an instant in µm, red up and blue down.

    Parameters
    ----------
    instant
        m, or m/N, shape (nx, ny).
    scale
        What the deepest colours stand for, in the same unit; by default the largest of `instant`.
    """
    half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
    largest = 1e6 * (scale or float(np.abs(instant).max()) or 1.0)
    return axes.imshow(
        instant.T * 1e6,
        origin="lower",
        extent=(-half_x, half_x, -half_y, half_y),
        cmap="RdBu_r",
        vmin=-largest,
        vmax=largest,
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


def field_figure(
    board: Board, field: ComplexArray, *, target_mm: tuple[float, float] | None = None
) -> Figure:
    """The displacement at the instant of its largest swing, and the energy image."""
    figure = Figure(figsize=(8.0, 6.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    drawn = draw_displacement(left, board, at_largest_swing(field))
    figure.colorbar(drawn, ax=left, label="displacement / µm (per N for a unit load)", shrink=0.8)
    draw_board(left, board, target_mm=target_mm, ink="black")
    left.set_title("Displacement at an instant", fontsize=10, color=INK)
    left.set_ylabel("y / mm")
    draw_image(right, board, field)
    draw_board(right, board, target_mm=target_mm)
    right.set_title("Energy image", fontsize=10, color=INK)
    return figure


def modes_figure(board: Board, shapes: ModeShapes) -> Figure:
    """Nodal lines of every mode over its shape: Chladni figures."""
    count = shapes.frequencies_hz.size
    columns = min(count, 5)
    rows = -(-count // columns)
    figure = Figure(figsize=(2.2 * columns, 3.6 * rows + 0.3), layout="constrained")
    grid = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    x, y = board.x / MM, board.y / MM
    for axes in grid[count:]:
        axes.set_axis_off()
    for axes, frequency, shape in zip(grid, shapes.frequencies_hz, shapes.shapes, strict=False):
        scale = np.abs(shape).max()
        axes.imshow(
            shape.T,
            origin="lower",
            extent=(x[0], x[-1], y[0], y[-1]),
            cmap="RdBu_r",
            vmin=-scale,
            vmax=scale,
            alpha=0.6,
        )
        axes.contour(x, y, shape.T, levels=[0.0], colors=INK, linewidths=1.2)
        draw_board(axes, board, ink="black", small=True)
        axes.set_title(f"{frequency:.1f} Hz", fontsize=9, color=INK)
        axes.set_xlabel("")
        axes.tick_params(labelsize=6)
    return figure


def sweep_figure(
    coil: Coil, frequencies_hz: FloatArray, curves: Mapping[Waveform, WaveResponse]
) -> Figure:
    """The paper's figure 2: resonance of each wave's fundamental, and shapes over frequency."""
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    top, bottom = np.asarray(figure.subfigures(2, 1, height_ratios=[1.1, 1.4])).tolist()
    axes = top.subplots()
    for wave, colour in zip(WAVEFORMS, COLOURS, strict=False):
        axes.plot(frequencies_hz, curves[wave].fundamental, color=colour, label=wave)
    axes.axvline(coil.resonance_hz, color="#999999", linewidth=0.8, linestyle="--")
    axes.set_xlabel("frequency / Hz")
    axes.set_ylabel("fundamental acceleration / m/s²")
    axes.legend(frameon=False, fontsize=9)
    shown = np.linspace(frequencies_hz[0], frequencies_hz[-1], 4)
    shown[int(np.argmin(np.abs(shown - coil.resonance_hz)))] = coil.resonance_hz
    phase = np.arange(512) / 512 * 2.0
    panels = bottom.subplots(len(WAVEFORMS), shown.size, sharex=True)
    for row, (wave, colour) in enumerate(zip(WAVEFORMS, COLOURS, strict=False)):
        for column, frequency in enumerate(shown):
            panel = panels[row, column]
            answer = np.tile(motion(coil, wave, float(frequency), 256), 2)
            drive = np.tile(synthesise(harmonics(wave, 99), 256), 2)
            panel.plot(phase, drive / np.abs(drive).max(), color="#bbbbbb", linewidth=0.8)
            panel.plot(phase, answer / np.abs(answer).max(), color=colour, linewidth=1.1)
            panel.set_yticks([])
            panel.tick_params(labelsize=7)
            if row == 0:
                panel.set_title(f"{frequency:.0f} Hz", fontsize=9, color=INK)
            if column == 0:
                panel.set_ylabel(wave, fontsize=8)
    bottom.supxlabel("periods; grey: drive, colour: acceleration, each scaled to 1", fontsize=8)
    return figure
