"""What a touch makes of several boards side by side: target, field, and level over distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from chladni.host.figures.fields import COLOURS, INK, draw_board, draw_image
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image import metrics

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

RING = 1.5e-3
"""m; discs whose distances differ by less count as one."""
FARTHEST_MM = 60.0
QUIETEST_DB, LOUDEST_DB = -32.0, 12.0


@dataclass(frozen=True)
class Chain:
    """A touch of one board.

    Attributes
    ----------
    target_mm
        Where it was touched.
    wanted, made
        Displacement of a unit load there, and what the pins made, shape (nx, ny).
    caption
        What is to be said of the second.
    """

    board: Board
    target_mm: tuple[float, float]
    wanted: ComplexArray
    made: ComplexArray
    caption: str


@dataclass(frozen=True)
class Profile:
    """RMS displacement under other fingertips over that under the finger, by distance.

    Attributes
    ----------
    distance_mm
        Middle of each ring that has fingertips, shape (rings,).
    loudest_db, median_db
        Of the fingertips in it, shape (rings,).
    """

    distance_mm: FloatArray
    loudest_db: FloatArray
    median_db: FloatArray


def profile(board: Board, field: ComplexArray, target_mm: tuple[float, float]) -> Profile:
    """Of the discs of a fingertip's radius at all image points."""
    target = (target_mm[0] * MM, target_mm[1] * MM)
    power = np.abs(field) ** 2
    own = power[metrics.disc_mask(board.x, board.y, target, metrics.FINGERTIP_RADIUS)].mean()
    means = metrics.FingertipDiscs(board.x, board.y).means(power)
    ring = (np.hypot(board.x[:, None] - target[0], board.y - target[1]) / RING).astype(np.intp)
    rings = np.unique(ring)
    inside = [means[ring == one] for one in rings]
    return Profile(
        np.asarray((rings + 0.5) * RING / MM, dtype=np.float64),
        np.array([metrics.decibel(values.max() / own) for values in inside]),
        np.array([metrics.decibel(float(np.median(values)) / own) for values in inside]),
    )


def chains_figure(chains: Sequence[Chain]) -> Figure:
    """A row a board: target image, image of the PWM's field, and level over distance.

    The images of a board that is wider than long stand one above the other.
    """
    figure = Figure(figsize=(10.0, 4.6 * len(chains)), layout="constrained")
    rows = figure.subfigures(len(chains), 1, squeeze=False)[:, 0]
    for chain, row, colour in zip(chains, rows, COLOURS, strict=False):
        left, middle, right = _panels(row, chain.board)
        for axes, field in ((left, chain.wanted), (middle, chain.made)):
            draw_image(axes, chain.board, field)
            draw_board(axes, chain.board, target_mm=chain.target_mm, small=True)
        left.set_ylabel(f"{chain.board.name}\ny / mm")
        middle.set_ylabel("y / mm")
        left.set_title("Target: unit load at +", fontsize=10, color=INK)
        middle.set_title("Made by the PWM", fontsize=10, color=INK)
        _draw_profile(right, chain, colour)
    return figure


def _panels(row: SubFigure, board: Board) -> tuple[Axes, Axes, Axes]:
    """Of the target, of what was made, and of levels."""
    wide, long = board.plate.size
    if wide > long:
        named = row.subplot_mosaic([["target", "level"], ["made", "level"]])
    else:
        named = row.subplot_mosaic([["target", "made", "level"]], width_ratios=[1.0, 1.0, 2.2])
    return named["target"], named["made"], named["level"]


def _draw_profile(axes: Axes, chain: Chain, colour: str) -> None:
    """Level over distance, where fingers can be and where they cannot."""
    own = profile(chain.board, chain.made, chain.target_mm)
    nearest = metrics.SECOND_FINGER_DISTANCE / MM
    axes.axvspan(0.0, nearest, color="#eeeeee", zorder=0)
    axes.text(
        nearest / 2.0,
        QUIETEST_DB + 1.0,
        "the finger's\nown place",
        ha="center",
        fontsize=8,
        color=INK,
    )
    axes.axhline(0.0, color=INK, linewidth=0.8, linestyle="--")
    axes.plot(
        own.distance_mm,
        own.loudest_db,
        color=colour,
        linewidth=1.8,
        label="loudest fingertip at that distance",
    )
    axes.plot(
        own.distance_mm,
        own.median_db,
        color=colour,
        linewidth=1.0,
        linestyle=":",
        label="median fingertip",
    )
    axes.set_xlim(0.0, FARTHEST_MM)
    axes.set_ylim(QUIETEST_DB, LOUDEST_DB)
    axes.set_xlabel("distance from the finger / mm")
    axes.set_ylabel("RMS displacement / dB of the finger's")
    axes.set_title(chain.caption, fontsize=10, color=INK)
    axes.legend(frameon=False, fontsize=8, loc="upper right")
