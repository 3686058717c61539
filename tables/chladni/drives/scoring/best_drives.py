"""The best drive of every place of a board, each found once for all its images in the mirrors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.drives.batch import over_targets
from chladni.drives.methods import Options
from chladni.drives.methods.focus import focus_at
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.threads import in_threads, one_blas_thread
from chladni.drives.scoring.survey import Place
from chladni.sim.board.quantity import MM
from chladni.sim.image import metrics

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
