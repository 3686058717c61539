"""A solved place: what was wanted, what the drive makes, the coils, and the scorecard."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Circle

from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.scorecard import Scorecard
from chladni.drives.solve import Solution
from chladni.host.figures.fields import (
    COLOURS,
    INK,
    board_inches,
    draw_board,
    draw_image,
    explain_marks,
    is_wide,
    maximum_mm,
    rim_of,
    with_verdict,
)
from chladni.host.figures.searches import draw_trace
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image.metrics import FINGERTIP_RADIUS

LARGEST_INCHES = (5.0, 5.4)
"""Of a picture of the board."""
PUSHED = "Target: the finger's place pushed.\nThe plate's own shape may move the maximum."
NUMBERS_INCHES = 4.4
"""Width of coils and scorecard."""


def solution_figure(
    board: Board,
    solution: Solution,
    card: Scorecard,
    *,
    trace: Path | None = None,
    verdict: str = "",
) -> Figure:
    """Target image, the drive's image, gains and phases of the coils, and the scorecard.

    Parameters
    ----------
    card
        Of the solution.
    trace
        File of an annealing's trace, to be drawn below.
    verdict
        What it comes to, in words, for above.
    """
    width, height = board_inches(board, LARGEST_INCHES)
    count = (2, 1) if is_wide(board) else (1, 2)
    size = (count[1] * (width + 0.8), max(count[0] * (height + 1.1), 5.2))
    figure = Figure(
        figsize=(size[0] + NUMBERS_INCHES, size[1] + (2.6 if trace else 0.0)), layout="constrained"
    )
    upper: Figure | SubFigure = figure
    if trace is not None:
        upper, lower = np.asarray(figure.subfigures(2, 1, height_ratios=[size[1], 2.6])).tolist()
        draw_trace(lower.subplots(), trace)
    left, right = np.asarray(
        upper.subfigures(1, 2, width_ratios=[size[0], NUMBERS_INCHES])
    ).tolist()
    images = np.asarray(left.subplots(*count)).tolist()
    titles = (PUSHED, "Made by the coils")
    for axes, field, title in zip(
        images, (solution.target_field, solution.field), titles, strict=True
    ):
        drawn = draw_image(axes, board, field)
        draw_board(axes, board, target_mm=solution.target_mm, maximum_mm=maximum_mm(board, field))
        axes.set_title(title, fontsize=10, color=INK)
        axes.set_ylabel("y / mm")
    problem = solved_board(board).problem(solution.target_mm)
    second = problem.solved.second_fingers.loudest(solution.drive, problem.place)
    if second is not None:
        outline = Circle(
            (second[0] / MM, second[1] / MM), FINGERTIP_RADIUS / MM, fill=False, color="white"
        )
        images[1].add_patch(outline).set(linestyle="--", path_effects=rim_of("white"))
    left.colorbar(drawn, ax=images, label="energy image, share of its range", shrink=0.6)
    explain_marks(left, board, target=True, maximum=True, second=second is not None)
    coils, sheet = np.asarray(right.subplots(2, 1, height_ratios=[1.0, 1.3])).tolist()
    _draw_coils(coils, board, solution)
    _write_scorecard(sheet, solution, card)
    x, y = solution.target_mm
    title = f"{board.name}: {solution.method} for ({x:g}, {y:g}) mm"
    figure.suptitle(with_verdict(figure, title, verdict), fontsize=10, color=INK)
    return figure


def _draw_coils(axes: Axes, board: Board, solution: Solution) -> None:
    """A bar of each coil's gain, with its phase above."""
    names = [actuator.name for actuator in board.actuators]
    gains = np.abs(solution.drive)
    colours = [COLOURS[k % len(COLOURS)] for k in range(len(names))]
    axes.bar(range(len(names)), gains, color=colours)
    for k, phase in enumerate(np.degrees(np.angle(solution.drive))):
        axes.annotate(
            f"{phase:.0f}°",
            (k, gains[k]),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            fontsize=7,
            color=INK,
        )
    axes.set_xticks(range(len(names)), names, fontsize=7, rotation=30, ha="right")
    axes.set_xlabel("coil")
    axes.set_ylabel("gain")
    axes.margins(y=0.15)
    axes.set_title("Coils, and their phases", fontsize=10, color=INK)


def _write_scorecard(axes: Axes, solution: Solution, card: Scorecard) -> None:
    """The scorecard's numbers, with what each is."""
    rows = [
        ("distance from target to maximum", f"{card.focal_error_mm:.1f} mm"),
        ("level over any other finger", f"{card.second_finger_db:+.1f} dB"),
        ("contrast", f"{card.contrast_db:.1f} of {card.contrast_limit_db:.1f} dB"),
        ("area above half the maximum", f"{card.spot_mm2:.0f} mm²"),
    ]
    felt = card.felt
    if felt is not None and felt.finger_um is not None and felt.full_volts is not None:
        rows += [
            ("displacement under the finger", f"{felt.finger_um:.2f} µm"),
            ("voltage at the loudest coil", f"{felt.full_volts:.2f} V"),
        ]
    if felt is not None and felt.sensation_db is not None:
        rows.append(("level above the threshold of feeling", f"{felt.sensation_db:+.1f} dB"))
    images = [
        ("SSIM", f"{card.ssim:.3f}"),
        ("SSIM of the nearest coil alone", f"{card.nulls.nearest_actuator:.3f}"),
    ]
    # An image comes first where it is what was asked for.
    rows = images + rows if solution.objective == "ssim" else rows + images
    axes.set_axis_off()
    table = axes.table(
        [[name, value] for name, value in rows],
        loc="upper center",
        cellLoc="left",
        colWidths=[0.66, 0.34],
        edges="horizontal",
    )
    table.auto_set_font_size(False)
    table.set_fontsize(8)
    table.scale(1.0, 1.25)
    axes.set_title("Scorecard", fontsize=10, color=INK)
