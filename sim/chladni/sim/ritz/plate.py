"""A rectangular plate with any supports, solved by Ritz with as small a basis as will do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from threading import RLock
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from chladni.sim.cost import Cost, begin, is_too_large
from chladni.sim.errors import RESONANCE_BAND, ResonanceError
from chladni.sim.plate.geometry import PlateGeometry
from chladni.sim.plate.loads import Load
from chladni.sim.plate.mirrors import Mirrors, orbits_of
from chladni.sim.plate.modes import ModeShapes
from chladni.sim.plate.response import Excitation, PlateModel, Response
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.parity import find_mirrors
from chladni.sim.ritz.basis.resolution import (
    LEVELS,
    Resolution,
    cost_of,
    first_level,
    least_size,
    resolution_for,
    wave_number,
    wave_number_of_mode,
)
from chladni.sim.ritz.load_cases import LoadCase
from chladni.sim.ritz.solver import Estimate, ParityFields, Solver

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MODE_TOLERANCE = 1e-3
"""Chooses the level for natural frequencies; on `prototype` they come out within 2e-5."""
GROWN_SECONDS = 10.0
"""A basis that takes longer is not tried because a smaller one did not suffice."""
SUSPICIOUS = 0.1
"""Share of the gain at `RESONANCE_BAND` from which modes are worked out to be sure."""
TWO_LEVELS = 8.0
"""Times its share of the tolerance from which a part of the error takes two levels more."""
WORTHWHILE = 0.85
"""A larger basis that leaves more of the estimated error than this is the last that is tried."""
SPARE = 2.5
"""Times the polynomials that it takes: a basis for shorter waves that has no more is used as it is,
for to build one costs as much as some fifteen solutions."""
Levels = tuple[int, int]
"""Of polynomials, and of functions on circles."""
Method = TypeVar("Method", bound=Callable[..., Any])


def in_turn(method: Method) -> Method:
    """A method that one thread at a time may be in."""

    @wraps(method)
    def guarded(self: RitzPlate, *args: Any, **kwargs: Any) -> Any:
        with self._turn:
            return method(self, *args, **kwargs)

    return cast(Method, guarded)


@dataclass(frozen=True)
class _Found:
    """A solution in one basis."""

    levels: Levels
    solver: Solver
    case: LoadCase
    solution: list[ComplexArray]
    estimate: Estimate

    def grown(self, tolerance: float) -> list[Levels]:
        """Larger levels, the most promising first and the cheapest last.

        More of what leaves more than its share of the tolerance, a level of it, or a level of what
        leaves most.
        """
        share = tolerance / 3.0
        parts = (self.estimate.polynomials, self.estimate.orders)
        steps = [int(part > share) + int(part > TWO_LEVELS * share) for part in parts]
        most = int(parts[1] > parts[0])
        single = [min(step, 1) for step in steps]
        only = [single[k] if k == most else 0 for k in range(2)]
        result: dict[Levels, None] = {}
        for more in (steps, single, only):
            level, orders = (
                min(own + step, LEVELS - 1) for own, step in zip(self.levels, more, strict=True)
            )
            result[level, orders] = None
        result.pop(self.levels, None)
        return list(result)


class RitzPlate(PlateModel):
    """Modes and fields of a plate; see circles/functions.py and forms/bending.py for the method.

    Threads may share one: what it keeps from call to call is guarded, so they take turns.

    Parameters
    ----------
    geometry
        Plate, supports and features.
    loss_factor
        η in D(1 + iη); springs share it.
    resolution
        Size of the basis; chosen by plate and tolerance by default.
    mirrors
        Mirrors to use; those the geometry has by default.
    """

    def __init__(
        self,
        geometry: PlateGeometry,
        loss_factor: float,
        resolution: Resolution | None = None,
        *,
        mirrors: Mirrors | None = None,
    ) -> None:
        self.geometry = geometry
        self.loss_factor = loss_factor
        self.mirrors = find_mirrors(geometry) if mirrors is None else mirrors
        self._resolution = resolution
        self._solvers: dict[Resolution, Solver] = {}
        self._sufficed: dict[tuple[float, float], Levels] = {}
        self._turn = RLock()

    @in_turn
    def natural_frequencies(self, count: int) -> FloatArray:
        """The lowest natural frequencies, Hz, shape (count,); rigid motions count as 0."""
        squares = self.mode_solver(count).omega_squared[:count]
        return np.asarray(np.sqrt(squares) / (2.0 * np.pi))

    @in_turn
    def mode_solver(self, count: int) -> Solver:
        """The solver whose lowest `count` modes are converged."""
        highest = wave_number_of_mode(self.geometry, count)
        level = first_level(self.geometry, MODE_TOLERANCE)
        return self._solver(highest, (level, level))

    def cost(self, frequency_hz: float, tolerance: float, points: int) -> Cost:
        """Of its matrices, and its functions at the points; in the first basis."""
        waves = wave_number(self.geometry, 2.0 * np.pi * frequency_hz)
        level = first_level(self.geometry, tolerance)
        return self._cost(resolution_for(self.geometry, waves, level, level), points)

    def _respond(self, excitation: Excitation) -> Response:
        """With a basis that grows until its error estimate is small enough, or is the largest."""
        orbits = orbits_of(excitation.loads, self.mirrors.shared_with(excitation.x, excitation.y))
        size, image, error = self._image(replace(excitation, loads=orbits.distinct))
        return Response(
            image.unfold(orbits), size, error, excitation.frequency_hz, excitation.tolerance
        )

    @in_turn
    def _image(self, asked: Excitation) -> tuple[int, ParityFields, float]:
        """The size of the basis that suffices, the image and its error.

        Polynomials and functions on circles grow apart, each while its share of the error is too
        large. The best solution counts, should larger ones be no better.
        """
        waves, levels = self._first_basis(wave_number(self.geometry, asked.omega), asked.tolerance)
        best = self._find(asked, waves, levels)
        while best.estimate.error > asked.tolerance and not self._resolution:
            before, best = best, self._grown(asked, waves, best)
            if best.estimate.error >= WORTHWHILE * before.estimate.error:
                break
        # The actuators' fields come first: other loads begin at their level.
        self._sufficed.setdefault((waves, asked.tolerance), best.levels)
        image = best.solver.image(best.case, best.solution, self.loss_factor, asked.x, asked.y)
        return best.solver.basis.size, image, best.estimate.error

    def _first_basis(self, waves: float, tolerance: float) -> tuple[float, Levels]:
        """The waves and levels of one that is there for shorter waves, with not much to spare.

        Of many frequencies, asked from the highest down, each would build its own otherwise.
        """
        levels = self._first_levels(waves, tolerance)
        least = resolution_for(self.geometry, waves, *levels)
        there = [
            (own, best)
            for (own, asked), best in self._sufficed.items()
            if asked == tolerance and own > waves
        ]
        if self._resolution or least in self._solvers or not there:
            return waves, levels
        shorter, best = min(there)
        found = resolution_for(self.geometry, shorter, *best)
        spares = found.nx * found.ny <= SPARE * least.nx * least.ny
        is_used = spares and found in self._solvers and min(np.subtract(best, levels)) >= 0
        return (shorter, best) if is_used else (waves, levels)

    def _first_levels(self, waves: float, tolerance: float) -> Levels:
        """Those that sufficed there, or the most that it took for longer waves.

        Of many frequencies, asked in order, each would try too small a basis again otherwise.
        """
        if (waves, tolerance) in self._sufficed:
            return self._sufficed[waves, tolerance]
        first = first_level(self.geometry, tolerance)
        longer = [
            levels
            for (own, asked), levels in self._sufficed.items()
            if asked == tolerance and own <= waves
        ]
        level, orders = np.max([(first, first), *longer], axis=0).tolist()
        return level, orders

    def _grown(self, asked: Excitation, waves: float, first: _Found) -> _Found:
        """The first solution in a larger basis that is any better; the same one if none is."""
        for levels in first.grown(asked.tolerance):
            if self._may_grow(waves, levels, asked.image_points):
                found = self._find(asked, waves, levels)
                is_better = found.estimate.error < first.estimate.error
                worse = first if is_better else found
                self._solvers.pop(worse.solver.basis.resolution)
                if is_better:
                    return found
        return first

    def _may_grow(self, waves: float, levels: Levels, points: int) -> bool:
        """Whether a larger basis may be tried without having been asked for."""
        cost = self._cost(resolution_for(self.geometry, waves, *levels), points)
        return not is_too_large(cost) and cost.seconds <= GROWN_SECONDS

    def _cost(self, resolution: Resolution, points: int) -> Cost:
        """What the plate costs in the basis of a resolution, at least."""
        classes = len(self.mirrors.images)
        size = least_size(self.geometry, resolution)
        cost = cost_of(self.geometry, resolution, classes, points, size)
        if is_too_large(cost):
            return cost
        size = Basis(self.geometry, resolution).size
        return cost_of(self.geometry, resolution, classes, points, size)

    def _find(self, asked: Excitation, waves: float, levels: Levels) -> _Found:
        solver = self._solver(waves, levels, points=asked.image_points)
        case = solver.case(asked.loads)
        solution = solver.coefficients(case, asked.omega, self.loss_factor)
        if not solver.is_lossy(self.loss_factor):
            _refuse_resonance(solver, asked)
        estimate = solver.error_estimate(case, solution, asked.omega, self.loss_factor)
        return _Found(levels, solver, case, solution, estimate)

    @in_turn
    def _modes(self, count: int, loads: Sequence[Load], x: FloatArray, y: FloatArray) -> ModeShapes:
        """The lowest modes on the grid x × y, and what unit loads do to them."""
        return self.mode_solver(count).mode_shapes(count, loads, x, y)

    def _solver(self, waves: float, levels: Levels, *, points: int = 0) -> Solver:
        resolution = self._resolution or resolution_for(self.geometry, waves, *levels)
        if resolution not in self._solvers:
            begin(self._cost(resolution, points))
            self._solvers[resolution] = Solver(self.geometry, self.mirrors, resolution)
        return self._solvers[resolution]


def _refuse_resonance(solver: Solver, asked: Excitation) -> None:
    """Name the mode that an undamped plate would be driven at."""
    if solver.resonance(asked.omega) < SUSPICIOUS / RESONANCE_BAND:
        return
    modes = np.sqrt(solver.omega_squared) / (2.0 * np.pi)
    nearest = int(np.argmin(np.abs(modes - asked.frequency_hz)))
    if abs(modes[nearest] / asked.frequency_hz - 1.0) < RESONANCE_BAND:
        raise ResonanceError(asked.frequency_hz, float(modes[nearest]), str(nearest + 1))
