"""What coils of a board do at places, with the sensor that stands there.

A sensor of mass m at p pushes with ω² m times what it moves, so it moves by h / (1 − ω² m g), with
h what a coil does there without it, and g what a newton there does there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from chladni.calibration.slopes import patch_slopes, slopes_at_coils
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.induced import open_coils_at
from chladni.sim.fields.transfer import disc_fields
from chladni.sim.plate.response import PlateModel

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
        # A fit keeps some forty solved boards, and a model is a hundred times what it is asked for.
        model = plate_model(board)
        self._coils = open_coils_at(board, self._hz, model=model, tolerance=DRAWN_TOLERANCE)
        self._fields = [np.asarray(own.fields.values) for own in self._coils]
        self._pushed = self._of_stands(model) if sensor_kg > 0.0 else []

    def at(self, row: int, coils: NDArray[np.int64], places: FloatArray) -> ComplexArray:
        """Of a newton of those coils, at those places, at a frequency, m/N, (rows,).

        Straight between image points.
        """
        moved = _between(self._board, self._fields[row], coils, places)
        if self._sensor_kg == 0.0:
            return moved
        return np.asarray(moved / self._loads(row)[self._stands_at(places)])

    def place_slopes(self, row: int, coils: NDArray[np.int64], places: FloatArray) -> ComplexArray:
        """∂ by moves of each coil along x and y of what `at` tells, 1/N, (2 · actuators, rows).

        Of where a coil pushes: the mass that moves with it, and what it is to its neighbours, are
        left out.
        """
        at, coupling = self._stands_at(places), self._coils[row].coupling
        pushes = np.eye(len(self._board.actuators)) if coupling is None else coupling.forces
        slopes = np.stack(slopes_at_coils(self._board, self._pushed_at(row)), axis=1)
        # Of each coil's push where a coil moves: (actuators, 2, rows).
        found = pushes[:, None, coils] * slopes[:, :, at]
        if self._sensor_kg > 0.0:
            found = found / self._loads(row)[at]
        return np.asarray(found.reshape(-1, at.size))

    def patch_slopes(self, row: int, coils: NDArray[np.int64], places: FloatArray) -> ComplexArray:
        """∂ by the logarithm of each patch's stiffness of what `at` tells, (patches, rows)."""
        at, fields, pushed = self._stands_at(places), self._fields[row], self._pushed_at(row)
        of_patches = patch_slopes(self._board, pushed, fields)
        slopes = np.reshape([own[at, coils] for own in of_patches], (-1, at.size))
        if self._sensor_kg == 0.0:
            return slopes
        loads = self._loads(row)[at]
        of_loads = patch_slopes(self._board, pushed, pushed)
        own = np.reshape([np.diag(one)[at] for one in of_loads], slopes.shape)
        return np.asarray((slopes + self.at(row, coils, places) * self._inertia(row) * own) / loads)

    def _pushed_at(self, row: int) -> ComplexArray:
        """Fields of a newton at every place, at a frequency."""
        if not self._pushed:
            self._pushed = self._of_stands(plate_model(self._board))
        return self._pushed[row]

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

    def _of_stands(self, model: PlateModel) -> list[ComplexArray]:
        """Fields of a newton of the sensor, at each of its places, at each frequency."""
        stands = [(x / MM, y / MM) for x, y in self._stands.tolist()]
        return [
            np.asarray(
                disc_fields(
                    self._board,
                    stands,
                    SENSOR_RADIUS,
                    frequency_hz=hz,
                    tolerance=DRAWN_TOLERANCE,
                    model=model,
                    allow_unmet=True,
                ).values
            )
            for hz in self._hz
        ]


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
