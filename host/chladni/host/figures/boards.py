"""Figures about a board as such: its focus all over, and what tolerances do to that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import CenteredNorm
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from chladni.drives.scoring.sensitivity import Influence
from chladni.drives.scoring.several_fingers.fingers_score import CountScore
from chladni.drives.scoring.survey import Score
from chladni.host.figures.fields import (
    COLOURS,
    INK,
    draw_board,
    explain_marks,
    picture_inches,
    pictures,
    with_verdict,
)
from chladni.host.figures.outlines import clip_to_plate
from chladni.host.figures.two_fingers import pairs_figure
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image.finger import NOTICED_DB

LABELLED = 120
"""Places up to which each has its number in a map."""
ROOM = 0.25
"""Inches that a number takes."""
NONE_DB = 299.0
"""Where there is no second finger so far away, a ratio is 300."""
MOST_SHOWN = 95.0
"""Percentile of places at which a map's colours end."""
PANELS = (
    ("level_db", "level under the finger, |dB|"),
    ("ssim", "SSIM"),
    ("second_finger_db", "second finger, dB"),
    ("isolation_db", "isolation at the worst tenth, dB"),
)


def sensitivity_figure(name: str, influences: Sequence[Influence], verdict: str = "") -> Figure:
    """Bars per parameter, the largest on top; one panel a number; what it comes to above them."""
    figure = Figure(figsize=(10.0, 0.42 * len(influences) + 1.6), layout="constrained")
    known = [panel for panel in PANELS if getattr(influences[0], panel[0]) is not None]
    panels = figure.subplots(1, len(known), sharey=True)
    rows = np.arange(len(influences))
    for axes, (key, title), colour in zip(panels, known, COLOURS, strict=False):
        values = np.array([getattr(one, key) for one in influences])
        axes.barh(rows, values, color=colour, height=0.62)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_xlabel(f"change of {title}", fontsize=9)
        axes.margins(x=0.22)
        axes.locator_params(axis="x", nbins=5)
        for row, value in zip(rows, values, strict=True):
            axes.annotate(
                f"{value:.2g}",
                (value, row),
                xytext=(3 if value >= 0.0 else -3, 0),
                textcoords="offset points",
                va="center",
                ha="left" if value >= 0.0 else "right",
                fontsize=8,
                color=INK,
            )
    panels[0].set_yticks(rows, [f"{one.name}\n{one.tolerance}" for one in influences], fontsize=8)
    panels[0].invert_yaxis()
    title = f"{name}: what each part does within its tolerance"
    figure.suptitle(with_verdict(figure, title, verdict), fontsize=10, color=INK)
    return figure


def board_figure(board: Board, score: Score, two: CountScore | None, verdict: str = "") -> Figure:
    """A board's score: what two fingers get where it is for several, else its focus by place.

    `two`: None where the focus is asked for.
    """
    if two is not None and board.is_for_several:
        return pairs_figure(board, two, verdict)
    return score_figure(board, score, verdict)


MAPS = (
    ("second_finger_20mm_db", "over any other finger 20 mm off", "dB"),
    ("focal_error_mm", "distance to the maximum", "mm"),
    ("finger_um", "under the finger, coils at their limit", "µm"),
)
"""Number, title and unit."""


def score_figure(board: Board, score: Score, verdict: str = "") -> Figure:
    """A board's focus by place: second finger, focal error and level, over its parts.

    `verdict` is what it comes to, in words, above the maps.
    """
    figure, panels = pictures(board, len(MAPS))
    inch = picture_inches(board)[0] / board.plate.size[0]
    for axes, (name, title, unit) in zip(panels, MAPS, strict=True):
        values = getattr(score.maps, name)
        known = np.ma.masked_invalid(np.where(np.abs(values) < NONE_DB, values, np.nan))
        edges = [
            np.append(centres - cell / 2.0, centres[-1] + cell / 2.0)
            for centres, cell in zip(
                (score.maps.x_mm, score.maps.y_mm), score.maps.cell_mm, strict=True
            )
        ]
        is_level = unit == "dB"
        image = axes.pcolormesh(*edges, known.T, **(_about_zero if is_level else _from_zero)(known))
        clip_to_plate(axes, board, image)
        draw_board(axes, board, ink=INK, small=True)
        lines = f"\nlines on the scale: {NOTICED_DB:g} dB, which a finger notices"
        axes.set_title(title + lines * is_level, fontsize=9, color=INK)
        if known.count():
            bar = figure.colorbar(
                image, ax=axes, shrink=0.8, extend="both" if is_level else "neither"
            )
            bar.set_label(unit, rotation=0, labelpad=6.0, ha="left")
            for level in (-NOTICED_DB, NOTICED_DB) if is_level else ():
                bar.ax.axhline(level, color=INK, linewidth=1.0)
        if score.places <= LABELLED and inch * min(score.maps.cell_mm) * MM >= ROOM:
            _label(axes, score, known)
    explain_marks(figure, board)
    above = f"{100.0 * score.above_second_finger:.0f} % of {score.places} places"
    title = f"{board.name}: {above} above every second finger"
    figure.suptitle(with_verdict(figure, title, verdict), fontsize=10, color=INK)
    return figure


def _about_zero(levels: np.ma.MaskedArray) -> dict[str, Any]:
    """Colours with 0 dB in their middle: blue where the finger gets more, red where others do."""
    sizes = np.abs(levels.compressed())
    # One cell at a screw is no scale for all others.
    largest = float(np.percentile(sizes, MOST_SHOWN)) if sizes.size else 0.0
    return {"cmap": "RdBu", "norm": CenteredNorm(0.0, max(largest, 2.0 * NOTICED_DB))}


def _from_zero(values: np.ma.MaskedArray) -> dict[str, Any]:
    """Colours from 0: values that hardly differ then look as they are, all alike."""
    return {"vmin": 0.0, "vmax": float(values.max()) if values.count() else 1.0}


def _label(axes: Axes, score: Score, values: np.ma.MaskedArray) -> None:
    """The number of each place."""
    for i, x in enumerate(score.maps.x_mm):
        for j, y in enumerate(score.maps.y_mm):
            if not np.ma.is_masked(values[i, j]):
                axes.annotate(
                    f"{values[i, j]:.3g}",
                    (x, y),
                    ha="center",
                    va="center",
                    fontsize=6,
                    color="white",
                    path_effects=[withStroke(linewidth=1.5, foreground=INK)],
                )
