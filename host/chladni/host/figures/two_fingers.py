"""Two fingers on boards: what moves while one of them plays and the other is still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Circle

from chladni.host.emulation.played_fingers import FingersPlay
from chladni.host.figures.fields import INK, draw_level
from chladni.sim.board.quantity import MM
from chladni.sim.image.metrics import FINGERTIP_RADIUS

QUIETEST_DB = -50.0
NAMES = ("A", "B")


def two_fingers_figure(plays: Sequence[FingersPlay]) -> Figure:
    """For each board two pictures: finger A plays and B is still, and the other way round."""
    figure = Figure(figsize=(4.1 * len(plays) * len(NAMES) / 1.6, 5.4), layout="constrained")
    panels = figure.subplots(1, len(plays) * len(NAMES), squeeze=False)[0]
    image: AxesImage | None = None
    for number, play in enumerate(plays):
        for own in range(len(NAMES)):
            axes = panels[len(NAMES) * number + own]
            image = _panel(axes, play, own)
    if image is not None:
        bar = figure.colorbar(image, ax=panels.tolist(), shrink=0.8)
        bar.set_label("vibration / dB of the playing finger's", fontsize=9)
    return figure


def _panel(axes: Axes, play: FingersPlay, own: int) -> AxesImage:
    board, other = play.board, 1 - own
    level = 20.0 * np.log10(np.maximum(play.fields_um[own], 1e-9) / play.finger_um[own])
    image = draw_level(axes, board, level, QUIETEST_DB)
    radius = FINGERTIP_RADIUS / MM
    for finger, (x, y) in enumerate(play.places_mm):
        colour = "#d55e00" if finger == own else "white"
        axes.add_patch(Circle((x, y), radius, fill=False, edgecolor=colour, linewidth=2.2))
        axes.annotate(
            NAMES[finger],
            (x, y),
            xytext=(0, -1.9 * radius),
            textcoords="offset points",
            ha="center",
            va="top",
            color=colour,
            fontsize=11,
            fontweight="bold",
        )
    axes.set_title(
        f"{board.name}: {NAMES[own]} plays, {NAMES[other]} is still\n"
        f"{NAMES[own]} {play.finger_um[own]:.2g} µm, {NAMES[other]} "
        f"{play.isolation_db[own]:.0f} dB less",
        fontsize=9.5,
        color=INK,
    )
    axes.set_xlabel("x / mm", fontsize=9)
    axes.set_ylabel("y / mm", fontsize=9)
    return image
