"""What a finger feels of the shipped boards, what pressing changes, and what foam costs.

    .venv/bin/python bench/finger.py         prints tables, writes docs/images/finger.png

Drives are the best for SSIM at places of a 6 mm grid over `prototype`. Times are ratios of medians,
five runs each in turn, one core.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from chladni.drives.methods.base import Options
from chladni.drives.methods.phasor import phasor
from chladni.drives.problem.problem import solved_board
from chladni.drives.problem.region_grid import region_grid
from chladni.drives.scoring.felt import Felt, felt
from chladni.drives.scoring.spread import Spread
from chladni.host.figures.fields import COLOURS, draw_board, save
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import FINGERS
from chladni.sim.board.foundation import Foundation
from chladni.sim.board.parts import Actuator, Image, Magnet, Regions
from chladni.sim.fields.transfer import transfer_fields

ROOT = Path(__file__).resolve().parents[1]
PITCH = 6e-3
THICKNESSES_MM = (1.6, 1.0, 0.8, 0.6, 0.5, 0.4)
RUNS = 5


def felt_everywhere(board: Board) -> tuple[list[tuple[float, float]], list[Felt]]:
    """Places, and what is felt at each with the best drive for SSIM."""
    grid = region_grid(board)
    targets = [grid.centre_mm(region) for region in range(grid.count)]
    problems = solved_board(board).problems(targets, with_finger=True)
    return targets, [felt(one, phasor(one, Options("ssim")).drive) for one in problems]


def spread(values: list[float]) -> str:
    """Median and what 10 % lie below and above."""
    own = Spread.of(values)
    return f"{own.median:.3g} ({own.p10:.2g} to {own.p90:.2g})"


def fingers_by_thickness(board: Board) -> dict[str, list[list[float]]]:
    """Change of level at every place, by finger and thickness."""
    result: dict[str, list[list[float]]] = {name: [] for name in FINGERS if name != "none"}
    for thickness in THICKNESSES_MM:
        thin = replace(
            board,
            plate=replace(board.plate, thickness=thickness * 1e-3),
            regions=Regions(2.0 * PITCH),
        )
        for name, levels in result.items():
            _, found = felt_everywhere(replace(thin, finger=FINGERS[name]))
            levels.append([one.finger_load.level_db for one in found])
    return result


def sixteen(board: Board, foundation: Foundation | None) -> Board:
    """A pad of 50 mm and 0.2 mm, sixteen coils 11 mm apart, off every mirror."""
    rng = np.random.default_rng(0)
    places = [(11e-3 * (k - 1.5), 11e-3 * (j - 1.5)) for k in range(4) for j in range(4)]
    moved = np.array(places) + rng.uniform(-3e-4, 3e-4, (16, 2))
    actuators = tuple(
        Actuator(f"c{k}", (float(x), float(y))) for k, (x, y) in enumerate(moved.tolist())
    )
    return replace(
        board,
        plate=replace(board.plate, size=(0.05, 0.05), thickness=2e-4),
        screws=(),
        magnet=Magnet(3e-3, 4e-3, 7500.0, 1000.0),
        actuators=actuators,
        image=Image((126, 126)),
        electronics=replace(board.electronics, pwm_pins=(), sign_pins=()),
        panel=None,
        foundation=foundation,
    )


def foam_rows(board: Board) -> list[str]:
    """Seconds of sixteen fields with foam, as so many times those without."""
    kinds = {
        "none": None,
        "foam everywhere": Foundation(3e7, 0.1),
        "foam, a hole of 5 mm round every coil": Foundation(3e7, 0.1, coil_cut_out=5e-3),
    }
    boards = {name: sixteen(board, own) for name, own in kinds.items()}
    seconds: dict[str, list[float]] = {name: [] for name in kinds}
    for _ in range(RUNS):
        for name, own in boards.items():
            started = time.perf_counter()
            transfer_fields(own, allow_unmet=True)
            seconds[name].append(time.perf_counter() - started)
    plain = statistics.median(seconds["none"])
    return [
        f"| {name} | {statistics.median(own):.2f} | {statistics.median(own) / plain:.2f} |"
        for name, own in seconds.items()
    ]


def draw(
    board: Board,
    places: list[tuple[float, float]],
    found: list[Felt],
    by_finger: dict[str, list[list[float]]],
) -> Figure:
    """A map of micrometres, and what fingers change by the plate's thickness."""
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.5))
    x, y = np.array(places).T
    levels = np.log10(np.maximum([one.finger_um or 0.0 for one in found], 1e-3))
    dots = left.scatter(x, y, c=levels, cmap="viridis", s=70, marker="s", vmin=-2.0, vmax=0.6)
    draw_board(left, board, ink="black")
    left.set_title("µm under the finger, at most", fontsize=10)
    bar = figure.colorbar(dots, ax=left)
    bar.set_ticks([-2.0, -1.0, 0.0], labels=["0.01", "0.1", "1"])
    for colour, (name, levels_of) in zip(COLOURS, by_finger.items(), strict=False):
        bands = np.array([np.percentile(own, (10, 50, 90)) for own in levels_of])
        right.plot(THICKNESSES_MM, bands[:, 1], color=colour, marker="o", label=f"{name} finger")
        right.fill_between(THICKNESSES_MM, bands[:, 0], bands[:, 2], color=colour, alpha=0.2)
    right.set_xlabel("thickness, mm")
    right.set_ylabel("change of level by pressing, dB")
    right.set_title("median and 80 % of places", fontsize=10)
    right.legend(frameon=False, fontsize=9)
    return figure


def main() -> None:
    """Print the tables, write the figure."""
    board = replace(load_board("prototype"), regions=Regions(PITCH))
    places, found = felt_everywhere(board)
    print("| of `prototype`, best drives for SSIM | median (10 % to 90 % of places) |\n|---|---|")
    print(f"| µm under the finger | {spread([one.finger_um or 0.0 for one in found])} |")
    print(f"| dB above the threshold | {spread([one.sensation_db or 0.0 for one in found])} |")
    print(f"| µm by the bias | {spread([one.static_um or 0.0 for one in found])} |")
    for name, key in (
        ("level, dB", "level_db"),
        ("SSIM", "ssim"),
        ("second finger, dB", "second_finger_db"),
    ):
        changes = [getattr(one.finger_load, key) for one in found]
        print(f"| the usual finger changes: {name} | {spread(changes)} |")
    print()
    by_finger = fingers_by_thickness(board)
    print("| thickness, mm | " + " | ".join(f"{name} finger, dB" for name in by_finger) + " |")
    print("|---|" + "---|" * len(by_finger))
    for k, thickness in enumerate(THICKNESSES_MM):
        cells = [spread(levels[k]) for levels in by_finger.values()]
        print(f"| {thickness:g} | " + " | ".join(cells) + " |")
    print("\n| sixteen coils, no mirror | s | times without |\n|---|---|---|")
    print("\n".join(foam_rows(load_board("prototype"))))
    save(draw(board, places, found, by_finger), ROOT / "docs" / "images" / "finger.png")


if __name__ == "__main__":
    main()
