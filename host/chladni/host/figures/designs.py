"""What a search for a board found: the front, and where the best board's coils stand."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.design.front import Design, shown_goals
from chladni.design.weights import FINGER_CLICK, FINGER_TERMS
from chladni.host.figures.fields import COLOURS, INK, draw_board, explain_marks
from chladni.host.figures.outlines import outline_of
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM

UNSEEN_GOALS = {
    **{name: f"tones of {count} fingers apart" for name, count in FINGER_TERMS.items()},
    "second_finger_20mm_db": "dB 20 mm from a finger alone",
    "finger_um": "µm under a finger alone",
    "area_cm2": "area",
}
"""Goals that no axis may show; colours tell the number of coils."""


def front_figure(found: Design) -> Figure:
    """What keeps fingers apart against micrometres for each board of the front; beside it the best.

    Of several fingers where the SPEC weighs them, else of one and a second 20 mm away.

    A board that is wider than long stands below. A front of one board has nothing to compare: only
    the board is drawn.
    """
    wide, long = found.board.plate.size
    if len(found.front) == 1:
        size = (7.0, 1.6 + 6.0 * long / wide) if wide > long else (4.6, 4.6)
        figure = Figure(figsize=size, layout="constrained")
        _draw_best(figure.subplots(), found.board)
        explain_marks(figure, found.board)
        return figure
    if wide > long:
        figure = Figure(figsize=(7.0, 5.0 + 6.0 * long / wide), layout="constrained")
        left, right = figure.subplots(2, 1, height_ratios=(4.0, 0.6 + 6.0 * long / wide))
    else:
        figure = Figure(figsize=(9.0, 4.6), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    _draw_front(left, found)
    _draw_best(right, found.board)
    explain_marks(figure, found.board)
    return figure


def _draw_front(left: Axes, found: Design) -> None:
    rows = [one.summary for one in found.front]
    fingers, up, um = shown_goals(rows)
    several = fingers > 1
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
    whose = ", a click of one" if up == FINGER_CLICK else ""
    left.set_ylabel(
        f"{fingers} fingers apart{whose}, dB (10th percentile)"
        if several
        else "second finger 20 mm away, dB below"
    )
    left.margins(0.15)
    left.legend(fontsize=9)
    alone = {"second_finger_20mm_db", "finger_um"} if several else set()  # no goals then
    goals = _unseen_goals(rows, {up, across} | alone)
    about = f"\nMore goals: {goals}" if goals else ""
    left.set_title(f"Boards of which none is better in every goal{about}", fontsize=10, color=INK)


def _unseen_goals(rows: list[dict[str, Any]], shown: set[str]) -> str:
    """Names of goals in which boards of the front differ and that no axis has."""
    return ", ".join(
        told
        for name, told in UNSEEN_GOALS.items()
        if name not in shown and len({row.get(name) for row in rows}) > 1
    )


def _draw_best(right: Axes, board: Board) -> None:
    wide, long = (side / MM for side in board.plate.size)
    right.add_patch(outline_of(board, facecolor="#eef2f6", edgecolor=INK))
    draw_board(right, board, ink=INK)
    right.set_xlim(-wide / 2.0 - 2.0, wide / 2.0 + 2.0)
    right.set_ylim(-long / 2.0 - 2.0, long / 2.0 + 2.0)
    right.set_ylabel("y / mm")
    sheet = f"{board.plate.thickness / MM:g} mm {board.plate.material}".strip()
    each = ", a colour each," if len(board.actuators) <= len(COLOURS) else ""
    right.set_title(
        f"{board.name}\n{len(board.actuators)} coils{each} on {sheet}",
        fontsize=10,
        color=INK,
    )
