"""Fields as they are measured beside a board's: which coils, how strong, and what is late."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.laboratory.fields_at_places import FieldsAtPlaces
from chladni.calibration.laboratory.measured_fields import MeasuredFields
from chladni.calibration.unknowns import unknowns_of
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Row = tuple[NDArray[np.int64], ComplexArray, ComplexArray]
"""Of a frequency: the coils that play, a board's field of each, and the one measured."""
MeasuredRow = tuple[NDArray[np.int64], FloatArray, ComplexArray]
"""Of a frequency: the coils that play, where they were measured, m, and what was, m/N."""

LOWEST_HZ, HIGHEST_HZ = 40.0, 500.0
"""Between which a file's frequencies are used, as drives use them."""
MOST_FREQUENCIES = 4
OF_DEAD = 0.3
"""Of a usual field, that of a dead coil is taken to be large."""
STEP = 0.02
"""Of a logarithm, over which slopes are taken."""


class ComparedFields:
    """Fields that were measured, and those of boards with other values of what is not known.

    Parameters
    ----------
    progress
        Called with the number of boards that were solved.

    Attributes
    ----------
    unknowns
        Of the board.
    hz, rows
        Frequencies that are used, and what was measured at each.
    is_late
        Whether all values of a frequency have a phase in common that no one knows.
    """

    def __init__(
        self, board: Board, measured: MeasuredFields, progress: Callable[[int], None] | None
    ) -> None:
        self.unknowns = unknowns_of(board)
        self.hz = chosen_frequencies(measured.hz)
        self.is_late = measured.sensor_kg > 0.0
        self._sensor = (measured.sensor_kg, np.unique(measured.places, axis=0))
        self._progress = progress
        self._solved: dict[bytes, FieldsAtPlaces] = {}
        compliance = measured.compliance(board)
        self.rows: list[MeasuredRow] = []
        for hz in self.hz.tolist():
            at = measured.hz == hz
            self.rows.append((measured.coils[at], measured.places[at], compliance[at]))

    def board_at(self, values: FloatArray) -> Board:
        """The board with the first of its values, as many as are given."""
        every = self.unknowns.mean.copy()
        every[: values.size] = values
        return self.unknowns.board_at(every)

    def solved_at(self, values: FloatArray) -> FieldsAtPlaces:
        """That board, solved."""
        key = values.tobytes()
        if key not in self._solved:
            self._solved[key] = FieldsAtPlaces(self.board_at(values), self.hz, *self._sensor)
            if self._progress:
                self._progress(len(self._solved))
        return self._solved[key]

    def compared(
        self,
        values: FloatArray,
        turn: FloatArray | None = None,
        order: NDArray[np.int64] | None = None,
    ) -> list[Row]:
        """At each frequency that board's fields and those measured, over each coil's own size.

        With places turned by a matrix, or coils taken for others, where that is given.
        """
        rows = []
        for row, (coils, places, given) in enumerate(self.rows):
            taken = coils if order is None else order[coils]
            turned = places if turn is None else places @ turn.T
            own = self.solved_at(values).at(row, taken, turned)
            sizes = sizes_of(coils, given)[coils]
            rows.append((taken, own / sizes, given / sizes))
        return in_time(rows, len(self.unknowns.board.actuators)) if self.is_late else rows


def chosen_frequencies(hz: FloatArray) -> FloatArray:
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


def in_time(rows: list[Row], count: int) -> list[Row]:
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


def rms(values: ComplexArray) -> float:
    """Of magnitudes."""
    return float(np.sqrt(np.mean(np.abs(values) ** 2)))


def sizes_of(coils: NDArray[np.int64], values: ComplexArray) -> FloatArray:
    """RMS of each coil's field; of one that is dead, a share of what others have."""
    count = int(coils.max()) + 1
    rows = np.bincount(coils, minlength=count)
    total = np.bincount(coils, np.abs(values) ** 2, count)
    sizes = np.sqrt(total / np.maximum(rows, 1))
    return np.maximum(sizes, max(OF_DEAD * float(np.median(sizes[rows > 0])), 1e-300))


def factors(rows: list[Row], count: int) -> FloatArray:
    """Real factors of each of `count` coils' fields that fit best; NaN of those not measured."""
    coils, own, given = (np.concatenate(part) for part in zip(*rows, strict=True))
    over = np.bincount(coils, (own.conj() * given).real, count)
    under = np.bincount(coils, np.abs(own) ** 2, count)
    found: FloatArray = np.divide(over, under, out=np.full(count, np.nan), where=under > 0.0)
    return found


def slopes_by(
    left: Callable[[FloatArray], ComplexArray], values: FloatArray, count: int
) -> FloatArray:
    """∂ of what is left by the first values, by differences: (values, what is left, stacked)."""
    before, found = stacked(left(values)), []
    for own in range(count):
        more = values.copy()
        more[own] += STEP
        found.append((stacked(left(more)) - before) / STEP)
    return np.array(found)


def stacked(values: ComplexArray) -> FloatArray:
    """Real parts before imaginary ones, along the last axis."""
    return np.concatenate((values.real, values.imag), axis=-1)
