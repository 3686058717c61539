"""What a search for a board found: the front, and where the best board's coils stand."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from chladni.design.search import Design
from chladni.design.spec import FINGER_TERMS
from chladni.host.figures.fields import COLOURS, INK
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM


def front_figure(found: Design) -> Figure:
    """What keeps fingers apart against micrometres for each board of the front; beside it the best.

    Of several fingers where the SPEC weighs them, else of one and a second 20 mm away.

    A board that is wider than long stands below.
    """
    wide, long = found.board.plate.size
    if wide > long:
        figure = Figure(figsize=(7.0, 5.0 + 6.0 * long / wide), layout="constrained")
        left, right = figure.subplots(2, 1, height_ratios=(4.0, 0.6 + 6.0 * long / wide))
    else:
        figure = Figure(figsize=(9.0, 4.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    _draw_front(left, found)
    _draw_best(right, found.board)
    return figure


def _draw_front(left: Axes, found: Design) -> None:
    rows = [one.summary for one in found.front]
    several = next((name for name in FINGER_TERMS if all(name in row for row in rows)), None)
    up, um = (several, "fingers_um") if several else ("second_finger_20mm_db", "finger_um")
    has_um = all(row.get(um) is not None for row in rows)
    across = um if has_um else "mass_g"
    counts = sorted({row["coils"] for row in rows})
    for number, count in enumerate(counts):
        own = sorted((row for row in rows if row["coils"] == count), key=lambda r: r[across])
        left.plot(
            [row[across] for row in own],
            [row[up] for row in own],
            "o-",
            color=COLOURS[number % len(COLOURS)],
            linewidth=0.8,
            label=f"{count:g} coils",
        )
    best = max(rows, key=lambda row: row["robust_score"])
    left.plot(
        best[across],
        best[up],
        "o",
        markersize=14,
        markerfacecolor="none",
        markeredgecolor=INK,
    )
    left.set_xlabel(
        "under the finger, µm (10th percentile, within tolerances)" if has_um else "mass, g"
    )
    left.set_ylabel(
        f"{FINGER_TERMS[several]} fingers apart, dB (10th percentile)"
        if several
        else "second finger 20 mm away, dB below"
    )
    left.margins(0.15)
    left.legend(fontsize=9)
    left.set_title("Boards of which none is better in every goal", fontsize=10, color=INK)


def _draw_best(right: Axes, board: Board) -> None:
    half = np.array(board.plate.size) / 2.0 / MM
    right.add_patch(
        Rectangle(
            (-half[0], -half[1]), 2.0 * half[0], 2.0 * half[1], facecolor="#eef2f6", edgecolor=INK
        )
    )
    radius = board.magnet.radius / MM if board.magnet else 1.0
    for actuator in board.actuators:
        x, y = np.divide(actuator.at, MM)
        right.add_patch(Circle((x, y), radius, facecolor=COLOURS[0], edgecolor=INK))
    right.set_xlim(-half[0] - 2.0, half[0] + 2.0)
    right.set_ylim(-half[1] - 2.0, half[1] + 2.0)
    right.set_aspect("equal")
    right.set_xlabel("x / mm")
    right.set_ylabel("y / mm")
    thickness = board.plate.thickness / MM
    right.set_title(
        f"{board.name}\n{len(board.actuators)} coils, {thickness:g} mm thick",
        fontsize=10,
        color=INK,
    )
