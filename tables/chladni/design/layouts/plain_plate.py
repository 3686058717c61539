"""A plate without coils, and what coils would do to it wherever they stood.

The plate is solved for a newton at each candidate. A magnet adds its mass there and takes away the
foam that its cut-out has, so with δ = −ω²m − k(1 + iη)πr² on the diagonal and Z the plate's
receptance among the chosen coils, their fields are H(1 + δZ)⁻¹: exact for masses and foam at
points. What magnets do besides, holding the plate flat where they are glued, needs the plate to be
solved again; so this only ranks layouts, and the search solves the best ones again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.design.layouts.layouts import Place
from chladni.drives.problem.threads import one_blas_thread
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Image
from chladni.sim.board.quantity import MM
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.transfer import disc_fields
from chladni.sim.image import metrics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

POINT = 2e-3
"""m between points of the fields; a finger covers 28."""
TOLERANCE = 2e-2


@dataclass(frozen=True)
class PlainPlate:
    """A plate without coils, and what a newton at each candidate does to it.

    Attributes
    ----------
    x, y
        Coordinates of its points, m.
    fields
        Shape (orbits' coils, points), m/N.
    at_coils
        The same in the candidates' discs, shape (coils, coils).
    delta
        What a coil adds to the plate where it stands, N/m.
    """

    x: FloatArray
    y: FloatArray
    fields: ComplexArray
    at_coils: ComplexArray
    delta: complex

    @classmethod
    def of(cls, board: Board, coils: Sequence[Place]) -> PlainPlate:
        """Solve the plate of a board, whose own coils are left out."""
        plain = _without_coils(board)
        radius = board.magnet.radius if board.magnet else 0.0
        with one_blas_thread():
            values = disc_fields(
                plain,
                [(x / MM, y / MM) for x, y in coils],
                radius,
                tolerance=TOLERANCE,
                model=plate_model(plain),
                allow_unmet=True,
            ).values
        flat = values.reshape(len(coils), -1)
        under = [
            metrics.disc_mask(plain.x, plain.y, one, max(radius, POINT)).ravel() for one in coils
        ]
        at_coils = flat @ np.array([disc / disc.sum() for disc in under]).T
        return cls(plain.x, plain.y, flat, at_coils, _added(board))

    def fingers(self, places: Sequence[Place]) -> FloatArray:
        """Rows that take the mean under the finger at each place, shape (places, points)."""
        discs = [
            metrics.disc_mask(self.x, self.y, one, metrics.FINGERTIP_RADIUS).ravel()
            for one in places
        ]
        return np.array([disc / disc.sum() for disc in discs])

    def with_coils(self, chosen: Sequence[int], values: ComplexArray) -> ComplexArray:
        """What chosen coils do with all of them on the plate.

        Parameters
        ----------
        values
            Of all candidates, each alone on the plate: their fields or means of these, shape
            (orbits' coils, …).
        """
        own = list(chosen)
        coupling = np.eye(len(own)) + self.delta * self.at_coils[np.ix_(own, own)]
        return np.asarray(np.linalg.solve(coupling.T, values[own]), complex)


def _without_coils(board: Board) -> Board:
    """The plate as it is before coils are on it, with fewer image points."""
    foundation = board.foundation
    if foundation is not None:
        foundation = replace(foundation, coil_cut_out=0.0)
    points = tuple(max(7, round(side / POINT) + 1) for side in board.plate.size)
    return replace(
        board, magnet=None, coil=None, foundation=foundation, image=Image((points[0], points[1]))
    )


def _added(board: Board) -> complex:
    """Dynamic stiffness that a coil adds at its place: its magnet's mass, less the foam's."""
    omega = 2.0 * np.pi * board.drive.frequency_hz
    magnet, foundation = board.magnet, board.foundation
    added = 0.0 + 0.0j
    if magnet is not None:
        added -= omega**2 * magnet.areal_mass * np.pi * magnet.radius**2
    if foundation is not None:
        area = np.pi * foundation.coil_cut_out**2
        loss = 1.0 + 1j * foundation.total_loss_factor
        added -= foundation.total_stiffness * loss * area
    return added
