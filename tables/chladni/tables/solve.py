"""Five complex numbers for one target: the drive whose energy image is most like a point's.

The paper searches 1800 integer gains for hours. Its gains add up to one complex number per
actuator, so the search here has 2 · actuators real variables, an exact gradient, and takes well
under a second: several starts climb a coarse image, the best few a finer one, one the full one.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from chladni.sim import metrics
from chladni.sim.board import Board
from chladni.sim.errors import InputError
from chladni.sim.response import PlateModel
from chladni.sim.transfer import (
    TransferFields,
    check_target,
    plate_model,
    target_field,
    transfer_fields,
)  # fmt: skip
from chladni.tables.objective import WINDOW, SsimObjective

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

METHODS = ("phasor", "least-squares")
LEVELS = (8, 4, 2, 1)
"""Each level keeps every k-th image point; the last is the image that is scored."""
SURVIVORS = (3, 2, 1, 1)
"""Climbs carried on from each level."""
STEPS = (30, 25, 20, 10)
"""Quasi-Newton steps at most per climb and level: the coarse ones travel, the fine ones settle."""
RANDOM_STARTS = 2
SEED = 20240160
RIDGE = 1e-6
"""Least squares damps directions the actuators drive this much less than the strongest."""


@dataclass(frozen=True)
class Scene:
    """A board with its plate solved and its actuators' fields: shared by all targets."""

    board: Board
    model: PlateModel
    fields: TransferFields


@dataclass(frozen=True)
class Solution:
    """A drive for one target.

    Attributes
    ----------
    target_mm
        Where the vibration is to be.
    method
        One of `METHODS`.
    drive
        complex128, shape (actuators,): gain · exp(i·phase). The largest gain is the board's
        `max_gain`; the common phase makes the displacement at the target real and positive.
    field
        Displacement on the image points, complex128, shape (nx, ny), m.
    target_field
        The field of a unit load at the target, same shape, m/N.
    ssim
        Of the two energy images at full size.
    evaluations
        Objective evaluations on any image size.
    seconds
        Time of the search alone; the target's own field is not counted.
    """

    target_mm: tuple[float, float]
    method: str
    drive: ComplexArray
    field: ComplexArray
    target_field: ComplexArray
    ssim: float
    evaluations: int
    seconds: float


@lru_cache(maxsize=4)
def scene_of(board: Board) -> Scene:
    """Solve a board's plate once."""
    model = plate_model(board)
    return Scene(board, model, transfer_fields(board, model=model))


def solve(
    board: Board,
    target_mm: tuple[float, float],
    *,
    method: str = "phasor",
    seed: int = SEED,
    steps: int | None = None,
) -> Solution:
    """Find the drive that best focuses the board's vibration at a target.

    Parameters
    ----------
    board
        The board.
    target_mm
        Place on the board, mm from its centre.
    method
        `phasor` (default) climbs SSIM; `least-squares` is its first start alone.
    seed
        Of the random starts; the same seed gives the same drive.
    steps
        Quasi-Newton steps per climb and level, in place of the built-in numbers.

    Raises
    ------
    InputError
        Target off the board, unknown method.
    """
    if method not in METHODS:
        raise InputError("method", method, "one of: " + ", ".join(METHODS))
    if seed < 0:
        raise InputError("seed", seed, "a whole number of at least 0")
    if steps is not None and steps < 1:
        raise InputError("steps", steps, "a whole number of at least 1")
    place = check_target(board, target_mm)
    scene = scene_of(board)
    wanted = target_field(board, target_mm, model=scene.model).values[0]
    started = time.perf_counter()
    transfer = scene.fields.values
    search = _Search(transfer, wanted, steps)
    if method == "least-squares":
        drive = least_squares(transfer, wanted)
    else:
        disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
        starts = _starts(board, transfer, wanted, disc, np.random.default_rng(seed))
        drive = search.climb(starts)
    seconds = time.perf_counter() - started
    drive = gauge(board, scene.fields, drive, place)
    field = np.tensordot(drive, transfer, axes=1)
    score = metrics.ssim(np.abs(field), np.abs(wanted))
    return Solution(
        target_mm, method, drive, field, wanted, score, max(search.evaluations, 1), seconds
    )


def gauge(
    board: Board, fields: TransferFields, drive: ComplexArray, place: tuple[float, float]
) -> ComplexArray:
    """Scale a drive to the board's `max_gain` and turn it so that the target moves in phase 0."""
    largest = np.abs(drive).max()
    if not np.isfinite(largest) or largest == 0.0:
        return np.zeros_like(drive)
    i = int(np.argmin(np.abs(fields.x - place[0])))
    j = int(np.argmin(np.abs(fields.y - place[1])))
    at_target = drive @ fields.values[:, i, j]
    if abs(at_target) < 1e-9 * np.abs(fields.values).max() * largest:
        at_target = drive[int(np.abs(drive).argmax())]
    return np.asarray(drive * (board.drive.max_gain / largest) * np.exp(-1j * np.angle(at_target)))


def least_squares(transfer: ComplexArray, wanted: ComplexArray) -> ComplexArray:
    """The drive whose complex field is nearest to the target's, lightly damped (Tikhonov)."""
    fields = transfer.reshape(transfer.shape[0], -1)
    gram = fields.conj() @ fields.T
    damping = RIDGE * np.trace(gram).real / gram.shape[0]
    return np.asarray(
        np.linalg.solve(gram + damping * np.eye(gram.shape[0]), fields.conj() @ wanted.ravel())
    )


def _starts(
    board: Board,
    transfer: ComplexArray,
    wanted: ComplexArray,
    disc: NDArray[np.bool_],
    rng: np.random.Generator,
) -> list[ComplexArray]:
    """Drives to climb from: least squares, best contrast, time reversal, one coil, random."""
    count = len(board.actuators)
    reversal = transfer[:, disc].mean(axis=1).conj()
    nearest = np.eye(count, dtype=np.complex128)[
        int(np.argmax(np.abs(transfer[:, disc]).mean(axis=1)))
    ]
    starts = [
        least_squares(transfer, wanted),
        metrics.best_contrast(transfer, disc)[1],
        reversal,
        nearest,
    ]
    for _ in range(RANDOM_STARTS):
        starts.append(rng.normal(size=count) + 1j * rng.normal(size=count) * 0.3)
    return [start / max(np.abs(start).max(), np.finfo(float).tiny) for start in starts]


class _Search:
    """Coarse-to-fine ascent of SSIM from many starts."""

    def __init__(self, transfer: ComplexArray, wanted: ComplexArray, steps: int | None) -> None:
        largest = np.abs(transfer).max()
        unit = transfer / largest if largest > 0.0 else transfer
        image = metrics.image_of(wanted)
        self._levels = []
        for level, survivors, limit in zip(LEVELS, SURVIVORS, STEPS, strict=True):
            index_x, index_y = (_every(level, size) for size in image.shape)
            if min(index_x.size, index_y.size) < 2 * WINDOW and level > 1:
                continue
            coarse = image[np.ix_(index_x, index_y)]
            objective = SsimObjective(unit[:, index_x][:, :, index_y], coarse)
            self._levels.append((objective, survivors, steps or limit))

    @property
    def evaluations(self) -> int:
        """Objective evaluations so far, on all levels."""
        return sum(objective.evaluations for objective, _, _ in self._levels)

    def climb(self, starts: Sequence[ComplexArray]) -> ComplexArray:
        """The best drive found from the starts."""
        drives = list(starts)
        for objective, survivors, limit in self._levels:
            ranked = [_ascend(objective, drive, limit) for drive in drives]
            ranked.sort(key=lambda item: -item[0])
            drives = _distinct([drive for _, drive in ranked])[:survivors]
        return drives[0]


def _every(step: int, size: int) -> NDArray[np.intp]:
    """Every `step`-th index, centred."""
    return np.arange((size - 1) % step // 2, size, step)


def _ascend(
    objective: SsimObjective, start: ComplexArray, limit: int
) -> tuple[float, ComplexArray]:
    """One quasi-Newton climb (BFGS) in the real and imaginary parts."""
    count = start.size

    def loss(vector: FloatArray) -> tuple[float, FloatArray]:
        value, slope = objective.value_and_gradient(vector[:count] + 1j * vector[count:])
        return -value, -np.concatenate((slope.real, slope.imag))

    first = np.concatenate((start.real, start.imag))
    result = minimize(
        loss, first, jac=True, method="BFGS", options={"maxiter": limit, "gtol": 1e-6}
    )
    drive = result.x[:count] + 1j * result.x[count:]
    largest = np.abs(drive).max()
    if not np.isfinite(largest) or largest == 0.0:
        return objective.value(start), start
    return -float(result.fun), drive / largest


def _distinct(drives: list[ComplexArray]) -> list[ComplexArray]:
    """Drives, best first, without those equal to a better one up to the common phase."""
    kept: list[ComplexArray] = []
    for drive in drives:
        unit = drive / np.linalg.norm(drive)
        if all(abs(np.vdot(unit, other / np.linalg.norm(other))) < 1.0 - 1e-5 for other in kept):
            kept.append(drive)
    return kept
