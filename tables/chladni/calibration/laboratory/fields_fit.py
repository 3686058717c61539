"""The board that has the fields a laboratory measured: sheet, foam, screws, feet, and each coil.

First what all of the board has in common, with coils' forces as they fit best; then all of it
(`refined_fields.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.calibration.coils_known import with_coils_known
from chladni.calibration.fit import HELD_BY
from chladni.calibration.laboratory.fields_compared import (
    ComparedFields,
    factors,
    rms,
    slopes_by,
    stacked,
)
from chladni.calibration.laboratory.measured_fields import MeasuredFields
from chladni.calibration.laboratory.refined_fields import RefinedFit, weight
from chladni.calibration.parameters import Parameter
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
STARTS = (-1.0, 0.0, 1.0)
"""Deviations of what holds the board, from which a search may begin."""
SHEET_STARTS = tuple(np.linspace(-2.0, 2.0, 17).tolist())
"""The same of a sheet whose edges are held, or that nothing holds, whose modes are narrow: on
`paper` fields were taken for those of a mode beside the right one, and levels were 2 dB off."""
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
        fields = ComparedFields(board, measured, progress)
        search = _Search(fields)
        search.check_units()
        scales = search.solve()
        search.check_axes_and_coils(scales)
        forces = search.forces(scales)
        refined = RefinedFit(fields, Wiring.of_forces(forces).signs)
        best = refined.solve(scales, forces)
        plate = best[: fields.unknowns.forces.start]
        search.check_this_board(plate)
        parameters = tuple(refined.parameters(best))
    known = refined.strengths(best)
    # All signs at once are the sensor's.
    if np.sign(known).sum() < 0.0:
        known = -known
    made = with_coils_known(fields.board_at(plate), known * strengths(board))
    return FieldsFit(made, Wiring(np.sign(known)), parameters, search.left(plate))


class _Search:
    """What all of the board has in common."""

    def __init__(self, fields: ComparedFields) -> None:
        self._fields, self._unknowns = fields, fields.unknowns
        coils = len(self._unknowns.board.actuators)
        counts = np.bincount(fields.rows[0][0], minlength=coils)
        if counts.max() < FEWEST_PLACES and not fields.is_late:
            expected = f"{FEWEST_PLACES} or more of a coil, at {fields.hz[0]:g} Hz"
            raise InputError("places", f"{counts.max()}", expected)

    def solve(self) -> FloatArray:
        """Logarithms of the board's scales, the most likely ones."""
        begin = min(self._starts(), key=self.left)
        mean, spread = self._unknowns.mean[: begin.size], self._unknowns.spread[: begin.size]

        def residuals(off: FloatArray) -> FloatArray:
            left = self._left(mean + off * spread)
            return np.concatenate((weight(left.size) * stacked(left), off))

        def jacobian(off: FloatArray) -> FloatArray:
            slopes = slopes_by(self._left, mean + off * spread, off.size)
            data = weight(slopes.shape[1] // 2) * slopes.T * spread
            return np.concatenate((data, np.eye(off.size)))

        found = scipy.optimize.least_squares(
            residuals, (begin - mean) / spread, jac=jacobian, xtol=1e-3, ftol=1e-2, max_nfev=12
        )
        return np.asarray(mean + found.x * spread)

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
            rms(values) / rms(self._fields.solved_at(mean).at(row, coils, places))
            for row, (coils, places, values) in enumerate(self._fields.rows)
        ]
        size = float(np.median(ratios))
        if not 1.0 / FAR_OFF < size < FAR_OFF:
            expected = "displacement, velocity or acceleration over force, current or voltage in SI"
            hint = "say which response it is, and per what; are they millimetres?"
            given = f"{size:.3g} times what {self._unknowns.board.name} does"
            raise InputError("responses", given, expected, hint=hint)

    def check_axes_and_coils(self, scales: FloatArray) -> None:
        """Whether the same fields turned, or of exchanged coils, would be explained far better."""
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

    def check_this_board(self, values: FloatArray) -> None:
        """Whether these fields are this board's."""
        name, left = self._unknowns.board.name, self.left(values)
        if left > UNLIKE:
            given = f"{100.0 * left:.0f} % unexplained"
            expected = f"fields of {name}, as it may come out"
            hint = "is it this board, and nothing on it?"
            raise InputError("responses", given, expected, hint=hint)

    def _starts(self) -> list[FloatArray]:
        """On soft, usual and stiff supports, or of soft, usual and stiff sheets."""
        count = len(self._unknowns.scales)
        held = np.array([float(name in HELD_BY) for name in self._unknowns.scales])
        starts = STARTS if held.any() else SHEET_STARTS
        reach = (held if held.any() else np.ones(count)) * self._unknowns.spread[:count]
        return [self._unknowns.mean[:count] + off * reach for off in starts]

    def _left(self, values: FloatArray) -> ComplexArray:
        return self._compared(values)[1]

    def _compared(
        self,
        values: FloatArray,
        turn: FloatArray | None = None,
        order: NDArray[np.int64] | None = None,
    ) -> tuple[FloatArray, ComplexArray]:
        """Real factors of each coil's field that fit best, and what is left, over each field's RMS.

        With places turned by a matrix, or coils taken for others, where that is given.
        """
        rows = self._fields.compared(values, turn, order)
        forces = factors(rows, len(self._unknowns.board.actuators))
        left = [given - forces[coils] * own for coils, own, given in rows]
        return forces, np.concatenate(left)

    def _swapped(self, scales: FloatArray, left: float) -> str:
        """Two coils whose fields are each other's."""
        names = [own.name for own in self._unknowns.board.actuators]
        measured = np.unique(self._fields.rows[0][0]).tolist()
        for k, first in enumerate(measured):
            for second in measured[:k]:
                order = np.arange(len(names))
                order[[first, second]] = second, first
                if rms(self._compared(scales, order=order)[1]) < CLEARLY * left:
                    return f"{names[second]} and {names[first]}"
        return ""


_TURNS = {
    "x mirrored": np.diag((-1.0, 1.0)),
    "y mirrored": np.diag((1.0, -1.0)),
    "turned by half a turn": np.diag((-1.0, -1.0)),
    "x and y exchanged": np.array([[0.0, 1.0], [1.0, 0.0]]),
}
