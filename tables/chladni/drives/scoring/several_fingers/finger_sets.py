"""What fingers of a set feel of drives while all of them press: the plate solved with them on it.

A finger at j pushes back with Z times the mean displacement u_j under it, evenly over its contact.
With g(p, j) what a newton there does at a place p, and h what each coil does,

    u = (1 + Z ḡ)⁻¹ h̄,   h′(p) = h(p) − Σ_j g(p, j) Z u_j,

where bars are means over fingertips: a rank-one change a finger, exact (fields_under_finger).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import TOGETHER, SolvedBoard
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ArgumentError
from chladni.sim.image import metrics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

TRIES = 10_000
"""A set is drawn so often until the board counts as too small for it."""


@dataclass(frozen=True)
class FingerSet:
    """Fingers on a board, all of them pressing.

    Attributes
    ----------
    places
        Their middles, m, shape (fingers, 2).
    discs
        What each coil does at the image points under each fingertip (6 mm radius, clipped at the
        board's edges), with all fingers on the plate: complex128, shape (points, actuators), m/N.
    """

    places: FloatArray
    discs: list[ComplexArray]

    @classmethod
    def of(cls, solved: SolvedBoard, places: FloatArray, stiffness: complex) -> FingerSet:
        """The set of fingers at places (fingers, 2), m, that push back with `stiffness`, N/m."""
        return next(cls.of_all(solved, np.asarray(places)[None], stiffness))

    @classmethod
    def of_all(
        cls, solved: SolvedBoard, sets: FloatArray, stiffness: complex
    ) -> Iterator[FingerSet]:
        """Many sets (sets, fingers, 2), m; fields of several sets are found in one go."""
        at_once = max(1, TOGETHER // sets.shape[1])
        for first in range(0, len(sets), at_once):
            group = sets[first : first + at_once]
            targets = [(float(x / MM), float(y / MM)) for x, y in group.reshape(-1, 2)]
            answers = solved.under_finger(targets)
            for places, own in zip(
                group, answers.reshape(*group.shape[:2], *answers.shape[1:]), strict=True
            ):
                yield cls(places, _loaded_discs(solved, places, own, stiffness))

    def shares(self, drives: ComplexArray) -> FloatArray:
        """RMS over each finger's disc by drives (drives, actuators), N; (drives, fingers), m."""
        moved = [np.abs(drives @ disc.T) ** 2 for disc in self.discs]
        return np.asarray(np.sqrt(np.stack([own.mean(axis=1) for own in moved], axis=1)))

    def means(self, drives: ComplexArray) -> ComplexArray:
        """Mean displacement of each disc by drives (drives, actuators), N; (drives, fingers), m."""
        return np.stack([drives @ disc.mean(axis=0) for disc in self.discs], axis=1)

    def isolation_db(self, drives: ComplexArray) -> FloatArray:
        """Own share over the largest share under another finger, dB; (fingers,); alone, 300.

        Drive k (fingers, actuators) is that of finger k.
        """
        shares = self.shares(drives)
        own = np.diag(shares)
        others = np.where(np.eye(len(own), dtype=bool), 0.0, shares).max(axis=1)
        return np.array(
            [
                metrics.decibel((a / b) ** 2) if b > 0.0 else -metrics.FLOOR_DB
                for a, b in zip(own.tolist(), others.tolist(), strict=True)
            ]
        )


def pressed_fields(solved: SolvedBoard, places: FloatArray, stiffness: complex) -> ComplexArray:
    """What each coil does at all image points with fingers at places (fingers, 2), m, on the plate.

    complex128, shape (actuators, x, y), m/N.
    """
    targets = [(float(x / MM), float(y / MM)) for x, y in places]
    answers, transfer = solved.under_finger(targets), solved.fields.values
    masks = finger_discs(solved.board, places)
    back = pushed_back(
        [transfer[:, mask].mean(axis=1) for mask in masks],
        [answers[:, mask].mean(axis=1) for mask in masks],
        stiffness,
    )
    return np.asarray(transfer - np.tensordot(back.T, answers, axes=1))


def finger_discs(board: Board, places: FloatArray) -> list[NDArray[np.bool_]]:
    """Image points under each fingertip of places (fingers, 2), m."""
    radius = metrics.FINGERTIP_RADIUS
    return [metrics.disc_mask(board.x, board.y, (x, y), radius) for x, y in places.tolist()]


def pushed_back(
    free: Sequence[ComplexArray], pushes: Sequence[ComplexArray], stiffness: complex | ComplexArray
) -> ComplexArray:
    """Z u of each finger for a newton of each coil, shape (…, fingers, actuators).

    Parameters
    ----------
    free, pushes
        For each finger the mean over its disc of what coils do, shape (…, actuators), and of what
        a newton of each finger does, shape (…, fingers).
    stiffness
        Z, N/m; one, or of shape (…, 1, 1).
    """
    means, pairs = np.stack(free, axis=-2), np.stack(pushes, axis=-2)
    return np.asarray(stiffness * np.linalg.solve(np.eye(len(free)) + stiffness * pairs, means))


def _loaded_discs(
    solved: SolvedBoard, places: FloatArray, answers: ComplexArray, stiffness: complex
) -> list[ComplexArray]:
    transfer = solved.fields.values
    masks = finger_discs(solved.board, places)
    free = [transfer[:, mask].T for mask in masks]
    pushes = [answers[:, mask].T for mask in masks]
    back = pushed_back(
        [own.mean(axis=0) for own in free], [own.mean(axis=0) for own in pushes], stiffness
    )
    return [own - push @ back for own, push in zip(free, pushes, strict=True)]


def finger_sets(
    board: Board, count: int, sets: int, apart: float, rng: np.random.Generator
) -> FloatArray:
    """Draw sets of places at which fingers may lie together.

    Parameters
    ----------
    count
        Fingers of a set.
    sets
        How many.
    apart
        Least distance of two middles, m.

    Returns
    -------
    float64, shape (sets, count, 2), m; uniform over the active area, sets with fingers too near to
    each other rejected.

    Raises
    ------
    ArgumentError
        The board has no room for such sets, or for so few of them that none was drawn.
    """
    low, high = np.transpose(board.active_area)
    near: Sequence[tuple[int, int]] = [(a, b) for b in range(count) for a in range(b)]
    found = np.empty((sets, count, 2))
    for own in found:
        for _ in range(TRIES):
            own[:] = rng.uniform(low, high, size=(count, 2))
            if all(np.hypot(*(own[a] - own[b])) >= apart for a, b in near):
                break
        else:
            expected = f"less: {count} fingers have no room on this board"
            across = (
                f"its active area is {np.hypot(*(high - low)) / MM:.0f} mm from corner to corner"
            )
            raise ArgumentError("apart", f"{apart / MM:g} mm", expected, hint=across)
    return found
