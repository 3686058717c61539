"""Two fingers on boards: what moves while one of them plays and the other rests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Circle

from chladni.drives.scoring.several_fingers.fingers_play import FingersPlay, fingers_play
from chladni.drives.scoring.several_fingers.fingers_score import CountScore
from chladni.host.figures.fields import (
    INK,
    board_inches,
    draw_board,
    draw_level,
    explain_marks,
    is_wide,
    pictures,
    with_verdict,
)
from chladni.host.figures.outlines import clip_to_plate
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image.metrics import FINGERTIP_RADIUS

QUIETEST_DB, LOUDEST_DB = -50.0, 10.0
"""Of the playing finger's: elsewhere, as at an edge, a plate may move more."""
NAMES = ("A", "B")
MOST_INCHES, BETWEEN_INCHES = (3.4, 4.6), (0.5, 0.8)
"""Of a picture of a board, and what its axes and title take."""
LEAST_INCHES = 2.06
"""A title's width."""
SHOWN_SHARE = 95.0
"""Percentile of isolation at which a map's colours end."""


def two_fingers_figure(plays: Sequence[FingersPlay], title: str = "") -> Figure:
    """For each board two pictures: finger A plays and B rests, and the other way round.

    Side by side, or below each other if it is one board that is wide. One board's name stands above
    them, or a title of one's own.
    """
    figure, panels = _panels([own.board for own in plays])
    image: AxesImage | None = None
    for number, play in enumerate(plays):
        for own in range(len(NAMES)):
            axes = panels[len(NAMES) * number + own]
            image = _panel(axes, play, own)
            axes.set_title(_told(play, own, len(plays)), fontsize=9.5, color=INK)
    if image is not None:
        bar = figure.colorbar(image, ax=panels, shrink=0.8, extend="both")
        bar.set_label("vibration / dB of the playing finger's", fontsize=9)
        explain_marks(figure, *(own.board for own in plays))
    if len(plays) == 1:
        title = title or f"{plays[0].board.name}: two fingers"
        figure.suptitle(with_verdict(figure, "", title).strip(), fontsize=10, color=INK)
    return figure


def _panels(boards: Sequence[Board]) -> tuple[Figure, list[Axes]]:
    if len(boards) == 1 and is_wide(boards[0]):
        return pictures(boards[0], len(NAMES))
    rooms = [board_inches(own, MOST_INCHES) for own in boards]
    width = max(*(own[0] for own in rooms), LEAST_INCHES) + BETWEEN_INCHES[0]
    count = len(boards) * len(NAMES)
    size = (count * width, max(own[1] for own in rooms) + BETWEEN_INCHES[1])
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(1, count, squeeze=False)[0].tolist()


def pairs_figure(board: Board, two: CountScore, verdict: str = "", newtons: float = 1.0) -> Figure:
    """What drawn pairs of fingers get on a board: two examples, and where what is kept.

    Parameters
    ----------
    two
        The score of two fingers.
    verdict
        What it comes to, in words, above the pictures.
    newtons
        How hard the fingers of the examples press.
    """
    figure, panels = pictures(board, 3)
    order = np.argsort(two.rows[:, 0])
    for axes, share, name in zip(panels, (0.5, 0.1), ("median", "worst tenth"), strict=False):
        place, own = divmod(int(order[int(share * (len(order) - 1))]), 2)
        play = fingers_play(board, two.places[place], two.drives[place], newtons)
        image = _panel(axes, play, own)
        where = ", ".join(
            f"{named} at {x:z.0f}, {y:z.0f} mm"
            for named, (x, y) in zip(NAMES, play.places_mm, strict=True)
        )
        label = f"{name}: {NAMES[own]} plays, {NAMES[1 - own]} rests\n{_amounts(play, own)}"
        axes.set_title(f"{label}\n{where}", fontsize=9, color=INK)
        bar = figure.colorbar(image, ax=axes, shrink=0.8, extend="both")
        bar.set_label("dB of the playing finger's", fontsize=9)
    _map(figure, panels[2], board, two, order)
    explain_marks(figure, board)
    title = f"{board.name}: two fingers, {two.sets} pairs drawn"
    figure.suptitle(with_verdict(figure, title, verdict), fontsize=10, color=INK)
    return figure


def _map(figure: Figure, axes: Axes, board: Board, two: CountScore, order: np.ndarray) -> None:
    """A point for each finger of each pair, the least kept on top."""
    x, y = two.places.reshape(-1, 2)[order[::-1]].T / MM
    isolation = two.rows[order[::-1], 0]
    most = float(np.percentile(isolation, SHOWN_SHARE))
    draw_board(axes, board, ink=INK, small=True)
    clip_to_plate(axes, board)
    points = axes.scatter(
        x, y, c=isolation, s=26, cmap="cividis", vmin=0.0, vmax=max(most, 1.0), zorder=3
    )
    bar = figure.colorbar(points, ax=axes, shrink=0.8, extend="both")
    bar.set_label("dB less", fontsize=9)
    label = "less under the other finger, at each\nplace at which a finger plays"
    axes.set_title(label, fontsize=9, color=INK)


def _panel(axes: Axes, play: FingersPlay, own: int) -> AxesImage:
    image = draw_level(axes, play.board, play.levels_db[own], QUIETEST_DB, LOUDEST_DB)
    draw_board(axes, play.board, small=True)
    radius = FINGERTIP_RADIUS / MM
    for finger, (x, y) in enumerate(play.places_mm):
        colour = "#d55e00" if finger == own else "white"
        axes.add_patch(Circle((x, y), radius, fill=False, edgecolor=colour, linewidth=2.2))
        axes.annotate(
            NAMES[finger],
            (x, y),
            ha="center",
            va="center",
            color=colour,
            fontsize=11,
            fontweight="bold",
        )
    axes.set_xlabel("x / mm", fontsize=9)
    axes.set_ylabel("y / mm", fontsize=9)
    return image


def _told(play: FingersPlay, own: int, boards: int) -> str:
    name = f"{play.board.name}: " if boards > 1 else ""
    return f"{name}{NAMES[own]} plays, {NAMES[1 - own]} rests\n{_amounts(play, own)}"


def _amounts(play: FingersPlay, own: int) -> str:
    um, db = play.finger_um[own], play.isolation_db[own]
    moved = f"{NAMES[own]} {um:.2g} µm, " if np.isfinite(um) else ""
    return f"{moved}{NAMES[1 - own]} {db:.0f} dB less"
