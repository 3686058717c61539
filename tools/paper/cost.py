"""What a drive for one place takes here, and what the authors' way of holding patterns takes."""

from __future__ import annotations

import resource
import subprocess
import sys
from statistics import median

from chladni.drives.methods.anneal import PHASES
from chladni.drives.problem.problem import solved_board
from chladni.drives.solve import solve
from paper import authors, boards
from paper.numbers import Numbers, fixed

THEIR_BYTES = 100e9
"""What the authors' program held."""
ROUNDS = 5


def numbers() -> Numbers:
    """What follows from sizes alone."""
    board = boards.computed()
    fields = solved_board(board).fields.values
    patterns = len(board.actuators) * PHASES
    frame = 8 * board.x.size * board.y.size
    return {
        "patterns": fixed(patterns),
        "frames": fixed(THEIR_BYTES / (patterns * frame)),
        "fields_mb": fixed(fields.nbytes / 1e6, 1),
        "points": f"{board.x.size} × {board.y.size}",
    }


def measured() -> Numbers:
    """Time and memory on this machine, which no check compares.

    To be asked for first: a child's largest memory counts what its parent had when it began.
    """
    command = [
        sys.executable,
        "-m",
        "chladni.host.cli.app",
        "solve",
        "prototype",
        "--target=10,25",
        "--json",
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    board = boards.computed()
    # The shortest of several, since other work on the machine only adds to it.
    times = [
        min(solve(board, run.target_mm).seconds for _ in range(ROUNDS))
        for run in authors.short_runs()
    ]
    return {
        "measured_ms": fixed(1e3 * median(times)),
        "measured_s": fixed(used.ru_utime + used.ru_stime, 1),
        "measured_mb": fixed(used.ru_maxrss / 1e3),
    }
