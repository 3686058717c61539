"""The board that has the fields a laboratory measured: sheet, foam, screws, feet, and each coil.

Places and patches of foam stay as they are drawn: what is found is what all of the board has in
common, and how strong each coil is and which way round.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from chladni.calibration.coils_known import drawn_strengths, with_coils_known
from chladni.calibration.fit import HELD_BY, INEXACT, TOLD_APART, UNFITTED, Parameter
from chladni.calibration.laboratory.fields_at_places import FieldsAtPlaces
from chladni.calibration.laboratory.measured_fields import MeasuredFields
from chladni.calibration.unknowns import Unknowns, unknowns_of
from chladni.calibration.wiring import DEAD, Wiring
from chladni.drives.problem.threads import one_blas_thread
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Report = Callable[[int], None]

LOWEST_HZ, HIGHEST_HZ = 40.0, 500.0
"""Between which a file's frequencies are used, as drives use them."""
MOST_FREQUENCIES = 4
FEWEST_PLACES = 4
"""Of each coil; a sensor that stands on the board needs one."""
ERROR = 0.05
"""Of a coil's field, RMS, that patches, places and the measurement itself may be off."""
STARTS = (-1.0, 0.0, 1.0)
OF_DEAD = 0.3
"""Of a usual field, that of a dead coil is taken to be large."""
STEP = 0.02
"""Of a logarithm, over which slopes are taken."""
UNLIKE = 0.5
"""Share of a field that the best board does not explain, above which it is another one's."""
CLEARLY = 0.6
"""Of what is left, that the same fields turned or exchanged must leave to be believed."""
FAR_OFF = 30.0
"""Times that fields may be larger or smaller than expected: more is a unit."""


@dataclass(frozen=True)
class FieldsFit:
    """What measured fields tell.

    Attributes
    ----------
    board
        As it is; polarity, trim and dead coils included.
    wiring
        Of its coils.
    parameters
        Of the whole board.
    left
        RMS share of the fields that it does not explain.
    """

    board: Board
    wiring: Wiring
    parameters: tuple[Parameter, ...]
    left: float


def fit_fields(board: Board, measured: MeasuredFields, progress: Report | None = None) -> FieldsFit:
    """Find the board with these fields.

    Raises
    ------
    InputError
        Too few places or frequencies, another board's fields, turned axes, exchanged coils or
        other units: each by name.
    """
    with one_blas_thread():
        search = _Search(board, measured, progress)
        search.check_units()
        best = search.solve()
        search.check(best)
        forces = search.forces(best)
        parameters = tuple(search.parameters(best))
    usual = float(np.median(np.abs(forces[np.isfinite(forces)])))
    signs = np.where(np.abs(forces) < DEAD * usual, 0.0, np.sign(forces))
    signs = np.where(np.isfinite(forces), signs, 1.0)
    if signs.sum() < 0.0:
        signs, forces = -signs, -forces
    known = np.where(np.isfinite(forces), forces, 1.0)
    own = search.board_at(best)
    strengths = np.where(signs == 0.0, 0.0, known) * drawn_strengths(board)
    return FieldsFit(with_coils_known(own, strengths), Wiring(signs), parameters, search.left(best))


class _Search:
    def __init__(self, board: Board, measured: MeasuredFields, progress: Report | None) -> None:
        self._unknowns: Unknowns = unknowns_of(board)
        self._hz = _chosen(measured.hz)
        self._has_sensor = measured.sensor_kg > 0.0
        stands = np.unique(measured.places, axis=0) if self._has_sensor else np.empty((0, 2))
        self._sensor = (measured.sensor_kg, stands)
        self._progress = progress
        self._solved: dict[bytes, FieldsAtPlaces] = {}
        compliance = measured.compliance(board)
        self._slopes = np.empty((0, 0))
        self._rows = []
        for hz in self._hz.tolist():
            at = measured.hz == hz
            self._rows.append((measured.coils[at], measured.places[at], compliance[at]))
        counts = np.bincount(self._rows[0][0], minlength=len(board.actuators))
        if counts.max() < FEWEST_PLACES and not self._has_sensor:
            expected = f"{FEWEST_PLACES} or more of a coil, at {self._hz[0]:g} Hz"
            raise InputError("places", f"{counts.max()}", expected)

    def board_at(self, scales: FloatArray) -> Board:
        values = self._unknowns.mean.copy()
        values[: scales.size] = scales
        return self._unknowns.board_at(values)

    def solve(self) -> FloatArray:
        """Logarithms of the board's scales, the most likely ones."""
        count = len(self._unknowns.scales)
        mean, spread = self._unknowns.mean[:count], self._unknowns.spread[:count]
        begin = min(self._starts(), key=self.left)

        def residuals(off: FloatArray) -> FloatArray:
            return self._residuals(mean + off * spread)

        found = least_squares(
            residuals,
            (begin - mean) / spread,
            diff_step=np.full(count, STEP),
            xtol=1e-3,
            ftol=1e-3,
            max_nfev=12,
        )
        self._slopes = np.asarray(found.jac, np.float64)
        return np.asarray(mean + found.x * spread)

    def parameters(self, scales: FloatArray) -> list[Parameter]:
        count = scales.size
        spread = self._unknowns.spread[:count]
        noise = max(1.0, self.left(scales) / ERROR)
        slopes = self._slopes.copy()
        slopes[:-count] /= noise
        covariance = np.linalg.inv(slopes.T @ slopes) * np.outer(spread, spread)
        found = []
        for row, name in enumerate(self._unknowns.scales):
            own = float(np.hypot(np.sqrt(covariance[row, row]), UNFITTED.get(name, INEXACT)))
            told = own < TOLD_APART * float(spread[row])
            found.append(Parameter.of_logarithm(name, float(scales[row]), own, told))
        return found

    def forces(self, scales: FloatArray) -> FloatArray:
        """Of each coil over the drawn one; NaN of those that were not measured."""
        return self._compared(scales)[0]

    def left(self, scales: FloatArray) -> float:
        """RMS share that is not explained."""
        return _rms(self._compared(scales)[1])

    def check_units(self) -> None:
        """Whether fields are about as large as this board's: units are told by that."""
        mean = self._unknowns.mean[: len(self._unknowns.scales)]
        ratios = [
            _rms(values) / _rms(self._at(mean, row, coils, places))
            for row, (coils, places, values) in enumerate(self._rows)
        ]
        size = float(np.median(ratios))
        if not 1.0 / FAR_OFF < size < FAR_OFF:
            expected = "displacement, velocity or acceleration over force, current or voltage in SI"
            hint = "say which response it is, and per what; are they millimetres?"
            given = f"{size:.3g} times what {self._unknowns.board.name} does"
            raise InputError("responses", given, expected, hint=hint)

    def check(self, scales: FloatArray) -> None:
        """Whether these fields are this board's."""
        name = self._unknowns.board.name
        left = self.left(scales)
        # What was fitted to turned fields is nothing: those of the starts are looked at too.
        tried = [scales, *self._starts()]
        for said, turn in _TURNS.items():
            if min(_rms(self._compared(own, turn)[1]) for own in tried) < CLEARLY * left:
                hint = "x runs along the short side, y along the long one, from the board's centre"
                raise InputError("places", said, f"the axes of {name}", hint=hint)
        swapped = next((said for own in tried if (said := self._swapped(own, left))), "")
        if swapped:
            raise InputError("coils", f"{swapped} exchanged", f"the numbers that {name} has")
        if left > UNLIKE:
            given = f"{100.0 * left:.0f} % unexplained"
            expected = f"fields of {name}, as it may come out"
            raise InputError("responses", given, expected)

    def _starts(self) -> list[FloatArray]:
        """On soft, usual and stiff supports."""
        count = len(self._unknowns.scales)
        held = np.array([float(name in HELD_BY) for name in self._unknowns.scales])
        reach = held * self._unknowns.spread[:count]
        return [self._unknowns.mean[:count] + off * reach for off in STARTS]

    def _residuals(self, scales: FloatArray) -> FloatArray:
        every = self._compared(scales)[1] / ERROR
        count = scales.size
        mean, spread = self._unknowns.mean[:count], self._unknowns.spread[:count]
        # As if a hundred places were measured, however many there are: they err together.
        every = every * np.sqrt(min(1.0, 100.0 / every.size))
        return np.concatenate((every.real, every.imag, (scales - mean) / spread))

    def _compared(
        self,
        scales: FloatArray,
        turn: FloatArray | None = None,
        order: NDArray[np.int64] | None = None,
    ) -> tuple[FloatArray, ComplexArray]:
        """Real factors of each coil's field that fit best, and what is left, over each field's RMS.

        With places turned by a matrix, or coils taken for others, where that is given.
        """
        count = len(self._unknowns.board.actuators)
        rows = []
        for row, (coils, places, values) in enumerate(self._rows):
            taken = coils if order is None else order[coils]
            own = self._at(scales, row, taken, places if turn is None else places @ turn.T)
            sizes = _sizes(coils, values)[coils]
            rows.append((taken, own / sizes, values / sizes))
        if self._has_sensor:
            rows = _in_time(rows, count)
        coils, own, values = (np.concatenate(part) for part in zip(*rows, strict=True))
        over = np.bincount(coils, (own.conj() * values).real, count)
        under = np.bincount(coils, np.abs(own) ** 2, count)
        forces = np.divide(over, under, out=np.full(count, np.nan), where=under > 0.0)
        return forces, np.asarray(values - forces[coils] * own)

    def _at(
        self, scales: FloatArray, row: int, coils: NDArray[np.int64], places: FloatArray
    ) -> ComplexArray:
        """Of a newton of those coils, at those places, at a frequency of the board's."""
        key = scales.tobytes()
        if key not in self._solved:
            self._solved[key] = FieldsAtPlaces(self.board_at(scales), self._hz, *self._sensor)
            if self._progress:
                self._progress(len(self._solved))
        return self._solved[key].at(row, coils, places)

    def _swapped(self, scales: FloatArray, left: float) -> str:
        """Two coils whose fields are each other's."""
        names = [own.name for own in self._unknowns.board.actuators]
        measured = np.unique(self._rows[0][0]).tolist()
        for k, first in enumerate(measured):
            for second in measured[:k]:
                order = np.arange(len(names))
                order[[first, second]] = second, first
                if _rms(self._compared(scales, order=order)[1]) < CLEARLY * left:
                    return f"{names[second]} and {names[first]}"
        return ""


def _chosen(hz: FloatArray) -> FloatArray:
    """A few of the frequencies that drives use."""
    used = np.unique(hz)
    used = used[(used >= LOWEST_HZ) & (used <= HIGHEST_HZ)]
    if used.size == 0:
        given = f"{hz.min():g} to {hz.max():g} Hz"
        raise InputError("frequencies", given, f"some from {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz")
    if used.size <= MOST_FREQUENCIES:
        return np.asarray(used)
    wanted = np.geomspace(used[0], used[-1], MOST_FREQUENCIES)
    return np.unique([used[np.argmin(np.abs(used - own))] for own in wanted])


def _in_time(
    rows: list[tuple[NDArray[np.int64], ComplexArray, ComplexArray]], count: int
) -> list[tuple[NDArray[np.int64], ComplexArray, ComplexArray]]:
    """Fields, and values turned by the phase that all values of a frequency have in common.

    A sensor on the device's bus samples and filters by a clock of its own, so that all it reads is
    late by what no one knows. Coils that are reversed are half a turn away, so squares are added.
    """
    found, first = [], None
    for coils, own, values in rows:
        products = own.conj() * values
        each = np.bincount(coils, products.real, count) + 1j * np.bincount(
            coils, products.imag, count
        )
        turn = np.exp(-0.5j * np.angle(np.sum(each**2)))
        signs = (turn * each).real
        first = signs if first is None else first
        turn = turn if signs @ first >= 0.0 else -turn
        found.append((coils, own, values * turn))
    return found


def _rms(values: ComplexArray) -> float:
    return float(np.sqrt(np.mean(np.abs(values) ** 2)))


def _sizes(coils: NDArray[np.int64], values: ComplexArray) -> FloatArray:
    """RMS of each coil's field; of one that is dead, a share of what others have."""
    count = int(coils.max()) + 1
    rows = np.bincount(coils, minlength=count)
    total = np.bincount(coils, np.abs(values) ** 2, count)
    sizes = np.sqrt(total / np.maximum(rows, 1))
    return np.maximum(sizes, max(OF_DEAD * float(np.median(sizes[rows > 0])), 1e-300))


_TURNS = {
    "x mirrored": np.diag((-1.0, 1.0)),
    "y mirrored": np.diag((1.0, -1.0)),
    "turned by half a turn": np.diag((-1.0, -1.0)),
    "x and y exchanged": np.array([[0.0, 1.0], [1.0, 0.0]]),
}
