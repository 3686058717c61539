"""Figures about a board as such: what its tolerances do to the focus."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from chladni.drives.scoring.sensitivity import Influence
from chladni.host.figures.fields import COLOURS, INK

PANELS = (
    ("level_db", "level under the finger, |dB|"),
    ("ssim", "SSIM"),
    ("second_finger_db", "second finger, dB"),
)


def sensitivity_figure(name: str, influences: Sequence[Influence]) -> Figure:
    """Bars per parameter, the largest on top; one panel a number."""
    figure = Figure(figsize=(10.0, 0.42 * len(influences) + 1.4), layout="constrained")
    panels = figure.subplots(1, len(PANELS), sharey=True)
    rows = np.arange(len(influences))
    for axes, (key, title), colour in zip(panels, PANELS, COLOURS, strict=False):
        values = np.array([getattr(one, key) for one in influences])
        axes.barh(rows, values, color=colour, height=0.62)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_xlabel(f"change of {title}", fontsize=9)
        axes.margins(x=0.22)
        for row, value in zip(rows, values, strict=True):
            axes.annotate(
                f"{value:.2g}", (value, row), xytext=(3 if value >= 0.0 else -3, 0),
                textcoords="offset points", va="center", ha="left" if value >= 0.0 else "right",
                fontsize=8, color=INK,
            )  # fmt: skip
    panels[0].set_yticks(rows, [f"{one.name}\n{one.tolerance}" for one in influences], fontsize=8)
    panels[0].invert_yaxis()
    figure.suptitle(f"{name}: what each part does within its tolerance", fontsize=11, color=INK)
    return figure
