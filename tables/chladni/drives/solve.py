"""A drive for a target: any method, in one gauge, scored on the full image."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods import METHODS, SEED, Options, Progress
from chladni.drives.objectives import OBJECTIVES, objective_of
from chladni.drives.problem.problem import Problem, solved_board
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import perhaps
from chladni.sim.errors import ArgumentError, check_estimate
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.image import metrics

ComplexArray = NDArray[np.complex128]

ON_MIRROR = 1e-9
"""A target this near to a mirror line, m, is on it."""
SAME_GAIN = 1e-3
"""Gains closer than this, by the largest, do not break a tie between mirrored drives."""


@dataclass(frozen=True)
class Solution:
    """A drive for one target.

    Attributes
    ----------
    target_mm
        Where the vibration is to be.
    method, objective
        Keys of `METHODS` and `OBJECTIVES`.
    drive
        complex128, shape (actuators,): gain · exp(i·phase). The largest gain is the board's
        `max_gain`; the common phase makes the displacement at the target real and positive.
    field
        Displacement on the image points, complex128, shape (nx, ny), m.
    target_field
        The field of a unit load at the target, same shape, m/N.
    ssim
        Of the two energy images at full size.
    error_estimate
        Largest relative L² error of the fields it was found with; `tolerance_met` is whether it
        is as small as fields should be.
    evaluations
        Objective evaluations on any image size.
    seconds
        Time of the search alone; the target's own field is not counted.
    details
        What the method itself reports, such as a condition number.
    """

    target_mm: tuple[float, float]
    method: str
    objective: str
    drive: ComplexArray
    field: ComplexArray
    target_field: ComplexArray
    ssim: float
    error_estimate: float
    evaluations: int
    seconds: float
    details: dict[str, float] = dataclasses.field(default_factory=dict)

    @property
    def tolerance_met(self) -> bool:
        """Whether the fields are as exact as they should be."""
        return self.error_estimate <= TOLERANCE


def solve(
    board: Board,
    target_mm: tuple[float, float],
    *,
    method: str = "phasor",
    objective: str | None = None,
    seed: int = SEED,
    steps: int | None = None,
    trace: Path | None = None,
    progress: Progress | None = None,
    allow_unmet: bool = False,
) -> Solution:
    """Find the drive that best focuses the board's vibration at a target.

    Parameters
    ----------
    board
        The board.
    target_mm
        Place on the board, mm from its centre.
    method
        A key of `METHODS`; `phasor`, or the objective's own solver, is the best there is, the
        others are there to compare.
    objective
        A key of `OBJECTIVES`, for the default method; that of `objective_of` by default.
    seed
        Of everything random; the same seed gives the same drive.
    steps
        In place of the method's own number of steps.
    trace
        File for the trace of an annealing; if it is there, the annealing goes on from it.
    progress
        Called with (done, all) by methods that take seconds.
    allow_unmet
        Go on with fields that do not meet their tolerance.

    Raises
    ------
    ToleranceError
        The estimated error of a field is above 5 %, or above its tolerance unless that is allowed.
    InputError
        Target off the board, unknown method or objective, a trace of something else.
    """
    objective = objective or objective_of(board, method)
    check_request(method, objective, seed, steps, trace)
    options = Options(objective, seed, steps, trace=trace, progress=progress)
    problem = solved_board(board).problem(target_mm)
    check_estimate(problem.error_estimate, TOLERANCE, allow_unmet=allow_unmet)
    return solve_problem(problem, method, options)


def check_request(
    method: str, objective: str, seed: int, steps: int | None, trace: Path | None
) -> None:
    """Refuse what no solve can do.

    Raises
    ------
    InputError
        Names the field, what came and what is known.
    """
    if method not in METHODS:
        known = "one of: " + ", ".join(METHODS)
        raise ArgumentError("method", method, known, hint=perhaps(method, METHODS))
    if objective not in OBJECTIVES:
        raise ArgumentError("objective", objective, "one of: " + ", ".join(OBJECTIVES))
    if method != "phasor" and objective != "ssim":
        raise ArgumentError(
            "objective", objective, f"ssim with the method {method}: it has no other"
        )
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ArgumentError("seed", seed, "a whole number of at least 0")
    if steps is not None and steps < 1:
        raise ArgumentError("steps", steps, "a whole number of at least 1")
    if trace is not None and not method.endswith("anneal"):
        raise ArgumentError(
            "trace", str(trace), "a trace with the methods anneal and phasor-anneal"
        )


def solve_problem(problem: Problem, method: str, options: Options) -> Solution:
    """Run one method on one problem; the default one stands for the objective's own solver."""
    started = time.perf_counter()
    solver = OBJECTIVES[options.objective] if method == "phasor" else METHODS[method]
    found = solver(problem, options)
    seconds = time.perf_counter() - started
    drive = gauge(problem, tie_break(problem, found.drive))
    driven = np.tensordot(drive, problem.transfer, axes=1)
    return Solution(
        target_mm=problem.target_mm,
        method=method,
        objective=options.objective,
        drive=drive,
        field=driven,
        target_field=problem.wanted,
        ssim=metrics.ssim(np.abs(driven), np.abs(problem.wanted)),
        error_estimate=problem.error_estimate,
        evaluations=max(found.evaluations, 1),
        seconds=seconds,
        details=found.details,
    )


def gauge(problem: Problem, drive: ComplexArray) -> ComplexArray:
    """Scale a drive to the board's `max_gain` and turn it so that the target moves in phase 0."""
    largest = np.abs(drive).max()
    if not np.isfinite(largest) or largest == 0.0:
        return np.zeros_like(drive)
    return np.asarray(turned(problem, drive) * (problem.board.drive.max_gain / largest))


def turned(problem: Problem, drive: ComplexArray) -> ComplexArray:
    """A drive turned so that the target moves in phase 0.

    Where the drive leaves the target still, its strongest actuator gets phase 0 instead.
    """
    at_target = drive @ problem.at_target
    if abs(at_target) < 1e-9 * np.abs(problem.transfer).max() * np.abs(drive).max():
        at_target = drive[int(np.abs(drive).argmax())]
    return np.asarray(drive * np.exp(-1j * np.angle(at_target)))


def tie_break(problem: Problem, drive: ComplexArray) -> ComplexArray:
    """Of a drive and its mirror images that serve a target on a mirror line equally: one of them.

    The one that drives the earliest actuator in the board's list harder than its partner.
    """
    x, y = problem.place
    for mirror, distance in zip(problem.solved.mirrors, (abs(x), abs(y)), strict=True):
        if mirror is None or distance > ON_MIRROR:
            continue
        twin = drive[list(mirror)]
        difference = np.abs(twin) - np.abs(drive)
        telling = np.flatnonzero(np.abs(difference) > SAME_GAIN * np.abs(drive).max())
        if telling.size and difference[telling[0]] > 0.0:
            drive = twin
    return drive
