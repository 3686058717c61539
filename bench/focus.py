"""Drives that focus: certified gap and time a place, against a general cone solver.

    .venv/bin/python bench/focus.py          prints tables, writes docs/images/focus.png

Clarabel gets what no caller has: the margin that ours reached, and forms that are there. It solves
with discs of a fingertip so far apart, and is measured on all discs, 1 mm apart, as ours is. An
error is what a drive's silence or margin lacks of the bound that ours proves. Both run in turn on
the same places, one core, in the processor's own time.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import resource
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.methods.focus import GAP_DB, Focused, focus_at
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.host.figures.fields import COLOURS, save
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import Active, Focus
from chladni.sim.image import metrics

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from cone_program import solved_cones  # noqa: E402

ComplexArray = NDArray[np.complex128]
Place = tuple[float, float]

PLACES = {"strip5": 12, "pad16": 6, "phone15": 4}
SPACINGS_MM = {"strip5": (4, 2, 1), "pad16": (6, 4, 3), "phone15": (12, 6)}
"""Of the discs that the cone solver gets; closer ones take it minutes a place."""
SEED = 0
SCORED = ("strip5", "pad16")


@dataclass(frozen=True)
class Run:
    """One place."""

    seconds: float
    error_db: float


def places_of(solved: SolvedBoard, count: int) -> list[Place]:
    """Places drawn from the active area, m."""
    board = solved.board
    half = np.array(board.plate.size) / 2.0 - (board.active or Active()).margin
    drawn = np.random.default_rng(SEED).uniform(-half, half, (count, 2)).tolist()
    return [(x, y) for x, y in drawn]


def mean_under(solved: SolvedBoard, place: Place) -> ComplexArray:
    """The mean of W under a finger per newton of each coil."""
    board = solved.board
    disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
    return np.asarray(solved.fields.values[:, disc].mean(axis=1))


def ours(solved: SolvedBoard, place: Place) -> tuple[Run, Focused]:
    """Time one search."""
    mean = mean_under(solved, place)
    started = time.process_time()
    found = focus_at(solved, place, mean)
    seconds = time.process_time() - started
    assert found is not None
    return Run(seconds, max(found.gap_db, 0.0)), found


def cones(solved: SolvedBoard, place: Place, known: Focused, spacing_mm: int) -> Run:
    """The same by clarabel, with discs so far apart."""
    discs, asked = solved.second_fingers, solved.board.focus or Focus()
    mean, limit = mean_under(solved, place), float(np.abs(known.drive).max())
    apart = discs.distances(place)
    is_far, is_near = apart >= asked.silent_from, apart >= asked.quieter_from
    index = np.rint(discs.centres / (spacing_mm * 1e-3)) * spacing_mm * 1e-3
    is_taken = np.all(np.abs(discs.centres - index) < 0.3e-3, axis=1)
    far = discs.forms[is_far & is_taken] * limit**2
    near = discs.forms[is_near & ~is_far & is_taken] * limit**2
    cap = 10.0 ** (-min(known.margin_db, 60.0) / 10.0)
    started = time.process_time()
    _, drive, _ = solved_cones(mean * limit, far, near, cap, 1.0)
    seconds = time.process_time() - started
    squares = discs.mean_squares(drive * limit)
    ratio, margin = (-10.0 * np.log10(squares[zone].max()) for zone in (is_far, is_near & ~is_far))
    lacks = max(known.bound_db - ratio, known.margin_db - margin, 0.0)
    return Run(seconds, float(lacks))


def row(board: str, method: str, runs: list[Run], own: list[Run]) -> None:
    """One line of the table."""
    times = [run.seconds * 1e3 for run in runs]
    errors = [run.error_db for run in runs]
    ratio = statistics.median(times) / statistics.median(run.seconds * 1e3 for run in own)
    print(
        f"| {board} | {method} | {statistics.median(times):.3g} | {max(times):.3g} "
        f"| {statistics.median(errors):.3f} | {max(errors):.3f} | {ratio:.3g} |",
        flush=True,
    )


def board_rows(name: str) -> dict[str, list[Run]]:
    """Ours and the cone solver on one board."""
    solved = solved_board(load_board(name))
    _ = solved.second_fingers
    places = places_of(solved, PLACES[name])
    ours(solved, places[0])  # nothing is loaded or made for the first time afterwards
    found: dict[str, list[Run]] = {}
    for place in places:
        run, known = ours(solved, place)
        found.setdefault("ours", []).append(run)
        for spacing in SPACINGS_MM[name]:
            by_cones = cones(solved, place, known, spacing)
            found.setdefault(f"clarabel, discs {spacing} mm apart", []).append(by_cones)
    for method, runs in found.items():
        row(name, method, runs, found["ours"])
    return found


def draw(found: dict[str, dict[str, list[Run]]]) -> Figure:
    """Error against time of every place."""
    figure = Figure(figsize=(7.5, 4.5), layout="constrained")
    axes = figure.subplots()
    for (name, methods), colour in zip(found.items(), COLOURS, strict=False):
        for method, runs in methods.items():
            is_own = method == "ours"
            axes.loglog(
                [run.seconds * 1e3 for run in runs],
                [max(run.error_db, 1e-4) for run in runs],
                "o" if is_own else "x",
                color=colour,
                markersize=5,
                label=f"{name}, {'ours' if is_own else 'clarabel'}"
                if is_own or method.endswith(f"{SPACINGS_MM[name][0]} mm apart")
                else None,
            )
    axes.axhline(GAP_DB, color="#999999", linewidth=0.8, linestyle="--")
    axes.set_xlabel("ms a place, one core")
    axes.set_ylabel("below the bound, dB")
    axes.legend(frameon=False, fontsize=8)
    return figure


def score_seconds(name: str) -> tuple[float, float]:
    """Processor's and wall clock's seconds of `chladni board score` without tolerances."""
    command = (sys.executable, "-m", "chladni.host.cli.app", "board", "score", name,
               "--no-perturbed", "--json")  # fmt: skip
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    wall, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, wall


def main() -> None:
    """Print the tables, write the figure."""
    print("## Drives that focus: certified gap against time\n")
    print("![What a drive lacks of the bound, against time](../images/focus.png)\n")
    print(
        "*Below the bound*: a drive's silence or margin below the bound that our solver proves, "
        f"on discs 1 mm apart (limit {GAP_DB:g} dB). Places are drawn from the active area. "
        "Clarabel, a general cone solver, gets the largest possible margin. Its time leaves out "
        "making the discs. Times are the processor's.\n"
    )
    print(
        "| board | solver | ms, median | ms, largest | below the bound, dB: median | largest "
        "| times ours |\n|---|---|---|---|---|---|---|"
    )
    found = {name: board_rows(name) for name in PLACES}
    print("\nGoal: 20 ms a place on 5 coils, 100 ms on 16.\n")
    print(
        "`chladni board score` at 6 mm pitch, without tolerances. Goal: 3 s for 5 coils, 15 s "
        "for 16:\n"
    )
    print("| board | coils | processor s | wall clock s |\n|---|---|---|---|")
    for name in SCORED:
        own, wall = score_seconds(name)
        print(f"| {name} | {len(load_board(name).actuators)} | {own:.1f} | {wall:.1f} |")
    print()
    save(draw(found), ROOT / "docs" / "images" / "focus.png")


if __name__ == "__main__":
    main()
