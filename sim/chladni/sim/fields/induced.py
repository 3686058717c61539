"""What a driven coil makes the others read: the voltages that motion and flux induce in them.

    E = iω (BL² G + L) I,   G = Bᵀ W

A coil that is not driven is open, so no current flows in it and it does not brake. W is what a
newton of each driven coil does to the plate, its pulls on its neighbours' magnets included, and B
takes of that what a coil feels: by reciprocity, its magnet's motion and its neighbours' in the same
shares. L are the flux's own, which flow where nothing moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.driven import answered, forces_and_couples, moved_coils
from chladni.sim.fields.magnetic_coupling import ARM, MagneticCoupling, magnetic_coupling
from chladni.sim.fields.transfer import TOLERANCE, TransferFields, transfer_fields
from chladni.sim.magnetics.coil_coupling import mutual_inductance
from chladni.sim.plate.response import PlateModel

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class OpenCoils:
    """A board's coils while one of them plays and the others are open.

    Attributes
    ----------
    fields
        Of a newton of each coil, (actuators, nx, ny), m/N.
    compliance
        G: what coil i (row) feels of a newton of coil j (column), m/N, (actuators, actuators).
    coupling
        Of coils and magnets, where that is known.
    """

    fields: TransferFields
    compliance: ComplexArray
    coupling: MagneticCoupling | None


def open_coils(
    board: Board,
    frequency_hz: float,
    *,
    model: PlateModel | None = None,
    tolerance: float = TOLERANCE,
) -> OpenCoils:
    """What each coil does to the plate and the others, none of them braked.

    Parameters
    ----------
    model
        `plate_model(board)`, if it is at hand.
    tolerance
        Relative L² error of the fields; larger ones are handed out all the same.
    """
    board = replace(board, drive=replace(board.drive, frequency_hz=frequency_hz))
    model = model or plate_model(board)
    coupling = magnetic_coupling(board)
    if coupling is None:
        bare = transfer_fields(board, tolerance=tolerance, model=model, allow_unmet=True)
        values = np.asarray(bare.values)
        return OpenCoils(bare, moved_coils(board, values), None)
    bare, couples = forces_and_couples(board, model, tolerance, allow_unmet=True)
    fields = answered(board, bare, coupling, couples, are_open=True)
    return OpenCoils(fields, _felt(board, fields.values, coupling), coupling)


def open_coils_at(
    board: Board, frequencies_hz: Sequence[float], *, model: PlateModel, tolerance: float
) -> list[OpenCoils]:
    """Coils at several frequencies, from the highest down: the basis for that one does for all."""
    found = {
        hz: open_coils(board, hz, model=model, tolerance=tolerance)
        for hz in sorted(frequencies_hz, reverse=True)
    }
    return [found[hz] for hz in frequencies_hz]


def _felt(board: Board, values: ComplexArray, coupling: MagneticCoupling) -> ComplexArray:
    """What coils feel of fields (fields, nx, ny): shape (coils, fields), m/N."""
    moved = moved_coils(board, values)
    arm = ARM * board.magnet.radius if board.magnet else 0.0
    felt = coupling.forces.T @ moved
    for axis in (0, 1):
        shift = tuple(arm * float(k == axis) for k in (0, 1))
        beside = moved_coils(board, values, shift)
        felt = felt + coupling.couples[:, :, axis].T @ ((beside - moved) / arm)
    return np.asarray(felt)


def shared_inductances(board: Board) -> FloatArray:
    """Of every pair of coils, H, (actuators, actuators), 0 on the diagonal.

    Zeros on a board whose windings are not known.
    """
    count = len(board.actuators)
    shared = np.zeros((count, count))
    if board.winding is None:
        return shared
    places = np.array([actuator.at for actuator in board.actuators])
    for i in range(count):
        for j in range(i):
            apart = float(np.hypot(*(places[i] - places[j])))
            shared[i, j] = shared[j, i] = mutual_inductance(board.winding.round, apart)
    return shared


def induced_voltages(board: Board, compliance: ComplexArray, frequency_hz: float) -> ComplexArray:
    """By motion alone, per ampere: iω BL² G, V/A, (coils that listen, coils that play).

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    return np.asarray(2j * np.pi * frequency_hz * board.known_coil.force_factor**2 * compliance)
