"""What coils of a board do at places, with the sensor that stands there.

A sensor of mass m at p pushes with ω² m times what it moves, so it moves by h / (1 − ω² m g), with
h what a coil does there without it, and g what a newton there does there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

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
        Mass of the sensor, and where it stood, m, (places, 2); no mass and no places without one.
    """

    def __init__(self, board: Board, hz: FloatArray, sensor_kg: float, stands: FloatArray) -> None:
        self._board, self._sensor_kg, self._stands = board, sensor_kg, stands
        self._solved = [self._at_frequency(own) for own in hz.tolist()]

    def at(self, row: int, coils: NDArray[np.int64], places: FloatArray) -> ComplexArray:
        """Of a newton of those coils, at those places, at a frequency, m/N, (rows,).

        Straight between image points.
        """
        fields, loads = self._solved[row]
        moved = _between(self._board, fields, coils, places)
        if self._sensor_kg == 0.0:
            return moved
        apart = np.linalg.norm(places[:, None] - self._stands, axis=2)
        return np.asarray(moved / loads[np.argmin(apart, axis=1)])

    def _at_frequency(self, hz: float) -> tuple[ComplexArray, ComplexArray]:
        """Fields of a newton of each coil, and 1 − ω² m g of each place."""
        board = self._board
        model = plate_model(board)
        own = open_coils(board, hz, model=model, tolerance=DRAWN_TOLERANCE)
        fields = np.asarray(own.fields.values)
        if self._sensor_kg == 0.0:
            return fields, np.ones(len(self._stands), np.complex128)
        pushed = disc_fields(
            board,
            [(x / MM, y / MM) for x, y in self._stands.tolist()],
            SENSOR_RADIUS,
            frequency_hz=hz,
            tolerance=DRAWN_TOLERANCE,
            model=model,
            allow_unmet=True,
        )
        numbers = np.arange(len(self._stands))
        compliance = _between(board, np.asarray(pushed.values), numbers, self._stands)
        return fields, np.asarray(1.0 - (2.0 * np.pi * hz) ** 2 * self._sensor_kg * compliance)


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
