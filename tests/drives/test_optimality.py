"""Evidence that the default finds the best there is: random starts look for something better."""

from __future__ import annotations

import joblib
import numpy as np
import pytest

from chladni.drives.methods import Options
from chladni.drives.methods.phasor import phasor
from chladni.drives.problem.problem import solved_board
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from random_starts import best_of_random_starts
from soaking import IS_SOAKING, seed, tries

TARGETS = tries(8, 16)
SAME = 1e-4
"""Of SSIM: a hundredth of what a quantiser costs."""
MOST, OFTEN = (1e-2, 0.2) if IS_SOAKING else (2e-3, 0.1)
"""Of 184 places of `prototype` drawn at random, five were missed by more than SAME, the worst by
2.5e-4. Which they are turns with the last digits of the fields, and sweeps go everywhere."""
PAPER_TARGETS = [(10.0, 25.0), (20.0, -25.0), (-25.0, -10.0), (10.0, 0.0)]


@pytest.mark.sweep
@pytest.mark.parametrize("name", ["prototype", "paper"])
def test_random_starts_find_nothing_better(request: pytest.FixtureRequest, name: str) -> None:
    """At targets drawn at random and at the paper's own."""
    board: Board = request.getfixturevalue(name)
    solved = solved_board(board)
    rng = np.random.default_rng(seed(2026))
    half = np.array(board.plate.size) / 2.0 / MM - 1.0
    places = rng.uniform(-half, half, size=(TARGETS - len(PAPER_TARGETS), 2))
    problems = list(solved.problems([*PAPER_TARGETS, *((float(x), float(y)) for x, y in places)]))
    _ = solved.space
    full = solved.space.levels[-1]
    searched = joblib.Parallel(n_jobs=-1, prefer="threads")(
        joblib.delayed(best_of_random_starts)(problem, np.random.default_rng([7, k]))
        for k, problem in enumerate(problems)
    )
    losses = []
    for problem, best in zip(problems, searched, strict=True):
        objective = solved.space.objective(full, problem.image)
        losses.append(best - solved.space.value(objective, phasor(problem, Options()).drive))
    worst = int(np.argmax(losses))
    assert losses[worst] < MOST, f"{problems[worst].target_mm}: {losses[worst]:.5f}"
    assert np.count_nonzero(np.array(losses) > SAME) <= OFTEN * TARGETS
