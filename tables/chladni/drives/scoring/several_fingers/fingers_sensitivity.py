"""What parts that are not as drawn do to two pressing fingers, their drives unchanged."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers.responses import responses_at
from chladni.drives.methods import SEED, Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.sensitivity import PLACES, Influence, variants_of
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet, finger_sets
from chladni.drives.scoring.several_fingers.fingers_score import solver_of
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.image.finger import PRESS, pressing_stiffness

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def fingers_sensitivity(
    board: Board, *, seed: int = SEED, progress: Progress | None = None
) -> list[Influence]:
    """What each parameter does to two fingers' levels and isolation, the least isolation first.

    `PLACES` sets of two are drawn, as far apart as the board has fingers, both pressing with 1 N.

    Raises
    ------
    ArgumentError
        The board has no room for two fingers.
    """
    rng = np.random.default_rng(seed)
    sets = finger_sets(board, 2, PLACES, board.fingers_apart, rng)
    solved = solved_board(board)
    stiffness = pressing_stiffness(PRESS, board.drive.frequency_hz)
    with one_blas_thread():
        solve = solver_of(board, responses_at(solved), None)
        drives = [solve(own) for own in sets]

    def rows(plate: SolvedBoard, forces: FloatArray) -> FloatArray:
        """Isolation and level of each finger of each set, dB; (fingers, 2)."""
        with one_blas_thread():
            found = zip(FingerSet.of_all(plate, sets, stiffness), drives, strict=True)
            return np.concatenate([_numbers(own, known * forces) for own, known in found])

    plain = rows(solved, np.ones(len(board.actuators)))
    ends: dict[tuple[str, str], list[FloatArray]] = {}
    variants = variants_of(board, rng)
    for number, variant in enumerate(variants, 1):
        is_plate = variant.gains is None
        plate = SolvedBoard.of(variant.board, DRAWN_TOLERANCE) if is_plate else solved
        forces = np.ones(len(board.actuators)) if variant.gains is None else variant.gains.real
        ends.setdefault((variant.name, variant.tolerance), []).append(rows(plate, forces))
        if progress:
            progress(number, len(variants))
    result = [
        Influence(
            name,
            tolerance,
            level_db=max(
                float(np.percentile(np.abs(one[:, 1] - plain[:, 1]), 90.0)) for one in own
            ),
            isolation_db=min(_worst_tenth(one) for one in own) - _worst_tenth(plain),
        )
        for (name, tolerance), own in ends.items()
    ]
    return sorted(result, key=lambda one: one.isolation_db or 0.0)


def _worst_tenth(rows: FloatArray) -> float:
    """Isolation as boards are scored by it, and not of each pair: the best ones lose the most."""
    return float(np.percentile(rows[:, 0], 10.0))


def _numbers(fingers: FingerSet, drives: ComplexArray) -> FloatArray:
    own = np.abs(np.diag(fingers.means(drives)))
    return np.stack((fingers.isolation_db(drives), 20.0 * np.log10(own)), axis=1)
