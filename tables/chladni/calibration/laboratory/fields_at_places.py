"""What coils of a board do at places, with the sensor that stands there.

A sensor of mass m at p pushes with ω² m times what it moves, so it moves by h / (1 − ω² m g), with
h what a coil does there without it, and g what a newton there does there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from chladni.calibration.slopes import patch_slopes
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.induced import open_coils
from chladni.sim.fields.transfer import disc_fields

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SENSOR_RADIUS = 3e-3
"""m, of the disc on which a sensor stands."""


class FieldsAtPlaces:
    """A board, solved at some frequencies.

    Parameters
    ----------
    hz
        Frequencies.
    sensor_kg, stands
        Mass of the sensor, 0 without one, and where it stood, m, (places, 2).
    """

    def __init__(self, board: Board, hz: FloatArray, sensor_kg: float, stands: FloatArray) -> None:
        self._board, self._sensor_kg, self._stands = board, sensor_kg, stands
        self._hz = hz.tolist()
        self._model = plate_model(board)
        self._fields = [self._of_coils(own) for own in self._hz]
        has_sensor = sensor_kg > 0.0
        self._pushed = [self._of_stands(own) for own in self._hz] if has_sensor else []

    def at(self, row: int, coils: NDArray[np.int64], places: FloatArray) -> ComplexArray:
        """Of a newton of those coils, at those places, at a frequency, m/N, (rows,).

        Straight between image points.
        """
        moved = _between(self._board, self._fields[row], coils, places)
        if self._sensor_kg == 0.0:
            return moved
        return np.asarray(moved / self._loads(row)[self._stands_at(places)])

    def patch_slopes(self, row: int, coils: NDArray[np.int64], places: FloatArray) -> ComplexArray:
        """∂ by the logarithm of each patch's stiffness of what `at` tells, (patches, rows)."""
        if not self._pushed:
            self._pushed = [self._of_stands(own) for own in self._hz]
        at, fields, pushed = self._stands_at(places), self._fields[row], self._pushed[row]
        slopes = np.array([own[at, coils] for own in patch_slopes(self._board, pushed, fields)])
        if self._sensor_kg == 0.0:
            return slopes
        loads = self._loads(row)[at]
        own = [np.diag(one)[at] for one in patch_slopes(self._board, pushed, pushed)]
        return np.asarray((slopes + self.at(row, coils, places) * self._inertia(row) * own) / loads)

    def _inertia(self, row: int) -> float:
        return float((2.0 * np.pi * self._hz[row]) ** 2 * self._sensor_kg)

    def _loads(self, row: int) -> ComplexArray:
        """1 − ω² m g of each place where the sensor stood."""
        numbers = np.arange(len(self._stands))
        compliance = _between(self._board, self._pushed[row], numbers, self._stands)
        return np.asarray(1.0 - self._inertia(row) * compliance)

    def _stands_at(self, places: FloatArray) -> NDArray[np.int64]:
        apart = np.linalg.norm(places[:, None] - self._stands, axis=2)
        return np.asarray(np.argmin(apart, axis=1))

    def _of_coils(self, hz: float) -> ComplexArray:
        """Fields of a newton of each coil, on the board's grid."""
        own = open_coils(self._board, hz, model=self._model, tolerance=DRAWN_TOLERANCE)
        return np.asarray(own.fields.values)

    def _of_stands(self, hz: float) -> ComplexArray:
        """Fields of a newton of the sensor, at each of its places."""
        pushed = disc_fields(
            self._board,
            [(x / MM, y / MM) for x, y in self._stands.tolist()],
            SENSOR_RADIUS,
            frequency_hz=hz,
            tolerance=DRAWN_TOLERANCE,
            model=self._model,
            allow_unmet=True,
        )
        return np.asarray(pushed.values)


def _between(
    board: Board, fields: ComplexArray, numbers: NDArray[np.int64], places: FloatArray
) -> ComplexArray:
    rows = [
        (at - axis[0]) / (axis[1] - axis[0])
        for at, axis in zip(places.T, (board.x, board.y), strict=True)
    ]
    parts = [
        map_coordinates(part, [numbers, *rows], order=1, mode="nearest")
        for part in (fields.real, fields.imag)
    ]
    return np.asarray(parts[0] + 1j * parts[1])
