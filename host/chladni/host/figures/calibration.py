"""Figure of a calibration: coils' forces, the foam that was found, and what it brings back."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from chladni.calibration.restored import Restored
from chladni.drives.scoring.spread import Spread
from chladni.host.figures.fields import COLOURS, INK
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.fields.board_plate import plate_geometry

FOOT = COLOURS[3]


def calibration_figure(
    drawn: Board, found: Board, by: str, before: Restored, after: Restored
) -> Figure:
    """The board as it was found, beside what fingers get before and after.

    Parameters
    ----------
    by
        What it was measured with, for the title.
    """
    wide, long = drawn.plate.size
    figure = Figure(figsize=(5.0 + 4.6 * min(1.6, wide / long + 0.4), 4.6), layout="constrained")
    plate, scores = figure.subplots(1, 2, width_ratios=(1.0, 1.3))
    _draw_plate(figure, plate, drawn, found)
    _draw_scores(scores, drawn, before, after)
    figure.suptitle(f"{drawn.name}: calibrated by {by}", fontsize=11, color=INK)
    return figure


def _draw_plate(figure: Figure, axes: Axes, drawn: Board, board: Board) -> None:
    """Foam over the drawn one, and coils with their forces."""
    title = "circles: coils, with their forces,\ntimes the drawn ones"
    half = [side / 2.0 / MM for side in board.plate.size]
    layer = plate_geometry(board).foundation
    if layer is not None and drawn.foundation is not None:
        x, y = np.meshgrid(board.x, board.y, indexing="ij")
        ratio = layer.stiffness * layer.ratio(x, y) / drawn.foundation.total_stiffness
        shown = axes.imshow(
            ratio.T,
            origin="lower",
            cmap="viridis",
            extent=(-half[0], half[0], -half[1], half[1]),
        )
        title = f"colours: foam's stiffness,\n{title}"
        figure.colorbar(shown, ax=axes, label="foam, times as stiff as drawn", shrink=0.85)
    for own in board.actuators:
        place = (own.at[0] / MM, own.at[1] / MM)
        text = "dead" if own.is_dead else f"{abs(own.strength):.2f}"
        text = f"reversed\n{text}" if own.polarity < 0 else text
        colour = COLOURS[1] if own.is_dead or own.polarity < 0 else INK
        if board.winding is not None:
            axes.add_patch(
                Circle(place, board.winding.outer / 2.0 / MM, fill=False, edgecolor=colour)
            )
        axes.annotate(
            text,
            place,
            ha="center",
            va="center",
            fontsize=8,
            color=colour,
            bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": colour},
        )
    _draw_feet(axes, drawn, board)
    if board.springs:
        title = f"triangles: feet's stiffness,\n{title}"
    axes.set_xlim(-half[0], half[0])
    axes.set_ylim(-half[1], half[1])
    axes.set_aspect("equal")
    axes.set_xlabel("x, mm")
    axes.set_ylabel("y, mm")
    axes.set_title(title, fontsize=9)


def _draw_feet(axes: Axes, drawn: Board, board: Board) -> None:
    """Each with its stiffness over the drawn one."""
    for foot, before in zip(board.springs, drawn.springs, strict=True):
        place = (foot.at[0] / MM, foot.at[1] / MM)
        # Above coils' labels, which are wide.
        axes.plot(*place, "^", color=FOOT, markersize=9, zorder=5)
        ratio = f"{foot.stiffness / before.stiffness:.2f}" if before.stiffness > 0.0 else ""
        # Inwards: feet stand near edges.
        axes.annotate(
            ratio,
            place,
            (0.0, -14.0 if place[1] > 0.0 else 14.0),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
            color=INK,
        )


def _draw_scores(axes: Axes, drawn: Board, before: Restored, after: Restored) -> None:
    """Medians as bars, with a line from the worst tenth to the best."""
    rows: list[tuple[str, Spread, Spread]] = [
        ("two fingers apart, dB", before.fingers_2_db, after.fingers_2_db)
    ]
    own, then = before.second_finger_20mm_db, after.second_finger_20mm_db
    if drawn.focus is not None and own is not None and then is not None:
        rows.append(("one finger, 20 mm away, dB", own, then))
    for k, (_, early, late) in enumerate(rows):
        for offset, own, colour in ((0.2, early, COLOURS[0]), (-0.2, late, COLOURS[2])):
            label = None if k else ("before" if offset > 0.0 else "after")
            axes.barh(k + offset, own.median, 0.36, color=colour, label=label)
            axes.plot((own.p10, own.p90), (k + offset,) * 2, color=INK, linewidth=1.2)
    axes.set_yticks(range(len(rows)), [row[0] for row in rows])
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_xlabel("dB: medians, with lines from\nthe worst tenth to the best tenth")
    axes.set_title(
        "how far apart fingers are kept: by drives\nfor the drawn board, and for the one found",
        fontsize=9,
    )
    axes.legend(fontsize=8)
    axes.grid(alpha=0.25, axis="x")
