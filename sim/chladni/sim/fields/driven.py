"""Fields of a board's coils as they are driven: coils and magnets answer to one another.

    V = (R + iωL) I + BL v,   Fᵇ = BL V/(R + iωL),   F = M Fᵇ − Z w,   w = H F + w_c

Fᵇ is the force of a coil on its own magnet if that were held still, and goes with the duty. M are
the forces of every coil on every magnet, Z = iω BL²/(R + iωL) + K brakes a coil that moves, K < 0
being the magnets' push out of their plane, H is what unit forces at the magnets do to them, and w_c
what the couples do that coils exert on other magnets. So F = (1 + Z H)⁻¹ (M Fᵇ − Z w_c).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.magnetic_coupling import (
    MagneticCoupling,
    couple_fields,
    couple_loads,
    magnetic_coupling,
)
from chladni.sim.fields.transfer import (
    TOLERANCE,
    TransferFields,
    actuator_loads,
    fields_of_loads,
    transfer_fields,
)
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
    """Displacement per newton that each coil would make if its magnet were held still.

    That force goes with the voltage, and so with the duty. Where nothing of it changes a field by
    more than `tolerance`, these are the transfer fields. A dead coil makes none.

    Parameters
    ----------
    board, tolerance, model, allow_unmet
        As of `transfer_fields`.
    """
    fields = _driven(board, tolerance, model or plate_model(board), allow_unmet=allow_unmet)
    lives = np.array([not actuator.is_dead for actuator in board.actuators])
    if np.all(lives):
        return fields
    return replace(fields, values=np.where(lives[:, None, None], fields.values, 0.0))


def _driven(
    board: Board, tolerance: float, model: PlateModel, *, allow_unmet: bool
) -> TransferFields:
    coupling = magnetic_coupling(board)
    if coupling is None or coupling.largest(board) <= tolerance:
        bare = transfer_fields(board, tolerance=tolerance, model=model, allow_unmet=allow_unmet)
        if np.linalg.norm(back_emf_coupling(board, bare), 2) <= tolerance:
            return bare
        if coupling is None:
            return answered(board, bare, None, None)
    bare, couples = forces_and_couples(board, model, tolerance, allow_unmet=allow_unmet)
    return answered(board, bare, coupling, couples)


def forces_and_couples(
    board: Board, model: PlateModel, tolerance: float, *, allow_unmet: bool
) -> tuple[TransferFields, ComplexArray]:
    """Fields of a unit force and of unit couples on each magnet, (magnets, 2, nx, ny).

    Of one solution: factors that have been read for one load are read for all.
    """
    loads, count = actuator_loads(board), len(board.actuators)
    found = fields_of_loads(
        board,
        [*loads, *couple_loads(board)],
        model=model,
        tolerance=tolerance,
        allow_unmet=allow_unmet,
    )
    bare = TransferFields(
        board.x,
        board.y,
        found.values[:count],
        found.frequency_hz,
        found.modes_used,
        found.error_estimate,
        tolerance,
    )
    return bare, couple_fields(board, found.values[:count], found.values[count:])


def answered(
    board: Board,
    bare: TransferFields,
    coupling: MagneticCoupling | None,
    couples: ComplexArray | None,
    *,
    are_open: bool = False,
) -> TransferFields:
    """Fields as coils and magnets answer to one another.

    Parameters
    ----------
    bare
        Fields of a unit force on each magnet.
    coupling, couples
        Their magnetic coupling, and fields of unit couples, (magnets, 2, nx, ny).
    are_open
        Whether no current flows in any coil but what makes its force, so that none is braked.
    """
    count = len(board.actuators)
    own: ComplexArray = np.asarray(bare.values)
    motion, pulls = moved_coils(board, own), np.eye(count, dtype=np.complex128)
    turned = np.zeros_like(own)
    braked = 0.0 if are_open else _per_velocity(board, bare.frequency_hz)
    resists = braked * np.eye(count)
    if coupling is not None and couples is not None:
        turned = np.tensordot(coupling.couples, couples, axes=((0, 2), (0, 1)))
        pulls = coupling.forces.astype(np.complex128)
        resists = resists + coupling.stiffness
    answers = np.linalg.inv(np.eye(count) + resists @ motion)
    forces = answers @ (pulls - resists @ moved_coils(board, turned))
    return replace(
        bare,
        values=np.asarray(np.tensordot(forces.T, own, axes=1) + turned),
        reaction=np.asarray(np.tensordot((answers @ resists).T, own, axes=1)),
    )


def with_coils(board: Board, driven: TransferFields, fields: ComplexArray) -> ComplexArray:
    """Fields (…, nx, ny) of other forces on the same board, as its coils and magnets answer them.

    With g at the magnets, g′ = g − Σ Rⱼ gⱼ, R = W (1 + Z H)⁻¹ Z.
    """
    if driven.reaction is None:
        return fields
    moved = moved_coils(board, fields).T
    return np.asarray(fields - np.tensordot(moved, driven.reaction, axes=1))


def _per_velocity(board: Board, frequency_hz: float) -> complex:
    """iω BL²/(R + iωL): what brakes a coil per metre, N/m."""
    coil = board.coil
    assert coil is not None
    omega = 2.0 * np.pi * frequency_hz
    electrical = coil.resistance + 1j * omega * coil.inductance
    return 1j * omega * coil.force_factor**2 / electrical


def back_emf_coupling(board: Board, fields: TransferFields) -> ComplexArray:
    """iω BL²/(R + iωL) H, shape (actuators, actuators); zeros without coils that are known."""
    coil, count = board.coil, len(board.actuators)
    if coil is None or not coil.motion_acts_back:
        return np.zeros((count, count), dtype=np.complex128)
    braked = _per_velocity(board, fields.frequency_hz)
    return np.asarray(braked * moved_coils(board, np.asarray(fields.values)))


def moved_coils(
    board: Board, values: ComplexArray | FloatArray, shift: tuple[float, ...] = (0.0, 0.0)
) -> ComplexArray:
    """As `at_coils` of several fields (fields, nx, ny); shape (actuators, fields)."""
    return np.stack([at_coils(board, own, shift) for own in values], axis=1)


def at_coils(
    board: Board, values: ComplexArray | FloatArray, shift: tuple[float, ...] = (0.0, 0.0)
) -> ComplexArray:
    """One field, shape (nx, ny), at every coil, or so far beside it (m); shape (actuators,).

    Between image points it is taken as straight. Under a rigid magnet it is.
    """
    # A tenth of a second of SciPy, which only coils that move need.
    from scipy.ndimage import map_coordinates  # noqa: PLC0415

    places = (np.array([actuator.at for actuator in board.actuators]) + shift).T
    axes = (board.x, board.y)
    rows = [(at - axis[0]) / (axis[1] - axis[0]) for at, axis in zip(places, axes, strict=True)]
    parts = [
        map_coordinates(part, rows, order=1, mode="nearest") for part in (values.real, values.imag)
    ]
    return np.asarray(parts[0] + 1j * parts[1])
