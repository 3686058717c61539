"""The board that has the fields a laboratory measured: sheet, foam, screws, feet, and each coil.

Foam is found in patches, after what all of the board has in common. Coils stay where they are
drawn: what is found of each is how strong it is and which way round.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from chladni.calibration.coils_known import with_coils_known
from chladni.calibration.fit import HELD_BY, Parameter, parameters_of
from chladni.calibration.laboratory.fields_at_places import FieldsAtPlaces
from chladni.calibration.laboratory.fields_compared import (
    Row,
    chosen_frequencies,
    factors,
    in_time,
    rms,
    sizes_of,
    stacked,
)
from chladni.calibration.laboratory.measured_fields import MeasuredFields
from chladni.calibration.unknowns import Unknowns, unknowns_of
from chladni.calibration.wiring import Wiring
from chladni.drives.problem.threads import one_blas_thread
from chladni.sim.board.board import Board
from chladni.sim.coil.full_drive import strengths
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Report = Callable[[int], None]

FEWEST_PLACES = 4
"""Of each coil; a sensor that stands on the board needs one."""
ERROR = 0.03
"""Of a coil's field, RMS, that places and the measurement itself may be off."""
STARTS = (-1.0, 0.0, 1.0)
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
        best = search.with_patches(search.solve())
        search.check(best)
        forces = search.forces(best)
        parameters = tuple(search.parameters(best))
    # All signs at once are the sensor's.
    if Wiring.of_forces(forces).signs.sum() < 0.0:
        forces = -forces
    wiring = Wiring.of_forces(forces)
    known = np.where(np.isfinite(forces), np.abs(forces), 1.0) * wiring.signs
    own = search.board_at(best)
    made = with_coils_known(own, known * strengths(board))
    return FieldsFit(made, wiring, parameters, search.left(best))


class _Search:
    def __init__(self, board: Board, measured: MeasuredFields, progress: Report | None) -> None:
        self._unknowns: Unknowns = unknowns_of(board)
        self._hz = chosen_frequencies(measured.hz)
        self._has_sensor = measured.sensor_kg > 0.0
        self._sensor = (measured.sensor_kg, np.unique(measured.places, axis=0))
        self._progress = progress
        self._solved: dict[bytes, FieldsAtPlaces] = {}
        compliance = measured.compliance(board)
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
        return self._refined(min(self._starts(), key=self.left), ftol=1e-3, most=12)

    def with_patches(self, scales: FloatArray) -> FloatArray:
        """Logarithms of the board's scales, and of its patches of foam after them."""
        count = self._unknowns.patch_values.stop
        if count == scales.size:
            return scales
        begin = self._unknowns.mean[:count].copy()
        begin[: scales.size] = scales
        return self._refined(begin, ftol=1e-2, most=8)

    def _refined(self, begin: FloatArray, *, ftol: float, most: int) -> FloatArray:
        """The most likely values from there on, as many as are given; `most` steps."""
        mean, spread = self._unknowns.mean[: begin.size], self._unknowns.spread[: begin.size]

        def residuals(off: FloatArray) -> FloatArray:
            return self._residuals(mean + off * spread)

        def jacobian(off: FloatArray) -> FloatArray:
            return self._jacobian(mean + off * spread)

        found = least_squares(
            residuals, (begin - mean) / spread, jac=jacobian, xtol=1e-3, ftol=ftol, max_nfev=most
        )
        return np.asarray(mean + found.x * spread)

    def parameters(self, values: FloatArray) -> Iterator[Parameter]:
        """Of the whole board."""
        spread = self._unknowns.spread[: values.size]
        slopes = self._jacobian(values)
        slopes[: -values.size] /= max(1.0, self.left(values) / ERROR)
        covariance = np.linalg.inv(slopes.T @ slopes) * np.outer(spread, spread)
        return parameters_of(self._unknowns, values, covariance)

    def forces(self, scales: FloatArray) -> FloatArray:
        """Of each coil over the drawn one; NaN of those that were not measured."""
        return self._compared(scales)[0]

    def left(self, scales: FloatArray) -> float:
        """RMS share that is not explained."""
        return rms(self._compared(scales)[1])

    def check_units(self) -> None:
        """Whether fields are about as large as this board's: units are told by that."""
        mean = self._unknowns.mean[: len(self._unknowns.scales)]
        ratios = [
            rms(values) / rms(self._at(mean, row, coils, places))
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
            if min(rms(self._compared(own, turn)[1]) for own in tried) < CLEARLY * left:
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

    def _residuals(self, values: FloatArray) -> FloatArray:
        count = values.size
        mean, spread = self._unknowns.mean[:count], self._unknowns.spread[:count]
        left = self._compared(values)[1]
        return np.concatenate((_weight(left.size) * stacked(left), (values - mean) / spread))

    def _jacobian(self, values: FloatArray) -> FloatArray:
        """Of the residuals, by values in units of what they may be off."""
        count, spread = len(self._unknowns.scales), self._unknowns.spread[: values.size]
        before = self._residuals(values)
        found = np.zeros((before.size, values.size))
        for own in range(count):
            more = values.copy()
            more[own] += STEP
            found[:, own] = (self._residuals(more) - before) / STEP
        if values.size > count:
            found[: -values.size, count:] = self._of_patches(values)
            found[-values.size :, count:] = np.diag(1.0 / spread)[:, count:]
        return np.asarray(found * spread)

    def _of_patches(self, values: FloatArray) -> FloatArray:
        """∂ residuals by the logarithms of patches.

        Coils' factors, and turns of all values of a frequency, follow: what those make up for is
        taken out.

        References
        ----------
        L. Kaufman, A variable projection method for solving separable nonlinear least squares
        problems, BIT 15 (1975) 49-57.
        """
        rows = self._rows_at(values)
        forces = factors(rows, len(self._unknowns.board.actuators))
        of_coils, of_turns, slopes = [], [], []
        for row, ((coils, places, given), (_, own, _)) in enumerate(
            zip(self._rows, rows, strict=True)
        ):
            forced = forces[coils] / sizes_of(coils, given)[coils]
            each = self._solved_at(values).patch_slopes(row, coils, places)
            slopes.append(-forced * each)
            of_coils.append(own * (coils == np.arange(forces.size)[:, None]))
            turn = np.zeros((len(self._rows), own.size), np.complex128)
            turn[row] = 1j * forces[coils] * own
            of_turns.append(turn)
        every = [stacked(np.concatenate(part, axis=1)) for part in (of_coils, of_turns, slopes)]
        followed = np.concatenate(every[: 1 + self._has_sensor]).T
        basis = np.linalg.qr(followed[:, np.any(followed != 0.0, axis=0)])[0]
        found = every[2].T
        return np.asarray(_weight(found.shape[0] // 2) * (found - basis @ (basis.T @ found)))

    def _compared(
        self,
        values: FloatArray,
        turn: FloatArray | None = None,
        order: NDArray[np.int64] | None = None,
    ) -> tuple[FloatArray, ComplexArray]:
        """Real factors of each coil's field that fit best, and what is left, over each field's RMS.

        With places turned by a matrix, or coils taken for others, where that is given.
        """
        rows = self._rows_at(values, turn, order)
        forces = factors(rows, len(self._unknowns.board.actuators))
        left = [given - forces[coils] * own for coils, own, given in rows]
        return forces, np.concatenate(left)

    def _rows_at(
        self,
        values: FloatArray,
        turn: FloatArray | None = None,
        order: NDArray[np.int64] | None = None,
    ) -> list[Row]:
        """At each frequency: coils, a board's fields, and those measured."""
        rows = []
        for row, (coils, places, given) in enumerate(self._rows):
            taken = coils if order is None else order[coils]
            own = self._at(values, row, taken, places if turn is None else places @ turn.T)
            sizes = sizes_of(coils, given)[coils]
            rows.append((taken, own / sizes, given / sizes))
        return in_time(rows, len(self._unknowns.board.actuators)) if self._has_sensor else rows

    def _at(
        self, scales: FloatArray, row: int, coils: NDArray[np.int64], places: FloatArray
    ) -> ComplexArray:
        """Of a newton of those coils, at those places, at a frequency of the board's."""
        return self._solved_at(scales).at(row, coils, places)

    def _solved_at(self, values: FloatArray) -> FieldsAtPlaces:
        key = values.tobytes()
        if key not in self._solved:
            self._solved[key] = FieldsAtPlaces(self.board_at(values), self._hz, *self._sensor)
            if self._progress:
                self._progress(len(self._solved))
        return self._solved[key]

    def _swapped(self, scales: FloatArray, left: float) -> str:
        """Two coils whose fields are each other's."""
        names = [own.name for own in self._unknowns.board.actuators]
        measured = np.unique(self._rows[0][0]).tolist()
        for k, first in enumerate(measured):
            for second in measured[:k]:
                order = np.arange(len(names))
                order[[first, second]] = second, first
                if rms(self._compared(scales, order=order)[1]) < CLEARLY * left:
                    return f"{names[second]} and {names[first]}"
        return ""


def _weight(count: int) -> float:
    """Of what is left at a number of places, over what it may be."""
    # As if a hundred places were measured, however many there are: they err together.
    return float(np.sqrt(min(1.0, 100.0 / count)) / ERROR)


_TURNS = {
    "x mirrored": np.diag((-1.0, 1.0)),
    "y mirrored": np.diag((1.0, -1.0)),
    "turned by half a turn": np.diag((-1.0, -1.0)),
    "x and y exchanged": np.array([[0.0, 1.0], [1.0, 0.0]]),
}
