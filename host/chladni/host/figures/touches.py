"""A swipe: where the finger went, and what it felt at each place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure, SubFigure

from chladni.host.emulation.touches import TouchScore
from chladni.host.figures.fields import COLOURS, INK, board_inches, draw_board, is_wide
from chladni.sim.board.board import Board

LINES = (
    ("second_finger_db", "second finger\ndB"),
    ("focal_error_mm", "focal error\nmm"),
    ("ssim", "SSIM"),
    ("finger_um", "under the\nfinger / µm"),
)
"""Numbers of a scorecard over time, and their labels; the last one is of what a finger feels."""
CURVES = (5.0, 6.0)
"""Inches that the curves take."""


def swipe_figure(board: Board, touches: Sequence[TouchScore]) -> Figure:
    """The places on the board, coloured by the second finger, and the numbers over time.

    Parameters
    ----------
    touches
        At least one, as `LoopReport.touches` has them; `finger_um` is left out on a board without
        a coil.
    """
    wide = is_wide(board)
    width, height = board_inches(board, (CURVES[0] + 2.0, CURVES[1]) if wide else CURVES)
    figure, map_part, curve_part = _parts((width, height), wide=wide)
    places = np.array([touch.target_mm for touch in touches])
    levels = [touch.card.second_finger_db for touch in touches]
    over = map_part.subplots()
    over.set_facecolor("#eef2f6")
    over.plot(*places.T, color="#999999", linewidth=0.8, zorder=1)
    drawn = over.scatter(
        places[:, 0], places[:, 1], c=levels, cmap="viridis", s=24, zorder=2, label="touches"
    )
    draw_board(over, board, ink=INK, small=True)
    over.set_ylabel("y / mm")
    over.set_title("Touches", fontsize=10, color=INK)
    map_part.colorbar(drawn, ax=over, label="second finger / dB", shrink=0.8)
    at_ms = [touch.at_ms for touch in touches]
    rows = {key: [_number(touch, key) for touch in touches] for key, _ in LINES}
    shown = [(key, label) for key, label in LINES if None not in rows[key]]
    curves = np.atleast_1d(curve_part.subplots(len(shown), 1, sharex=True))
    for axes, (key, label), colour in zip(curves, shown, COLOURS, strict=False):
        axes.plot(at_ms, rows[key], ".-", color=colour, linewidth=1.0)
        axes.set_ylabel(label, fontsize=8)
        axes.tick_params(labelsize=8)
        if key == "second_finger_db":
            axes.axhline(0.0, color=INK, linewidth=0.8, linestyle="--")
    curve_part.align_ylabels(curves)
    curves[0].set_title("Scored per report of the panel", fontsize=10, color=INK)
    curves[-1].set_xlabel("t / ms")
    return figure


def _parts(board: tuple[float, float], *, wide: bool) -> tuple[Figure, SubFigure, SubFigure]:
    """A figure with room for a board of a size in inches, and for the curves."""
    if wide:
        figure = Figure(figsize=(CURVES[0] + 2.0, CURVES[1] + board[1] + 1.0), layout="constrained")
        parts = figure.subfigures(2, 1, height_ratios=[board[1] + 1.0, CURVES[1]])
    else:
        figure = Figure(figsize=(CURVES[0] + board[0] + 1.6, CURVES[1]), layout="constrained")
        parts = figure.subfigures(1, 2, width_ratios=[board[0] + 1.6, CURVES[0]])
    first, second = np.asarray(parts).tolist()
    return figure, first, second


def _number(touch: TouchScore, key: str) -> float | None:
    """One of a touch's numbers; None on a board without a coil."""
    value: float | None = getattr(touch.card.felt if key == "finger_um" else touch.card, key)
    return value
