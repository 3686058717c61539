"""Drives: SSIM against time and evaluations, for the default, annealings, and the baselines.

    .venv/bin/python bench/solve.py          prints tables, writes docs/images/solve.png

One core, `prototype` unless a table says otherwise. The four targets of the paper and 40 others,
drawn with a seed the solver's numbers were not chosen on. The reference of every target is the best
of 200 random starts, each climbed to its top (tests/random_starts.py). Times are of the
search alone; the target's own field is stated apart. About fifteen minutes, most of it annealing.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import statistics
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from chladni.drives.batch import over_targets
from chladni.drives.checkpoint import Result
from chladni.drives.methods import METHODS, Options
from chladni.drives.methods.anneal import read_trace
from chladni.drives.problem.problem import Problem, SolvedBoard, solved_board
from chladni.host.figures.fields import COLOURS, save
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.tables.stored_regions import stored_regions

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from random_starts import best_of_random_starts  # noqa: E402

PAPER_TARGETS = {
    (10.0, 25.0): (0.8886, 0.8636),
    (20.0, -25.0): (0.9554, 0.9541),
    (-25.0, -10.0): (0.9110, 0.8803),
    (10.0, 0.0): (0.9668, 0.9450),
}
"""Best of an independent multi-start on a finite-element field, and the authors' best."""
OTHERS, SEED = 40, 77
DUAL_STEPS, CLIMB_STEPS = (100, 300, 1000, 3000, 10_000), (2, 4, 8, 16, 40)
PAPER_SECONDS = 8.5 * 3600.0
ANNEALED = ("anneal", "phasor-anneal", "dual-annealing")
CLOSED = (
    "gerchberg-saxton",
    "least-squares",
    "time-reversal",
    "inverse-filter",
    "nearest",
    "contrast",
)


@dataclass(frozen=True)
class Run:
    """One method on one target."""

    seconds: float
    evaluations: int
    ssim: float


def targets_of(solved: SolvedBoard) -> list[tuple[float, float]]:
    """The paper's targets and random ones, 1 mm from the edges at least."""
    half = np.array(solved.board.plate.size) / 2.0 / MM - 1.0
    places = np.random.default_rng(SEED).uniform(-half, half, size=(OTHERS, 2))
    return [*PAPER_TARGETS, *((float(x), float(y)) for x, y in places)]


def run(problem: Problem, method: str, options: Options) -> Run:
    """Time one search; SSIM by the kernel on the full image."""
    started = time.perf_counter()
    found = METHODS[method](problem, options)
    seconds = time.perf_counter() - started
    space = problem.solved.space
    objective = space.objective(space.levels[-1], problem.image)
    return Run(seconds, found.evaluations, space.value(objective, found.drive))


def default_table(name: str) -> tuple[list[Problem], list[float], list[Run]]:
    """The default against the best of 200 starts."""
    solved = solved_board(load_board(name))
    targets = targets_of(solved)
    started = time.perf_counter()
    problems = list(solved.problems(targets))
    field_ms = (time.perf_counter() - started) / len(targets) * 1e3
    for problem in problems:
        _ = problem.image, problem.disc
    best = [
        best_of_random_starts(problem, np.random.default_rng([SEED, k]))
        for k, problem in enumerate(problems)
    ]
    runs = [run(problem, "phasor", Options()) for problem in problems]
    gaps = np.array([b - r.ssim for b, r in zip(best, runs, strict=True)])
    ms = np.array([r.seconds for r in runs]) * 1e3
    print(
        f"| {name} | {np.median(ms):.1f} | {ms.max():.1f} | {np.mean(gaps < 1e-4) * 100:.1f} % "
        f"| {max(gaps.max(), 0.0):.1e} | {field_ms:.1f} |",
        flush=True,
    )
    return problems, best, runs


def methods_table(
    problems: list[Problem], best: list[float], default: list[Run]
) -> dict[str, list[Run]]:
    """Every method's SSIM, time and evaluations over all targets."""
    results = {"phasor": default}
    for method in (*ANNEALED, *CLOSED):
        results[method] = [run(problem, method, Options()) for problem in problems]
        print(f"{method} done", file=sys.stderr, flush=True)
    print("| method | SSIM, mean | below the best: median | largest | evaluations | seconds |")
    print("|---|---|---|---|---|---|")
    for method, runs in results.items():
        gaps = [b - r.ssim for b, r in zip(best, runs, strict=True)]
        print(
            f"| {method} | {statistics.mean(r.ssim for r in runs):.4f} "
            f"| {max(statistics.median(gaps), 0.0):.4f} | {max(gaps):.4f} "
            f"| {statistics.median(r.evaluations for r in runs):.0f} "
            f"| {statistics.median(r.seconds for r in runs):.4f} |"
        )
    return results


def level_table(problems: list[Problem], best: list[float]) -> None:
    """What it costs to stop on a coarser image."""
    print("| last image | points | SSIM below the best: median | largest | ms |")
    print("|---|---|---|---|---|")
    for level in problems[0].solved.space.levels:
        runs = [run(problem, "phasor", Options(finest=level.step)) for problem in problems]
        gaps = [top - r.ssim for top, r in zip(best, runs, strict=True)]
        print(
            f"| ÷{level.step} | {level.index_x.size} × {level.index_y.size} "
            f"| {max(statistics.median(gaps), 0.0):.1e} | {max(gaps):.1e} "
            f"| {statistics.median(r.seconds for r in runs) * 1e3:.1f} |"
        )


def paper_table(default: list[Run], annealed: list[Run]) -> None:
    """The paper's own targets."""
    print(
        "| target / mm | SSIM | independent, FE field | our annealing | authors' best | ms "
        "| sooner than the paper's 8.5 h |\n|---|---|---|---|---|---|---|"
    )
    for (target, (known, authors)), ours, chain in zip(
        PAPER_TARGETS.items(), default, annealed, strict=False
    ):
        print(
            f"| {target[0]:g}, {target[1]:g} | {ours.ssim:.4f} | {known:.4f} | {chain.ssim:.4f} "
            f"| {authors:.4f} | {ours.seconds * 1e3:.1f} "
            f"| {PAPER_SECONDS / ours.seconds:,.0f} × |"
        )


def traces(problem: Problem) -> tuple[Figure, float]:
    """SSIM against time for the paper's first target, and the annealing's seconds to its best."""
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.subplots()
    settled = float("nan")
    for method, colour in zip(ANNEALED[:2], COLOURS, strict=False):
        with tempfile.TemporaryDirectory() as folder:
            trace = Path(folder) / "trace.npz"
            took = run(problem, method, Options(trace=trace)).seconds
            best = np.maximum.accumulate(read_trace(trace)[0].ssim)
        seconds = np.linspace(0.0, took, best.size)
        if method == "anneal":
            settled = float(seconds[np.argmax(best >= best[-1] - 1e-6)])
        axes.plot(np.maximum(seconds, took / best.size), best, color=colour, label=method)
    dual = [
        run(problem, "dual-annealing", Options(steps=n)) for n in (100, 300, 1000, 3000, 10_000)
    ]
    axes.plot(
        [r.seconds for r in dual],
        [r.ssim for r in dual],
        "s-",
        color=COLOURS[2],
        label="dual-annealing",
    )
    ours = [run(problem, "phasor", Options(steps=n)) for n in CLIMB_STEPS]
    axes.plot(
        [r.seconds for r in ours], [r.ssim for r in ours], "o-", color=COLOURS[3], label="phasor"
    )
    axes.set_xscale("log")
    axes.set_xlabel("seconds, one core")
    axes.set_ylabel("SSIM, target (10, 25) mm")
    axes.legend(frameon=False)
    return figure, settled


def board_drives(board: Board) -> list[Result]:
    """The drive of every region, mirrored ones once, from the board file's numbers on."""
    solved, regions = SolvedBoard.of(board), stored_regions(board)
    targets = [regions.grid.centre_mm(int(region)) for region in regions.numbers]

    def work(problem: Problem) -> Result:
        return {"evaluations": METHODS["phasor"](problem, Options()).evaluations}

    return list(over_targets(solved, targets, work))


def main() -> None:
    """Print the tables, write the figure."""
    print("## Drives: SSIM against time and evaluations\n")
    print("![SSIM against time](../images/solve.png)\n")
    print("The default against the best that 200 random starts find, 44 targets a board:\n")
    print("| board | ms, median | ms, largest | within 1e-4 | largest gap | its field, ms |")
    print("|---|---|---|---|---|---|")
    default_table("paper")
    problems, best, default = default_table("prototype")
    print("\nEvery method on the same 44 targets of `prototype`; annealings take 10 000 steps:\n")
    results = methods_table(problems, best, default)
    print("\nThe paper's targets:\n")
    paper_table(results["phasor"], results["anneal"])
    figure, settled = traces(problems[0])
    ratio = settled / statistics.median(r.seconds for r in default)
    print(
        f"\nOn (10, 25) our annealing reaches its final value after {settled:.2f} s, "
        f"{ratio:,.0f} times the default's time.\n"
    )
    print("What a coarser last image costs:\n")
    level_table(problems, best)
    print("\nThe drives of whole boards, 406 regions, all cores, plate included:\n")
    print("| board | seconds |\n|---|---|")
    lopsided = load_board("prototype")
    first, *others = lopsided.actuators
    moved = replace(first, at=(1.5e-3, 2e-3))
    boards = {
        "paper": load_board("paper"),
        "prototype": load_board("prototype"),
        "prototype, its centre coil moved: no mirror": replace(
            lopsided, actuators=(moved, *others)
        ),
    }
    for name, board in boards.items():
        seconds = []
        for _ in range(3):
            started = time.perf_counter()
            board_drives(board)
            seconds.append(time.perf_counter() - started)
        print(f"| {name} | {statistics.median(seconds):.1f} |")
    print()
    save(figure, ROOT / "docs" / "images" / "solve.png")


if __name__ == "__main__":
    main()
