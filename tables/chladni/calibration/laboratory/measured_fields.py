"""What coils do at places, in the units that instruments have, and as metres per newton."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

Response = Literal["displacement", "velocity", "acceleration"]
Per = Literal["force", "current", "voltage"]
RESPONSES: tuple[Response, ...] = ("displacement", "velocity", "acceleration")
"""m, m/s, m/s²; each is iω times the one before."""
PERS: tuple[Per, ...] = ("force", "current", "voltage")
"""N, A and V of the coil that plays."""
MOST_ROWS = 2_000_000


@dataclass(frozen=True)
class MeasuredFields:
    """Complex responses at places, one row each.

    Attributes
    ----------
    coils
        Number of the coil that plays, from 0, (rows,).
    places
        m, from the board's centre, (rows, 2).
    hz
        (rows,).
    values
        Of `response` over `per`, SI, (rows,).
    response, per
        What was measured, and over what.
    sensor_kg
        Mass of the sensor that stands at each place. Its values may be late, all alike.
    """

    coils: NDArray[np.int64]
    places: FloatArray
    hz: FloatArray
    values: ComplexArray
    response: Response = "displacement"
    per: Per = "force"
    sensor_kg: float = 0.0

    def compliance(self, board: Board) -> ComplexArray:
        """The same as m/N, by the board's own force factor and coil, (rows,).

        Raises
        ------
        MissingError
            The board has no `[coil]`, which currents and voltages need.
        """
        omega = 2j * np.pi * self.hz
        found = self.values / omega ** RESPONSES.index(self.response)
        if self.per == "force":
            return np.asarray(found)
        coil = board.known_coil
        if self.per == "voltage":
            found = found * (coil.resistance + omega * coil.inductance)
        return np.asarray(found / coil.force_factor)


def joined(parts: Sequence[MeasuredFields]) -> MeasuredFields:
    """Of one board, in the same units and by the same sensor, one after another."""
    return replace(
        parts[0],
        coils=np.concatenate([own.coils for own in parts]),
        places=np.concatenate([own.places for own in parts]),
        hz=np.concatenate([own.hz for own in parts]),
        values=np.concatenate([own.values for own in parts]),
    )


def checked(fields: MeasuredFields, board: Board, file: str) -> MeasuredFields:
    """The same, if each row can be one of the board's.

    Raises
    ------
    InputError
        Numbers that are none, places off the board, coils that it does not have.
    """
    rows = fields.hz.size
    if not 1 <= rows <= MOST_ROWS:
        raise InputError("rows", f"{rows}", f"1 to {MOST_ROWS}", file=file)
    for name, own, fits in (
        ("frequency", fields.hz, (fields.hz > 0.0) & (fields.hz < 1e6)),
        ("value", fields.values, np.isfinite(fields.values)),
        ("coil", fields.coils, (fields.coils >= 0) & (fields.coils < len(board.actuators))),
    ):
        if not np.all(fits):
            row = int(np.argmin(fits))
            given = own[row].item() + (1 if name == "coil" else 0)
            expected = f"1 to {len(board.actuators)}" if name == "coil" else "a finite one"
            raise InputError(f"{name} of row {row + 1}", given, expected, file=file)
    half = np.array(board.plate.size) / 2.0
    off = np.abs(fields.places) / half
    if not np.all(np.isfinite(off)) or off.max() > 1.05:
        hint = "millimetres from its centre; were axes swapped, or is it in metres?"
        row = int(np.argmax(np.where(np.isfinite(off), off, np.inf).max(axis=1)))
        x, y = (1e3 * fields.places[row]).tolist()
        expected = f"one on {board.name}"
        raise InputError(
            f"place of row {row + 1}", f"{x:g}, {y:g} mm", expected, hint=hint, file=file
        )
    return fields
