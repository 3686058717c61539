"""Time and SSIM of the solver on the paper's four targets, one core, medians of five runs.

    .venv/bin/python bench/solve.py

The baseline is the paper: 8–9 hours a target, and the SSIM its authors' annealing reached.
"""

from __future__ import annotations

import statistics

from chladni.sim.board_file import load_board
from chladni.tables.solve import solve

TARGETS = {(10.0, 25.0): 0.863, (20.0, -25.0): 0.954, (-25.0, -10.0): 0.855, (10.0, 0.0): 0.941}
PAPER_SECONDS = 8.5 * 3600.0
RUNS = 5


def main() -> None:
    """Print a row per target."""
    board = load_board("prototype")
    print("## Drives: the paper's four targets on `prototype`, search time alone\n")
    print("| target / mm | SSIM | authors' annealing | seconds | paper's 8.5 hours over ours |")
    print("|---|---|---|---|---|")
    for target, annealed in TARGETS.items():
        runs = [solve(board, target) for _ in range(RUNS)]
        seconds = statistics.median(run.seconds for run in runs)
        row = (
            f"| {target[0]:g}, {target[1]:g} | {runs[0].ssim:.4f} | {annealed:.3f} | {seconds:.3f}"
        )
        print(f"{row} | {PAPER_SECONDS / seconds:,.0f} |")


if __name__ == "__main__":
    main()
