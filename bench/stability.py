"""Estimate against error for random boards of every kind: no wrong field may be called right.

    .venv/bin/python bench/stability.py --boards 200 --jobs 2

A board is a pure function of its seed, which is printed. Its fields at the default tolerance are
compared with those of the largest basis there is. Prints a table by kind and every seed whose
estimate is below its error or far above it, and draws docs/images/stability.png.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from common.random_boards import KINDS, Draw
from matplotlib.figure import Figure

from chladni.host.figures import save
from chladni.sim import Board, ChladniError, board_from_document
from chladni.sim.board.checks import closest
from chladni.sim.cost import allow_large_cost
from chladni.sim.errors import WORST_ESTIMATE
from chladni.sim.fields.board_plate import plate_geometry
from chladni.sim.fields.transfer import TOLERANCE, actuator_loads
from chladni.sim.plate.loads import Load
from chladni.sim.ritz.basis.resolution import LEVELS, resolution_for, wave_number
from chladni.sim.ritz.plate import RitzPlate

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "sim")]
from test_random_against_elements import SEEDS, compared  # noqa: E402  (found by the line above)

FINEST = (LEVELS - 3, LEVELS - 1)
"""Levels of the basis that stands for the truth: of polynomials, of functions on circles."""
MUCH_ABOVE, NEGLIGIBLE = 100.0, 0.1
"""An estimate may be so many times the error, or below this share of the tolerance."""


@dataclass(frozen=True)
class Case:
    """One board: how it came out."""

    seed: int
    kind: str
    error: float
    estimate: float
    seconds: float
    refused: str = ""


def board_of_seed(seed: int) -> Board:
    """The board of a seed."""
    return board_from_document(Draw(seed).document())


def tried(seed: int) -> Case:
    """One board: its estimate, and its error against the largest basis."""
    kind = KINDS[seed % len(KINDS)]
    begun = time.perf_counter()
    try:
        board = board_of_seed(seed)
        geometry, loss = plate_geometry(board), board.plate.loss_factor
        loads = [*actuator_loads(board)[:4], Load(*(board.plate.size[k] * 0.21 for k in (0, 1)))]
        asked = {"frequency_hz": board.drive.frequency_hz, "x": board.x, "y": board.y}
        found = RitzPlate(geometry, loss).respond(loads, **asked, tolerance=TOLERANCE)
        seconds = time.perf_counter() - begun
        if found.error_estimate > WORST_ESTIMATE:
            why = f"estimate {found.error_estimate:.2g}, {closest(board)}"
            return Case(seed, kind, 0.0, 0.0, seconds, why)
        waves = wave_number(geometry, 2.0 * np.pi * board.drive.frequency_hz)
        finest = RitzPlate(geometry, loss, resolution_for(geometry, waves, *FINEST))
        allow_large_cost(True)
        exact = finest.respond(loads, **asked, tolerance=1e-12).values
        norms = np.linalg.norm(exact, axis=(1, 2))
        error = float(np.max(np.linalg.norm(found.values - exact, axis=(1, 2)) / norms))
        return Case(seed, kind, error, found.error_estimate, seconds)
    except ChladniError as refusal:
        return Case(seed, kind, 0.0, 0.0, time.perf_counter() - begun, str(refusal))
    finally:
        allow_large_cost(False)


def is_low(case: Case) -> bool:
    """Whether the estimate is below the error."""
    return case.estimate < case.error


def is_high(case: Case) -> bool:
    """Whether it is far above, where that matters."""
    return case.estimate > max(MUCH_ABOVE * case.error, NEGLIGIBLE * TOLERANCE)


def figure_of(cases: list[Case]) -> Figure:
    """Estimate against error."""
    figure = Figure(figsize=(6.5, 5.5), layout="constrained")
    axes = figure.subplots()
    for kind in KINDS:
        own = [case for case in cases if case.kind == kind and not case.refused]
        axes.loglog(
            [max(c.error, 1e-12) for c in own],
            [c.estimate for c in own],
            "o",
            ms=4,
            label=kind,
            alpha=0.7,
        )
    line = np.array([1e-10, 1.0])
    axes.loglog(line, line, "k-", lw=0.8)
    axes.axhline(TOLERANCE, color="k", ls=":", lw=0.8)
    axes.set_xlabel("error against the largest basis")
    axes.set_ylabel("estimate")
    axes.legend(frameon=False)
    return figure


def print_comparisons() -> None:
    """Twenty boards against the tests' finite elements on two meshes."""
    found = [compared(seed) for seed in SEEDS]
    held = sum(own.error <= own.estimate + own.meshes for own in found)
    print(
        f"\nOf {len(found)} random boards solved by finite elements too {held} agree within the\n"
        "estimate and the elements' own error (tests/sim/test_random_against_elements.py):\n"
    )
    print("| seed | two meshes differ by | ours and the finer one | estimate |\n|---|---|---|---|")
    for seed, own in zip(SEEDS, found, strict=True):
        print(f"| {seed} | {own.meshes:.1e} | {own.error:.1e} | {own.estimate:.1e} |")


def main() -> None:
    """Draw boards, try them, print and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--boards", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.boards)
    with ProcessPoolExecutor(options.jobs) as pool:
        cases = list(pool.map(tried, seeds))
    print("## Stability\n")
    print("| kind | boards | refused | estimate below error | far above | unmet | median s |")
    print("|---|---|---|---|---|---|---|")
    for kind in KINDS:
        own = [case for case in cases if case.kind == kind and not case.refused]
        refused = sum(bool(case.refused) for case in cases if case.kind == kind)
        print(
            f"| {kind} | {len(own)} | {refused} | {sum(map(is_low, own))} "
            f"| {sum(map(is_high, own))} | {sum(c.estimate > TOLERANCE for c in own)} "
            f"| {np.median([c.seconds for c in own] or [np.nan]):.1f} |"
        )
    print()
    for case in cases:
        if case.refused or is_low(case) or is_high(case) or case.estimate > TOLERANCE:
            why = case.refused or f"error {case.error:.2g}, estimate {case.estimate:.2g}"
            print(f"- seed {case.seed} ({case.kind}): {why}, {case.seconds:.1f} s")
    print_comparisons()
    save(figure_of(cases), ROOT / "docs" / "images" / "stability.png")


if __name__ == "__main__":
    main()
