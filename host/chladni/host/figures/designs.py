"""What a search for a board found: the front, and where the best board's coils stand."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from chladni.design.search import Design
from chladni.design.spec import FINGER_TERMS
from chladni.host.figures.fields import COLOURS, INK, draw_board
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
        own = [row for row in rows if row["coils"] == count]
        left.plot(
            [row[across] for row in own],
            [row[up] for row in own],
            "o",
            color=COLOURS[number % len(COLOURS)],
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
        linestyle="",
        label="written",
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
    wide, long = (side / MM for side in board.plate.size)
    radius = board.plate.corner_radius / MM
    plate = FancyBboxPatch(
        (-wide / 2.0, -long / 2.0),
        wide,
        long,
        boxstyle=f"round,pad=0,rounding_size={radius:g}" if radius else "square,pad=0",
        facecolor="#eef2f6",
        edgecolor=INK,
    )
    right.add_patch(plate)
    draw_board(right, board, ink=INK)
    right.set_xlim(-wide / 2.0 - 2.0, wide / 2.0 + 2.0)
    right.set_ylim(-long / 2.0 - 2.0, long / 2.0 + 2.0)
    right.set_ylabel("y / mm")
    sheet = f"{board.plate.thickness / MM:g} mm {board.plate.material}".strip()
    right.set_title(
        f"{board.name}\n{len(board.actuators)} coils on {sheet}", fontsize=10, color=INK
    )
