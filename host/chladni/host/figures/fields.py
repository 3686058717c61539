"""A board's fields and modes as figures, and what all figures share: colours, sizes."""

from __future__ import annotations

import io
import textwrap
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.patheffects import AbstractPathEffect, withStroke
from numpy.typing import NDArray

from chladni.host.figures.outlines import clip_to_plate, up_to_the_edge
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.files import write_whole
from chladni.sim.image.metrics import image_of
from chladni.sim.plate.modes import ModeShapes

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

INK = "#222222"
COLOURS = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#8c6d00",
    "#56b4e9",
    "#e69f00",
    "#000000",
)
"""Okabe and Ito's palette, which the colour-blind tell apart, its yellow darker for white paper."""


LONG_INCHES, SHORT_INCHES = 5.6, 3.8
"""Of a picture of a board, at most: along its long side and across."""
FRAME_INCHES = (1.6, 1.0)
"""Around it: axes, their labels, a scale of colours."""
TITLE_INCHES = 0.9
"""Above and below pictures that stand below each other: a title of three lines, and marks."""
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


def picture_inches(board: Board) -> tuple[float, float]:
    """Width and height of one of several pictures of a board."""
    most = (SHORT_INCHES, LONG_INCHES)
    return board_inches(board, most[::-1] if is_wide(board) else most)


CHARACTERS_PER_INCH = 13.0
"""Of a title of 10 points."""


def with_verdict(figure: Figure, title: str, verdict: str) -> str:
    """A title, and below it a verdict's first sentence, in lines that fit."""
    first = verdict.split(". ", maxsplit=1)[0].removesuffix(".")
    for piece in (" / ", " dB", " mm", " µm"):  # no line ends in the middle of a figure
        first = first.replace(piece, piece.replace(" ", "\u00a0"))
    lines = textwrap.wrap(first, max(int(CHARACTERS_PER_INCH * figure.get_figwidth()), 30))
    return "\n".join([title, *lines])


def pictures(board: Board, count: int) -> tuple[Figure, list[Axes]]:
    """A figure with pictures of a board, side by side, or below each other if it is wide."""
    width, height = picture_inches(board)
    if is_wide(board):
        size = (width + FRAME_INCHES[0], count * (height + FRAME_INCHES[1]) + TITLE_INCHES)
    else:
        size = (count * (width + FRAME_INCHES[0]), height + FRAME_INCHES[1])
    figure = Figure(figsize=size, layout="constrained")
    shape = (count, 1) if is_wide(board) else (1, count)
    axes = np.asarray(figure.subplots(*shape, squeeze=False)).ravel().tolist()
    for one in axes:
        one.set_ylabel("y / mm")
    return figure, axes


def explain_marks(
    figure: Figure | SubFigure,
    *boards: Board,
    target: bool = False,
    maximum: bool = False,
    second: bool = False,
) -> None:
    """A legend of the marks on pictures of boards, below them."""
    screws = any(own.screws for own in boards)
    feet = any(own.springs or own.pins for own in boards)
    marks = [
        ("o", "actuator", True),
        ("x", "screw", screws),
        ("^", "foot", feet),
        ("+", "target", target),
        ("s", "maximum", maximum),
    ]
    handles = [
        Line2D([], [], linestyle="", marker=mark, color=INK, label=label, markerfacecolor="none")
        for mark, label, is_there in marks
        if is_there
    ]
    if second:
        handles.append(Line2D([], [], linestyle="--", color=INK, label="loudest second finger"))
    if any(own.winding is not None for own in boards):
        handles.append(Line2D([], [], linestyle=":", linewidth=0.8, color=INK, label="winding"))
    figure.legend(
        handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8, frameon=False
    )


def rim_of(ink: str) -> list[AbstractPathEffect]:
    """Of marks: of the other shade, so that they are seen on every colour."""
    return [withStroke(linewidth=2.5, foreground=INK if ink == "white" else "white")]


def draw_board(
    axes: Axes,
    board: Board,
    *,
    target_mm: tuple[float, float] | None = None,
    maximum_mm: tuple[float, float] | None = None,
    ink: str = "white",
    small: bool = False,
) -> None:
    """Outline, screws, feet, coils, target and an image's maximum on axes in mm."""
    size = 0.5 if small else 1.0
    half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
    axes.set_xlim(-half_x, half_x)
    axes.set_ylim(-half_y, half_y)
    axes.set_aspect("equal")
    axes.set_xlabel("x / mm")
    rim = rim_of(ink)
    for screw in board.screws:
        x, y = np.divide(screw.at, MM)
        axes.plot(x, y, "x", color=ink, markersize=6 * size, path_effects=rim)
    for at in [own.at for own in board.springs] + [own.at for own in board.pins]:
        x, y = np.divide(at, MM)
        axes.plot(x, y, "^", color=ink, markersize=max(8 * size, 6), path_effects=rim)
    for k, actuator in enumerate(board.actuators):
        x, y = np.divide(actuator.at, MM)
        if board.winding is not None:
            outline = Circle((x, y), board.winding.outer / 2.0 / MM, fill=False, color=ink)
            axes.add_patch(outline).set(linewidth=0.6 * size, linestyle=":")
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(x, y, "o", markerfacecolor="none", markeredgecolor=ink, markersize=9 * size)
        axes.plot(x, y, "o", color=colour, markersize=5 * size)
    if target_mm is not None:
        axes.plot(*target_mm, "+", color=ink, markersize=14, markeredgewidth=2, path_effects=rim)
    if maximum_mm is not None:
        (mark,) = axes.plot(*maximum_mm, "s", color=ink, markersize=10, clip_on=False)
        mark.set(markerfacecolor="none", path_effects=rim)


def draw_level(
    axes: Axes, board: Board, level_db: FloatArray, least_db: float, most_db: float
) -> AxesImage:
    """Levels from `least_db` to `most_db`."""
    image = axes.imshow(
        up_to_the_edge(board, level_db).T,
        origin="lower",
        extent=_extent(board),
        cmap="cividis",
        vmin=least_db,
        vmax=most_db,
        interpolation="bilinear",
    )
    clip_to_plate(axes, board, image)
    return image


def draw_image(axes: Axes, board: Board, field: ComplexArray) -> AxesImage:
    """The normalised energy image of a displacement field, from 0 to 1."""
    image = axes.imshow(
        up_to_the_edge(board, image_of(field)).T,
        origin="lower",
        extent=_extent(board),
        cmap="viridis",
        vmin=0.0,
        vmax=1.0,
        interpolation="bilinear",
    )
    clip_to_plate(axes, board, image)
    return image


def _extent(board: Board) -> tuple[float, float, float, float]:
    half_x, half_y = (side / 2.0 / MM for side in board.plate.size)
    return -half_x, half_x, -half_y, half_y


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
    largest = 1e6 * (scale or float(np.abs(instant).max()) or 1.0)
    image = axes.imshow(
        up_to_the_edge(board, instant).T * 1e6,
        origin="lower",
        extent=_extent(board),
        cmap="RdBu_r",
        vmin=-largest,
        vmax=largest,
        interpolation="bilinear",
    )
    clip_to_plate(axes, board, image)
    return image


def maximum_mm(board: Board, field: ComplexArray) -> tuple[float, float]:
    """Where a field is largest, mm."""
    i, j = np.unravel_index(int(np.argmax(np.abs(field))), field.shape)
    return float(board.x[i] / MM), float(board.y[j] / MM)


def field_figure(
    board: Board,
    field: ComplexArray,
    *,
    target_mm: tuple[float, float] | None = None,
    per_newton: bool = True,
) -> Figure:
    """The displacement at the instant of its largest swing, and the energy image.

    Parameters
    ----------
    field
        complex128, shape (nx, ny), m/N or m.
    target_mm
        A place to mark.
    per_newton
        Whether it is the answer to one newton; else to a drive whose gains are newtons.
    """
    figure, (left, right) = pictures(board, 2)
    drawn = draw_displacement(left, board, at_largest_swing(field))
    unit = "µm per newton" if per_newton else "µm, gains in newtons"
    figure.colorbar(drawn, ax=left, label=f"displacement / {unit}", shrink=0.8)
    left.set_title("Displacement at an instant", fontsize=10, color=INK)
    figure.colorbar(
        draw_image(right, board, field), ax=right, label="share of its range", shrink=0.8
    )
    right.set_title("Energy image", fontsize=10, color=INK)
    for axes, ink in ((left, "black"), (right, "white")):
        draw_board(axes, board, target_mm=target_mm, maximum_mm=maximum_mm(board, field), ink=ink)
    explain_marks(figure, board, target=target_mm is not None, maximum=True)
    return figure


def modes_figure(board: Board, shapes: ModeShapes) -> Figure:
    """Nodal lines of every mode over its shape: Chladni figures."""
    count = shapes.frequencies_hz.size
    columns = min(count, 3 if is_wide(board) else 5)
    rows = -(-count // columns)
    width, height = board_inches(board, (3.2, 3.2))
    size = (columns * (width + 0.5), rows * (height + 0.5) + 0.6)
    figure = Figure(figsize=size, layout="constrained")
    grid = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    for axes in grid[count:]:
        axes.set_axis_off()
    for axes, frequency, own in zip(grid, shapes.frequencies_hz, shapes.shapes, strict=False):
        shape = up_to_the_edge(board, own)
        scale = np.abs(shape).max()
        colours = axes.imshow(
            shape.T,
            origin="lower",
            extent=_extent(board),
            cmap="RdBu_r",
            vmin=-scale,
            vmax=scale,
            alpha=0.6,
        )
        x, y = board.x / MM, board.y / MM
        lines = axes.contour(x, y, shape.T, levels=[0.0], colors=INK, linewidths=1.2)
        clip_to_plate(axes, board, colours, lines)
        draw_board(axes, board, ink="black", small=True)
        axes.set_title(f"{frequency:.1f} Hz", fontsize=9, color=INK)
        axes.tick_params(labelsize=6)
        axes.xaxis.label.set_size(8)
    for axes in grid[: max(count - columns, 0)]:
        axes.set_xlabel("")
    figure.supylabel("y / mm", fontsize=8)
    figure.suptitle("Shapes at an instant: red up, blue down, lines at rest", fontsize=9, color=INK)
    explain_marks(figure, board)
    return figure
