"""Figures 5A and 5B: the paper's four targets, and the parts that add up to the first."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.scorecard import Scorecard, score
from chladni.drives.solve import Solution, solve
from chladni.host.figures.fields import INK, draw_board, draw_displacement, draw_image, save
from paper import authors, boards
from paper.numbers import Numbers, fixed


@cache
def solutions() -> dict[tuple[float, float], tuple[Solution, Scorecard]]:
    """Our best drive for each of the paper's targets, and its scorecard."""
    board = boards.computed()
    found = {}
    for run in authors.short_runs():
        solution = solve(board, run.target_mm)
        found[run.target_mm] = solution, score(solution, board)
    return found


def numbers() -> Numbers:
    """Scores of the four targets, numbered from 1 as they come in the paper."""
    found: Numbers = {}
    cards = [card for _, card in solutions().values()]
    for k, (run, card) in enumerate(zip(authors.short_runs(), cards, strict=True), 1):
        x, y = run.target_mm
        found |= {
            f"target_{k}": f"{fixed(x)}, {fixed(y)}",
            f"first_{k}": fixed(run.first, 3),
            f"authors_{k}": fixed(run.best, 3),
            f"ssim_{k}": fixed(card.ssim, 3),
            f"theirs_off_{k}": "–" if run.maximum_off_mm is None else str(run.maximum_off_mm),
            f"silent_{k}": fixed(card.nulls.silent, 2),
            f"nearest_{k}": fixed(card.nulls.nearest_actuator, 2),
            f"focal_{k}": fixed(card.focal_error_mm),
            f"second_{k}": fixed(card.second_finger_db, 1),
            f"louder_{k}": fixed(100.0 * card.louder_fraction),
        }
    return found | {
        "authors_mean": fixed(float(np.mean([run.best for run in authors.short_runs()])), 2),
        "silent_most": fixed(max(card.nulls.silent for card in cards), 2),
        "focal_most": fixed(max(card.focal_error_mm for card in cards)),
        "ssim_mean": fixed(float(np.mean([card.ssim for card in cards])), 2),
    }


def _drive() -> list[str]:
    """Gain and phase of every actuator for the first target, in words."""
    (first, _), *_ = solutions().values()
    gains, phases = np.abs(first.drive), np.degrees(np.angle(first.drive))
    return [
        f"{actuator.name} {fixed(gain, 1)} at {fixed(phase)}°"
        for actuator, gain, phase in zip(boards.computed().actuators, gains, phases, strict=True)
    ]


def draw(folder: Path) -> None:
    """Both figures."""
    save(_targets(), folder / "paper-5a.png")
    save(_parts(), folder / "paper-5b.png")


def _targets() -> Figure:
    board = boards.computed()
    figure = Figure(figsize=(9.5, 9.8), layout="constrained")
    rows = figure.subplots(2, len(solutions()), sharex=True, sharey=True)
    for upper, lower, (place, (solution, card)) in zip(*rows, solutions().items(), strict=True):
        for axes, field in ((upper, solution.field), (lower, solution.target_field)):
            draw_image(axes, board, field)
            draw_board(axes, board, target_mm=place, small=True)
        upper.set_xlabel("")
        upper.set_title(
            f"SSIM {card.ssim:.3f}\nmaximum {card.focal_error_mm:.0f} mm off",
            fontsize=10,
            color=INK,
        )
        lower.set_title("target", fontsize=10, color=INK)
    rows[0, 0].set_ylabel("composite\ny / mm")
    rows[1, 0].set_ylabel("target\ny / mm")
    return figure


def _parts() -> Figure:
    board = boards.computed()
    (solution, _), *_ = solutions().values()
    fields = solved_board(board).fields.values
    newton = boards.newtons_per_gain(board) / board.drive.max_gain
    # The drive's phase is such that the target is farthest out at this instant.
    parts = newton * (solution.drive[:, None, None] * fields).real
    figure = Figure(figsize=(13.0, 5.2), layout="constrained")
    panels = figure.subplots(1, len(parts) + 3, sharey=True)
    total = parts.sum(axis=0)
    scale = float(np.abs(np.concatenate([parts, total[None]])).max())
    for axes, instant, title in zip(
        panels, [*parts, total], [*_drive(), "their sum"], strict=False
    ):
        drawn = draw_displacement(axes, board, instant, scale=scale)
        draw_board(axes, board, target_mm=solution.target_mm, ink="black", small=True)
        axes.set_title(title.replace(" ", "\n", 1), fontsize=10, color=INK)
    figure.colorbar(
        drawn,
        ax=panels.tolist(),
        label="displacement / µm",
        location="bottom",
        shrink=0.3,
        aspect=40,
    )
    for axes, field, title in (
        (panels[-2], solution.field, "its energy"),
        (panels[-1], solution.target_field, "target"),
    ):
        draw_image(axes, board, field)
        draw_board(axes, board, target_mm=solution.target_mm, small=True)
        axes.set_title(title, fontsize=10, color=INK)
    panels[0].set_ylabel("y / mm")
    return figure
