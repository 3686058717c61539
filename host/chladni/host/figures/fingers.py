"""Figures of several fingers at once: how far each one's signal stays from the others."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from chladni.drives.scoring.several_fingers.fingers_score import FingersScore
from chladni.host.figures.fields import COLOURS, INK

FloatArray = NDArray[np.float64]

PANELS = (
    (0, "own signal over its share under the other fingers, dB", False, 0.1),
    (2, "own signal, µm peak", True, 0.1),
    (3, "the others' largest share, µm peak", True, 0.9),
)
"""Column of a score's rows, what it is, whether its axis is logarithmic, and where the worst tenth
of fingers begins, as a share of them."""
WIDE = 100.0
"""Largest over smallest value from which an axis has powers of ten alone."""


def fingers_figure(
    name: str,
    score: FingersScore,
    threshold_um: float | None,
    *,
    is_played: bool = False,
    known_as: str = "as drawn",
) -> Figure:
    """Shares of fingers by isolation, own level and what they feel of the others.

    Solid lines are of the board as drawn or measured, dashed ones of boards within its tolerances.
    Points are at the median and where the worst tenth begins.
    """
    figure = Figure(figsize=(12.6, 4.4), layout="constrained")
    panels = figure.subplots(1, len(PANELS), sharey=True)
    for axes, (column, label, is_logarithmic, worst) in zip(panels, PANELS, strict=True):
        marks = {"median": 0.5, "worst tenth": worst}
        for own, colour in zip(score.counts, COLOURS, strict=False):
            _line(axes, own.rows[:, column], colour, "-", f"{own.fingers} fingers", marks)
            if own.perturbed_rows is not None:
                _line(axes, own.perturbed_rows[:, column], colour, "--", None, marks)
        for words, share in marks.items():
            axes.axhline(share, color=INK, linewidth=0.6, linestyle=":")
            # Where there are no lines: most of the others' shares lie on the right.
            at, side = (0.99, "right") if worst < 0.5 else (0.01, "left")
            axes.text(at, share, words, transform=axes.transAxes, ha=side, va="bottom", fontsize=8)
        if column == 3 and threshold_um is not None:
            axes.axvline(threshold_um, color=INK, linewidth=0.8)
            axes.annotate(
                "felt by a resting finger",
                (threshold_um, 0.02),
                rotation=90,
                fontsize=8,
                xytext=(3, 0),
                textcoords="offset points",
                ha="left",
                va="bottom",
                color=INK,
            )
        if is_logarithmic and np.isfinite(score.counts[0].rows[:, column]).all():
            axes.set_xscale("log")
            # As many numbers as have room beside each other.
            low, high = axes.get_xlim()
            subs = (1.0, 2.0, 5.0) if high < WIDE * low else (1.0,)
            axes.xaxis.set_major_locator(LogLocator(subs=subs))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel(label, fontsize=9)
        axes.grid(alpha=0.25)
        axes.set_ylim(0.0, 1.0)
    panels[0].set_ylabel("share of fingers that have less", fontsize=9)
    panels[0].legend(fontsize=8, loc="upper left")
    has_both = any(own.perturbed is not None for own in score.counts)
    lines = f"solid: {known_as}, dashed: within tolerances" if has_both else known_as
    by = "pins of an emulated device" if is_played else "simulated"
    figure.suptitle(
        f"{name}: fingers {score.apart_mm:g} mm apart or more, all pressing with "
        f"{score.newtons:g} N ({by}; {lines})",
        fontsize=11,
        color=INK,
    )
    return figure


def _line(
    axes: Axes,
    values: FloatArray,
    colour: str,
    style: str,
    label: str | None,
    marks: Mapping[str, float],
) -> None:
    known = np.sort(values[np.isfinite(values)])
    if known.size:
        shares = (np.arange(known.size) + 0.5) / known.size
        axes.plot(known, shares, style, color=colour, linewidth=1.4, label=label)
        at = list(marks.values())
        axes.plot(np.quantile(known, at), at, "o", color=colour, markersize=4.5)
