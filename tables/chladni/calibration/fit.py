"""The board that its own readings tell of: nonlinear least squares, with tolerances as priors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.calibration.coils_known import MOST_TRIM_DB, with_coils_known
from chladni.calibration.flux import drawn_inductances, drawn_motion, motion_of
from chladni.calibration.parameters import Parameter, parameters_of
from chladni.calibration.sensing import CoilReadings
from chladni.calibration.slopes import compliance_slopes
from chladni.calibration.unknowns import Unknowns, unknowns_of
from chladni.calibration.wiring import Wiring, find_wiring
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.coil.full_drive import strengths
from chladni.sim.errors import InputError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.induced import OpenCoils, induced_voltages, open_coils_at

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Report = Callable[[int], None]

MOST_STEPS = 30
HELD_BY = ("foam", "screws", "feet")
STARTS = (-1.5, -0.75, 0.0, 0.75, 1.5)
"""Standard deviations of what holds the board, from which a search may begin."""
LOOSE = (-10.0, -24.0)
"""Deviations of a foot that hardly touches or does not, 10 and 0.4 % of it."""
ENOUGH = 0.03
"""Share of what is left that a step must still take away."""
DIFFERENCE = 0.05
"""Of the logarithm of screws' stiffness or the sheet's, over which a slope is taken."""
UNLIKE = 5.0
"""RMS of what is left over the noise, above which no board that may come out reads like this."""
FEWEST = 3
"""Coils of which it can be told which one is the wrong way round."""
FAR_OFF, FAR_AWAY = 4.0, 6.0
"""Deviations from what is drawn, of any value but forces; and of coils' places where no more than
noise is left, as a finger on the board leaves more. Those of tolerances end at 1.7. Patches of
stiff foam that are smaller than those that are fitted look like a coil that lies elsewhere: 4.6
deviations on one of 32 boards of `pad16`, whose decibels all came back."""


@dataclass(frozen=True)
class BoardFit:
    """What a board's readings tell.

    Attributes
    ----------
    board
        As it is; coils' polarity, trim and who is dead included.
    wiring, strengths
        Of its coils; strengths above 0, (actuators,).
    parameters
        Of the whole board: sheet, foam, screws.
    left
        RMS of what the board does not explain of the readings, over their noise.
    steps
        How many boards were solved.
    """

    board: Board
    wiring: Wiring
    strengths: FloatArray
    parameters: tuple[Parameter, ...]
    left: float
    steps: int


def fit_board(board: Board, readings: CoilReadings, progress: Report | None = None) -> BoardFit:
    """Find the board that reads like this.

    Parameters
    ----------
    board
        As it is drawn.
    progress
        Called with the number of boards that were tried.

    Raises
    ------
    InputError
        No board within the tolerances reads like this, the readings are none (wiring.py), or the
        board has fewer than three coils.

    References
    ----------
    A. Tarantola, Inverse Problem Theory, SIAM 2005, section 3.4: least squares with priors.
    """
    if len(board.actuators) < FEWEST:
        count = f"{len(board.actuators)} of them"
        raise InputError("actuators", count, f"{FEWEST} or more, which hear each other")
    unknowns = unknowns_of(board)
    with one_blas_thread():
        search = _Search(unknowns, readings, progress)
        solved, left = search.find()
        if _are_rigid(unknowns, solved):
            unknowns = unknowns_of(board, rigid=True)
            search = _Search(unknowns, readings, progress)
            solved, left = search.find()
    check_this_board(unknowns, solved, left, search.wiring)
    with one_blas_thread():
        covariance = search.covariance(solved)
    return BoardFit(
        with_coils_known(
            unknowns.board_at(solved),
            search.wiring.signs * unknowns.strengths(solved) * strengths(board),
        ),
        search.wiring,
        unknowns.strengths(solved),
        tuple(parameters_of(unknowns, solved, covariance)),
        left,
        search.steps,
    )


def _are_rigid(unknowns: Unknowns, values: FloatArray) -> bool:
    """Whether screws come out stiffer than any stand-off: they are rigid, as a file draws them."""
    off = (values - unknowns.mean) / unknowns.spread
    return "screws" in unknowns.scales and off[unknowns.scales.index("screws")] > FAR_OFF


def check_this_board(
    unknowns: Unknowns, values: FloatArray, left: float, wiring: Wiring | None = None
) -> None:
    """Raise `InputError` for readings of no board, or of one that is far from what was drawn.

    Coils that are wired wrongly are named with a foot that is far off, by which all else fits.
    """
    far = farthest_off(unknowns, values, left)
    if left > UNLIKE:
        what = f"{left:.1f} times the noise off"
    elif far is not None:
        what = f"{unknowns.names[far[0]]} {far[1]:.0f} deviations off"
    else:
        return
    expected = f"those of {unknowns.board.name}, as it may come out"
    hint = "is it this board, and nothing on it? Measure again"
    if left <= UNLIKE and far is not None and unknowns.is_foot(far[0]):
        signs = [] if wiring is None else wiring.signs.tolist()
        faults = [
            f"; {own.name} is {'dead' if sign == 0.0 else 'reversed'}"
            for own, sign in zip(unknowns.board.actuators, signs, strict=False)
            if sign != 1.0
        ]
        hint = f"does it touch? Measure again{''.join(faults)}"
    raise InputError("readings", what, expected, hint=hint)


def farthest_off(unknowns: Unknowns, values: FloatArray, left: float) -> tuple[int, float] | None:
    """The value that is farthest beyond where it may come out, and its deviations; None of none."""
    off = np.abs(values - unknowns.mean) / unknowns.spread
    most = np.full(off.size, FAR_OFF)
    if left < 1.0:
        most[unknowns.places] = FAR_AWAY
    # A coil of half its force is to be looked at, and its file takes as much.
    most[unknowns.forces] = np.log(10.0 ** (MOST_TRIM_DB / 20.0)) / unknowns.spread[unknowns.forces]
    worst = int(np.argmax(off / most))
    return (worst, float(off[worst])) if off[worst] > most[worst] else None


class _Search:
    """Residuals of boards by their unknowns, in units of what they may be off before (mean 0)."""

    def __init__(self, unknowns: Unknowns, readings: CoilReadings, progress: Report | None) -> None:
        self._unknowns, self._readings, self._progress = unknowns, readings, progress
        self._moving = drawn_motion(unknowns.board, readings.high.hz)
        self._wire(Wiring(np.ones(len(unknowns.board.actuators))))
        self.steps = 0
        self._last: tuple[bytes, Board, list[OpenCoils]] | None = None

    def find(self) -> tuple[FloatArray, float]:
        """The most likely values, and what they leave.

        Where no board that may come out reads like this, one foot after the other is let go of: no
        small step leads to one that does not touch, and its neighbours seem to be reversed.
        """
        found = self.solve(self.start())
        left, cost, feet = self.left(found), self._cost(found), self._unknowns.foot_values
        for foot, off in product(range(feet.start, feet.stop), LOOSE):
            far = farthest_off(self._unknowns, found, left)
            if left <= UNLIKE and (far is None or self._unknowns.is_foot(far[0])):
                break
            wiring = self.wiring
            loose = self.solve(self.start((foot, off)))
            if (costs := self._cost(loose)) < cost:
                found, left, cost = loose, self.left(loose), costs
            else:
                self._wire(wiring)
        return found, left

    def start(self, loose: tuple[int, float] | None = None) -> FloatArray:
        """Values to begin with, and how coils are wired: by the foam under which both fit best.

        On foam twice as stiff a neighbour may move the other way: signs are told with it or not at
        all. `loose`: a foot's value that is far off, and by how many deviations.
        """
        unknowns, best = self._unknowns, -np.inf
        omega = 2.0 * np.pi * self._readings.frequencies_hz[:, None, None]
        flux = 1j * omega * drawn_inductances(unknowns.board)[0]
        start, solved, wired = np.zeros(unknowns.mean.size), self._last, self.wiring
        scales = [name for name in HELD_BY if name in unknowns.scales]
        for off in STARTS if scales else (0.0,):
            trial = np.zeros(unknowns.mean.size)
            if loose is not None:
                trial[loose[0]] = loose[1]
            trial[[unknowns.scales.index(name) for name in scales]] = off
            expected = self.expected(self._values(trial)) + flux
            wiring = find_wiring(unknowns.board, self._readings, expected)
            alike = wiring.alike(self._readings.volts, expected)
            if alike > best:
                best, start, wired, solved = alike, trial, wiring, self._last
        self._last = solved
        self._wire(wired)
        return start

    def _wire(self, wiring: Wiring) -> None:
        """Take coils to be wired so, and their motion's readings for it."""
        self.wiring = wiring
        self._motion = motion_of(self._unknowns.board, self._readings, wiring.signs, self._moving)

    def solve(self, start: FloatArray) -> FloatArray:
        """The most likely values, from a start in units of what they may be off."""

        def residuals(off: FloatArray) -> FloatArray:
            return self._residuals(self._values(off))

        def jacobian(off: FloatArray) -> FloatArray:
            return self._jacobian(self._values(off))

        found = scipy.optimize.least_squares(
            residuals,
            start,
            jac=jacobian,
            method="trf",
            max_nfev=MOST_STEPS,
            ftol=ENOUGH,
            xtol=1e-4,
        )
        return self._values(np.asarray(found.x))

    def left(self, values: FloatArray) -> float:
        """RMS of the readings' residuals."""
        own = self._residuals(values)[: -values.size]
        is_read = np.tile(self._is_read().ravel(), 2 * len(self._readings.frequencies_hz))
        return float(np.sqrt(np.mean(own[is_read] ** 2)))

    def _cost(self, values: FloatArray) -> float:
        """What `solve` makes least: of the readings, and of values that are off."""
        return float(np.sum(self._residuals(values) ** 2))

    def covariance(self, values: FloatArray) -> FloatArray:
        """Of the values, as far as they are told, (unknowns, unknowns)."""
        slopes = self._jacobian(values)
        # Where more is left than noise, the noise is taken to be that much larger.
        slopes[: -values.size] /= max(1.0, self.left(values))
        own = np.linalg.inv(slopes.T @ slopes)
        return np.asarray(own * np.outer(self._unknowns.spread, self._unknowns.spread))

    def expected(self, values: FloatArray) -> ComplexArray:
        """Motion's voltages per ampere, of coils that are all the right way round."""
        board, coils = self._solved(values)
        strength = self._unknowns.strengths(values)
        return np.array(
            [
                np.outer(strength, strength) * induced_voltages(board, own.compliance, frequency)
                for own, frequency in zip(coils, self._readings.frequencies_hz, strict=True)
            ]
        )

    def _values(self, off: FloatArray) -> FloatArray:
        return np.asarray(self._unknowns.mean + off * self._unknowns.spread)

    def _solved(self, values: FloatArray) -> tuple[Board, list[OpenCoils]]:
        """The board of some values with its coils at every frequency; the last is kept."""
        # Forces change nothing of the plate.
        key = values[: self._unknowns.forces.start].tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, *self._solve_again(values))
        return self._last[1], self._last[2]

    def _solve_again(self, values: FloatArray) -> tuple[Board, list[OpenCoils]]:
        board = self._unknowns.board_at(values)
        model = plate_model(board)
        hz = [float(own) for own in self._readings.frequencies_hz]
        coils = open_coils_at(board, hz, model=model, tolerance=DRAWN_TOLERANCE)
        self.steps += 1
        if self._progress:
            self._progress(self.steps)
        return board, coils

    def _differences(
        self, values: FloatArray, coils: list[OpenCoils]
    ) -> list[dict[str, ComplexArray]]:
        """How compliances at each frequency change with what is found by solving once more."""
        found: list[dict[str, ComplexArray]] = [{} for _ in coils]
        scales = self._unknowns.scales
        for name in ("screws", *(("modulus",) if self._unknowns.patches else ())):
            if name not in scales:
                continue
            stiffer = values.copy()
            stiffer[scales.index(name)] += DIFFERENCE
            _, more = self._solve_again(stiffer)
            for own, new, old in zip(found, more, coils, strict=True):
                own[name] = (new.compliance - old.compliance) / DIFFERENCE
        return found

    def _is_read(self) -> NDArray[np.bool_]:
        """Pairs of different coils that are not dead."""
        lives = ~self.wiring.is_dead
        return np.outer(lives, lives) & ~np.eye(lives.size, dtype=bool)

    def _residuals(self, values: FloatArray) -> FloatArray:
        signs = np.outer(self.wiring.signs, self.wiring.signs)
        volts = self._motion.volts - signs * self.expected(values)
        off = self._motion.by_deviations(np.where(self._is_read(), volts, 0.0))
        beliefs = (values - self._unknowns.mean) / self._unknowns.spread
        return np.concatenate((off.ravel(), beliefs))

    def _jacobian(self, values: FloatArray) -> FloatArray:
        unknowns, count = self._unknowns, self.wiring.signs.size
        board, coils = self._solved(values)
        strength = unknowns.strengths(values)
        pairs = np.outer(strength, strength)
        rows = []
        for own, solved, frequency in zip(
            coils, self._differences(values, coils), self._readings.frequencies_hz, strict=True
        ):
            slopes = compliance_slopes(unknowns, board, own, frequency, solved)
            of_plate = pairs * induced_voltages(board, slopes, frequency)
            read = pairs * induced_voltages(board, own.compliance, frequency)
            each = np.eye(count)
            of_forces = each[:, :, None] * read + each[:, None, :] * read
            rows.append(np.concatenate((of_plate, of_forces)))
        signs = np.outer(self.wiring.signs, self.wiring.signs)
        every = np.where(self._is_read(), -np.stack(rows, axis=1) * signs, 0.0)
        every = self._motion.by_deviations(every).reshape(values.size, -1)
        data = every.T * unknowns.spread
        return np.concatenate((data, np.eye(values.size)))
