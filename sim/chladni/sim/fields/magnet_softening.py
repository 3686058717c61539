"""How much a board's magnets soften what holds them, by pushing each other out of their plane."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from chladni.sim.board.board import Board
from chladni.sim.errors import ToleranceError
from chladni.sim.fields.driven import moved_coils
from chladni.sim.fields.static import static_fields
from chladni.sim.magnetics.magnet_coupling import Magnets
from chladni.sim.plate.response import PlateModel

MATTERS = 0.05
"""Share of softening that is reported: it moves a field by about as much, half a decibel."""


@dataclass(frozen=True)
class MagnetSoftening:
    """Magnets all the same way up; the other way about they attract and stiffen as much.

    Attributes
    ----------
    lateral_n
        Largest push on a magnet along the plate, N.
    stiffness_n_per_mm
        Of one that moves by itself, the most among all; below zero, since they push it out.
    held_n_per_mm
        Least stiffness of plate and foundation under a magnet; None where nothing holds
        the plate, or its fields are not exact enough.
    softened
        Largest share of what holds the magnets, in any pattern of motion, that they take away; from
        1 on they snap out of the plane. None as before.
    """

    lateral_n: float
    stiffness_n_per_mm: float
    held_n_per_mm: float | None
    softened: float | None


def magnet_softening(board: Board, model: PlateModel) -> MagnetSoftening | None:
    """What the magnets of a board do to each other; None where their remanence is not known.

    With H, what unit forces at the magnets do to them, and K < 0 their stiffness, the plate
    answers as (H⁻¹ + K)⁻¹: the eigenvalues of −HK are the shares taken away.
    """
    magnet = board.magnet
    if magnet is None or not magnet.remanence or len(board.actuators) < 2:
        return None
    places = np.array([actuator.at for actuator in board.actuators])
    magnets = Magnets(places, magnet.remanence, magnet.radius, magnet.height)
    stiffness = magnets.axial_stiffness()
    held = softened = steady = None
    with suppress(ToleranceError):  # of a plate that is hard to follow only the forces are reported
        steady = static_fields(board, model)
    if steady is not None:
        compliance = moved_coils(board, steady).real
        held = 1e-3 / float(np.diag(compliance).max())
        softened = float(np.abs(np.linalg.eigvals(compliance @ stiffness)).max())
    return MagnetSoftening(
        lateral_n=float(np.hypot(*magnets.lateral_forces().T).max()),
        stiffness_n_per_mm=1e-3 * float(np.diag(stiffness).min()),
        held_n_per_mm=held,
        softened=softened,
    )
