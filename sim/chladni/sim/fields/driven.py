"""Fields of a board's coils as they are driven: a coil's own motion acts back on its current.

    V = (R + iωL) I + BL v,   F = BL I,   v = iω H F

With H, what unit forces at the coils do to the coils (m/N), and Fᵇ = BL V/(R + iωL), the force on a
coil held still, F = (1 + iω BL²/(R + iωL) H)⁻¹ Fᵇ. The span of the fields stays, so the best image
does too, but it takes other voltages.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from chladni.sim.board.board import Board
from chladni.sim.fields.transfer import TOLERANCE, TransferFields, transfer_fields
from chladni.sim.plate.response import PlateModel

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def driven_fields(
    board: Board,
    *,
    tolerance: float = TOLERANCE,
    model: PlateModel | None = None,
    allow_unmet: bool = False,
) -> TransferFields:
    """Displacement per newton that each coil would make if it were held still.

    That force goes with the voltage, and so with the duty. Where coils move so little that they
    change no field by more than `tolerance`, these are the transfer fields.

    Parameters
    ----------
    board, tolerance, model, allow_unmet
        As of `transfer_fields`.
    """
    fields = transfer_fields(board, tolerance=tolerance, model=model, allow_unmet=allow_unmet)
    coupling = coil_coupling(board, fields)
    if np.linalg.norm(coupling, 2) <= tolerance:
        return fields
    forces = np.linalg.inv(np.eye(len(coupling)) + coupling)
    values = np.tensordot(forces.T, fields.values, axes=1)
    return replace(fields, values=values, acts_back=True)


def with_coils(board: Board, driven: TransferFields, fields: ComplexArray) -> ComplexArray:
    """Fields (…, nx, ny) of other forces on the same board, as its coils answer them.

    A coil that is moved drives a current through its supply, which brakes it: with g at the coils,
    g′ = g − iω BL²/(R + iωL) Σ Gⱼ gⱼ, G being the fields as they are driven.
    """
    if not driven.acts_back:
        return fields
    moved = np.stack([at_coils(board, own) for own in fields])
    answer = np.tensordot(moved, driven.values, axes=1)
    return np.asarray(fields - _per_velocity(board, driven.frequency_hz) * answer)


def _per_velocity(board: Board, frequency_hz: float) -> complex:
    """iω BL²/(R + iωL): what brakes a coil per metre, N/m."""
    coil = board.coil
    assert coil is not None
    omega = 2.0 * np.pi * frequency_hz
    electrical = coil.resistance + 1j * omega * coil.inductance
    return 1j * omega * coil.force_factor**2 / electrical


def coil_coupling(board: Board, fields: TransferFields) -> ComplexArray:
    """iω BL²/(R + iωL) H, shape (actuators, actuators); zeros without coils that are known."""
    coil, count = board.coil, len(board.actuators)
    if coil is None or not coil.motion_acts_back:
        return np.zeros((count, count), dtype=np.complex128)
    columns = [at_coils(board, values) for values in fields.values]
    return np.asarray(_per_velocity(board, fields.frequency_hz) * np.stack(columns, axis=1))


def at_coils(board: Board, values: ComplexArray | FloatArray) -> ComplexArray:
    """One field, shape (nx, ny), at every coil, shape (actuators,).

    Between image points it is taken as straight. Under a rigid magnet it is.
    """
    places = np.array([actuator.at for actuator in board.actuators]).T
    axes = (board.x, board.y)
    rows = [(at - axis[0]) / (axis[1] - axis[0]) for at, axis in zip(places, axes, strict=True)]
    parts = [
        map_coordinates(part, rows, order=1, mode="nearest") for part in (values.real, values.imag)
    ]
    return np.asarray(parts[0] + 1j * parts[1])
