"""Draw what the README opens with: a finger on `pad16`, the field of the PWM, level over distance.

    python tools/pictures/finger.py     writes docs/images/finger-on-pad.png

The chain is the whole one: table, emulated firmware, duties, plate.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch
from matplotlib.transforms import Affine2D

from chladni.host.emulation.closed_loop import run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.figures.chains import profile
from chladni.host.figures.fields import COLOURS, INK, draw_level, save
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.image import metrics
from chladni.tables.build import build_table

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "finger-on-pad.png"
BOARD = "pad16"
TOUCHED_MM = (-8.0, 9.0)
QUIETEST_DB = -30.0
FINGER_DEG = 32.0
"""How far the finger is turned from pointing up."""


def draw_finger(axes: Axes, at: tuple[float, float]) -> None:
    """A fingertip at a place, as seen from above."""
    radius = metrics.FINGERTIP_RADIUS / MM
    long = 60.0
    shape = FancyBboxPatch(
        (-radius, -long),
        2.0 * radius,
        long + radius,
        boxstyle=f"round,pad=0,rounding_size={radius}",
        facecolor="#f2c9ac",
        edgecolor="#8a5a3c",
        alpha=0.4,
        linewidth=1.2,
    )
    turn = Affine2D().rotate_deg(FINGER_DEG).translate(*at)
    shape.set_transform(turn + axes.transData)
    axes.add_patch(shape)


def draw_board_level(axes: Axes, board: Board, level: np.ndarray) -> None:
    """The board from above, in dB of what is under the finger."""
    half = [side / 2.0 / MM for side in board.plate.size]
    image = draw_level(axes, board, level, QUIETEST_DB, 0.0)
    assert board.magnet is not None
    for actuator in board.actuators:
        x, y = np.divide(actuator.at, MM)
        axes.add_patch(
            Circle(
                (x, y),
                board.magnet.radius / MM,
                fill=False,
                edgecolor="white",
                linewidth=0.8,
                alpha=0.8,
            )
        )
    draw_finger(axes, TOUCHED_MM)
    axes.set_xlim(-half[0], half[0])
    axes.set_ylim(-half[1], half[1])
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")
    axes.set_title("What moves", fontsize=11, color=INK)
    bar = axes.figure.colorbar(image, ax=axes, shrink=0.85)
    bar.set_label("vibration / dB of the finger's")


def main() -> None:
    """Play a touch and draw it."""
    board = load_board(BOARD)
    table, _ = build_table(board)
    _, loop = run_loop(table, board, [TouchEvent(20.0, TOUCHED_MM)], 300.0)
    field = np.abs(loop.field)
    target = (TOUCHED_MM[0] * MM, TOUCHED_MM[1] * MM)
    own = field[metrics.disc_mask(board.x, board.y, target, metrics.FINGERTIP_RADIUS)]
    level = 20.0 * np.log10(np.maximum(field / np.sqrt(np.mean(own**2)), 1e-6))
    figure = Figure(figsize=(10.0, 4.2))
    figure.set_layout_engine("constrained", wspace=0.06)
    left, right = figure.subplots(1, 2, width_ratios=[1.05, 1.0])
    draw_board_level(left, board, level)
    found = profile(board, loop.field, TOUCHED_MM)
    right.axvspan(0.0, metrics.SECOND_FINGER_DISTANCE / MM, color="#eeeeee", zorder=0)
    right.text(6.0, QUIETEST_DB + 1.0, "the finger", ha="center", fontsize=9, color=INK)
    right.plot(
        found.distance_mm,
        found.loudest_db,
        color=COLOURS[0],
        linewidth=2.0,
        label="loudest place at that distance",
    )
    right.plot(
        found.distance_mm,
        found.median_db,
        color=COLOURS[0],
        linewidth=1.0,
        linestyle=":",
        label="usual place",
    )
    right.set_xlim(0.0, 45.0)
    right.set_ylim(QUIETEST_DB, 2.0)
    right.set_xlabel("distance from the finger / mm")
    right.set_ylabel("vibration under another finger / dB")
    right.set_title("What another finger gets", fontsize=11, color=INK)
    right.legend(frameon=False, fontsize=9)
    save(figure, PICTURE)


if __name__ == "__main__":
    main()
