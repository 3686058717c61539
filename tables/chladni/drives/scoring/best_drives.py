"""The best drive of every place of a board, each found once for all its images in the mirrors.

Those of tables make up for what a pressing finger changes, where that is much.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.drives.batch import over_targets
from chladni.drives.methods import Options
from chladni.drives.methods.focus import focus_at
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.problem.pressing import pressed_problem
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.region_grid import region_grid
from chladni.drives.problem.threads import in_threads, one_blas_thread
from chladni.drives.scoring.felt import FingerLoad, finger_load
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import Place
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import NO_FINGER
from chladni.sim.board.quantity import MM
from chladni.sim.image import metrics

SURVEYED, SURVEY_SEED = 24, 1
"""Places where pressing is looked at, drawn from all: the 10th percentile is the third worst."""
COSTS_SSIM, COSTS_SECOND_FINGER_DB = 0.01, 0.5
"""What a finger may take at the 10th percentile of places until drives make up for it."""
ComplexArray = NDArray[np.complex128]
IndexArray = NDArray[np.intp]


def best_drives(
    solved: SolvedBoard, places: Sequence[Place], objective: str, seed: int
) -> list[ComplexArray]:
    """The best drive of every place, of any scale."""
    if objective != "focus":
        targets = [(x / MM, y / MM) for x, y in places]
        solver, options = OBJECTIVES[objective], Options(objective, seed)
        work = over_targets(solved, targets, lambda one: {"drive": solver(one, options).drive})
        return [one["drive"] for one in work]
    images = [mirrored(solved, place) for place in places]
    solved = solved.for_focus
    board, values = solved.board, solved.fields.values
    _ = solved.second_fingers  # found once, before there are threads

    def one(place: Place) -> ComplexArray:
        disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
        focused = focus_at(solved, place, values[:, disc].mean(axis=1))
        return np.ones(len(values), np.complex128) if focused is None else focused.drive

    stored = list(dict.fromkeys(own for own, _ in images))
    with one_blas_thread():
        found = dict(zip(stored, in_threads(one, stored), strict=True))
    return [found[own][order] for own, order in images]


def table_drives(
    solved: SolvedBoard, places: Sequence[Place], objective: str, seed: int
) -> tuple[list[ComplexArray], bool]:
    """The drives that a table has for places, and whether they make up for a finger's load."""
    if solved.board.finger == NO_FINGER:
        return best_drives(solved, places, objective, seed), False
    grid = region_grid(solved.board)
    targets = [grid.centre_mm(region) for region in surveyed(grid.count)]
    at_regions = best_drives(solved, [(x * MM, y * MM) for x, y in targets], objective, seed)
    problems = solved.problems(targets, with_finger=True)
    loads = [
        finger_load(problem, np.tensordot(drive, problem.transfer, axes=1))
        for problem, drive in zip(problems, at_regions, strict=True)
    ]
    if not needs_compensation(solved.board, load_spreads(loads)):
        return best_drives(solved, places, objective, seed), False
    solver, options = OBJECTIVES[objective], Options(objective, seed)
    images = [mirrored(solved, place) for place in places]
    stored = list(dict.fromkeys(own for own, _ in images))
    work = over_targets(
        solved,
        [(x / MM, y / MM) for x, y in stored],
        lambda one: {"drive": solver(pressed_problem(one), options).drive},
        with_finger=True,
    )
    found = dict(zip(stored, (one["drive"] for one in work), strict=True))
    return [found[own][order] for own, order in images], True


def surveyed(count: int) -> list[int]:
    """Which of so many places are looked at."""
    return [int(k) for k in np.random.default_rng(SURVEY_SEED).permutation(count)[:SURVEYED]]


def load_spreads(loads: Sequence[FingerLoad]) -> dict[str, Spread]:
    """What pressing changes, over places."""
    names = ("level_db", "ssim", "second_finger_db")
    return {name: Spread.of([getattr(one, name) for one in loads]) for name in names}


def needs_compensation(board: Board, loads: Mapping[str, Spread]) -> bool:
    """Whether pressing takes so much that drives are to make up for it."""
    return board.finger != NO_FINGER and (
        loads["ssim"].p10 < -COSTS_SSIM or loads["second_finger_db"].p10 < -COSTS_SECOND_FINGER_DB
    )


def mirrored(solved: SolvedBoard, place: Place) -> tuple[Place, IndexArray]:
    """The place's image in the board's mirrors at large x and y, and the order of coils there.

    A drive of the image is that of the place once its coils are put in this order.
    """
    order = np.arange(len(solved.board.actuators))
    own = [round(along, 9) for along in place]
    for axis, mirror in enumerate(solved.mirrors):
        if mirror is not None and own[axis] < 0.0:
            own[axis], order = -own[axis], order[list(mirror)]
    return (own[0], own[1]), order
