"""All of a board from its fields: patches of foam, where coils stand and how strong each is, too.

Beliefs keep what fields do not tell: a coil that is felt far away alone was found at a quarter of
its force without them, under foam of half the stiffness.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.calibration.laboratory.fields_compared import (
    ComparedFields,
    rms,
    sizes_of,
    slopes_by,
    stacked,
)
from chladni.calibration.parameters import Parameter, parameters_of

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

STEPS, ENOUGH = 8, 1e-2
"""Boards that are tried, and the share of what is left that a step must still take away."""
ERROR, LEAST_ERROR = 0.03, 0.01
"""Of a coil's field, RMS, that places and the measurement itself may be off, and at the least."""
DOUBTED = 2.0
"""Times what a first fit leaves, that fields are taken to be off by. A sensor on each coil of
`phone5` leaves 0.5 %, also where it stands 0.7 mm off: with 3 % patches that it tells are lost."""
SENSOR = 0.04
"""Deviation of a value's logarithm by what a sensor has in common at each frequency: its filter is
known to 4 % at 240 Hz. Without it, feet were 2 deviations off on two of six plates."""


class RefinedFit:
    """The most likely board of all that is not known.

    Parameters
    ----------
    signs
        Of coils' forces, 0 for one that is dead.
    """

    def __init__(self, fields: ComparedFields, signs: FloatArray) -> None:
        self._fields, self._signs, self._unknowns = fields, signs, fields.unknowns
        self._of_scales: FloatArray | None = None
        self._error = ERROR

    def solve(self, scales: FloatArray, forces: FloatArray) -> FloatArray:
        """The most likely values of all unknowns, once it is seen how far fields are off.

        Parameters
        ----------
        scales
            Logarithms of the whole board's scales, to begin with.
        forces
            Of coils over the drawn ones, NaN of those that were not measured.
        """
        unknowns = self._unknowns
        begin = unknowns.mean.copy()
        begin[: scales.size] = scales
        told = np.isfinite(forces) & (self._signs != 0.0)
        begin[unknowns.forces][told] = np.log(np.abs(forces[told]))
        first = self._most_likely(begin)
        self._error = float(np.clip(DOUBTED * self._off_by(first), LEAST_ERROR, ERROR))
        return first if self._error == ERROR else self._most_likely(first)

    def _most_likely(self, begin: FloatArray) -> FloatArray:
        mean, spread = self._unknowns.mean, self._unknowns.spread

        def residuals(off: FloatArray) -> FloatArray:
            return self._residuals(mean + off * spread)

        def jacobian(off: FloatArray) -> FloatArray:
            return self._jacobian(mean + off * spread)

        found = scipy.optimize.least_squares(
            residuals, (begin - mean) / spread, jac=jacobian, xtol=1e-3, ftol=ENOUGH, max_nfev=STEPS
        )
        return np.asarray(mean + found.x * spread)

    def strengths(self, values: FloatArray) -> FloatArray:
        """Of the coils over the drawn ones, below 0 if reversed, 0 if dead, (actuators,)."""
        return self._unknowns.strengths(values) * self._signs

    def parameters(self, values: FloatArray) -> Iterator[Parameter]:
        """Of the whole board, with their intervals."""
        slopes = self._jacobian(values)
        slopes[: -values.size] /= max(1.0, rms(self._left(values)) / self._error)
        spread = self._unknowns.spread
        covariance = np.linalg.inv(slopes.T @ slopes) * np.outer(spread, spread)
        return parameters_of(self._unknowns, values, covariance, SENSOR)

    def _off_by(self, values: FloatArray) -> float:
        """RMS share that fields are off, for as many values as a fit cannot follow."""
        slopes = self._jacobian(values)
        data = slopes[: -values.size]
        followed = float(np.sum(data * np.linalg.solve(slopes.T @ slopes, data.T).T))
        return rms(self._left(values)) / float(np.sqrt(1.0 - followed / len(data)))

    def _left(self, values: FloatArray) -> ComplexArray:
        """Of all fields of coils that live, over each one's size."""
        forces = self.strengths(values)
        plate = values[: self._unknowns.forces.start]
        rows = [
            np.where(forces[coils] != 0.0, given - forces[coils] * own, 0.0)
            for coils, own, given in self._fields.compared(plate)
        ]
        return np.concatenate(rows)

    def _residuals(self, values: FloatArray) -> FloatArray:
        left = self._left(values)
        beliefs = (values - self._unknowns.mean) / self._unknowns.spread
        return np.concatenate((weight(left.size, self._error) * stacked(left), beliefs))

    def _jacobian(self, values: FloatArray) -> FloatArray:
        """Of the residuals, by values in units of what they may be off."""
        if self._of_scales is None:
            # A board is solved for each. They change little on the way, so they are taken once.
            self._of_scales = slopes_by(self._left, values, len(self._unknowns.scales))
        data = np.concatenate((self._of_scales, self._of_others(values)))
        data = weight(data.shape[1] // 2, self._error) * data.T * self._unknowns.spread
        return np.concatenate((data, np.eye(values.size)))

    def _of_others(self, values: FloatArray) -> FloatArray:
        """∂ of what is left by the logarithms of patches, by coils' moves and by their forces.

        The turn of all values of a frequency follows: what it makes up for is taken out.

        References
        ----------
        L. Kaufman, A variable projection method for solving separable nonlinear least squares
        problems, BIT 15 (1975) 49-57.
        """
        forces = self.strengths(values)
        plate = values[: self._unknowns.forces.start]
        board = self._fields.solved_at(plate)
        rows = self._fields.compared(plate)
        slopes, turns = [], []
        for row, ((coils, places, given), (_, own, _)) in enumerate(
            zip(self._fields.rows, rows, strict=True)
        ):
            forced = forces[coils] / sizes_of(coils, given)[coils]
            each = forces[coils] * own
            slopes.append(
                -np.concatenate(
                    (
                        forced * board.patch_slopes(row, coils, places),
                        forced * board.place_slopes(row, coils, places),
                        each * (coils == np.arange(forces.size)[:, None]),
                    )
                )
            )
            turn = np.zeros((len(rows), own.size), np.complex128)
            turn[row] = 1j * each
            turns.append(turn)
        found = stacked(np.concatenate(slopes, axis=1))
        if not self._fields.is_late:
            return found
        basis = np.linalg.qr(stacked(np.concatenate(turns, axis=1)).T)[0]
        return np.asarray(found - (found @ basis) @ basis.T)


def weight(count: int, error: float = ERROR) -> float:
    """Of what is left at a number of places, over the share that it may be."""
    # As if a hundred places were measured, however many there are: they err together.
    return float(np.sqrt(min(1.0, 100.0 / count)) / error)
