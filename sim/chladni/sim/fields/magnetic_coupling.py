"""Magnetic coupling: what coils and magnets do to those of other actuators.

A coil pulls its neighbours' magnets as well as its own, and turns them. Magnets of one polarity
push one another out of their plane, which softens what holds them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.magnetics.coil_coupling import force_and_couple
from chladni.sim.magnetics.magnet_coupling import Magnets
from chladni.sim.magnetics.windings import force_per_ampere
from chladni.sim.plate.loads import Load

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SAME_PLACE = 1e-7
"""m; distances that differ by less are one, so that a grid of coils has few."""
ARM = 0.5
"""Of a magnet's radius: a couple is a force so far from the middle of its rigid disc, less the same
force in the middle."""


@dataclass(frozen=True)
class MagneticCoupling:
    """Forces on all magnets by each coil's unit force on its own, shapes (magnets, coils, …).

    Attributes
    ----------
    forces
        Along the axes; 1 on the diagonal.
    couples
        Against slopes along x and y, m, shape (magnets, coils, 2).
    stiffness
        Of the magnets' places along their axes, N/m, shape (magnets, magnets).
    """

    forces: FloatArray
    couples: FloatArray
    stiffness: FloatArray

    def largest(self, board: Board) -> float:
        """What a neighbour gets of a coil's force at most, as a share."""
        assert board.magnet is not None
        off = self.forces - np.eye(len(self.forces))
        return float(max(abs(off).max(), abs(self.couples).max() / board.magnet.radius))


def magnetic_coupling(board: Board) -> MagneticCoupling | None:
    """What a board's coils and magnets do to their neighbours.

    None where windings or remanence are not known, or coils are to be plain forces.
    """
    magnet, winding = board.magnet, board.winding
    if not board.has_magnetic_coupling or magnet is None or winding is None:
        return None
    size = {"remanence": magnet.remanence, "radius": magnet.radius, "height": magnet.height}
    own = force_per_ampere(winding.round, gap=winding.gap, **size)
    places = np.array([actuator.at for actuator in board.actuators])
    away = places[:, None] - places
    apart = np.hypot(away[..., 0], away[..., 1])
    count = len(places)
    forces, couples = np.eye(count), np.zeros((count, count, 2))
    keys = np.rint(apart / SAME_PLACE)
    for key in np.unique(keys[keys > 0.0]):
        distance = float(key * SAME_PLACE)
        pulls = force_and_couple(winding.round, gap=winding.gap, apart=distance, **size)
        pairs = keys == key
        forces[pairs] = pulls[0] / own
        couples[pairs] = pulls[1] / own * away[pairs] / distance
    stiffness = Magnets(places, **size).axial_stiffness()
    return MagneticCoupling(forces, couples, stiffness)


def couple_loads(board: Board) -> list[Load]:
    """A disc off every magnet's middle, along x and then along y."""
    magnet = board.magnet
    assert magnet is not None
    arm = ARM * magnet.radius
    # A little smaller than would touch the magnet's rim.
    radius = 0.98 * (magnet.radius - arm)
    return [
        Load(actuator.at[0] + dx, actuator.at[1] + dy, radius)
        for actuator in board.actuators
        for dx, dy in ((arm, 0.0), (0.0, arm))
    ]


def couple_fields(board: Board, middles: ComplexArray, arms: ComplexArray) -> ComplexArray:
    """Fields of unit couples, (magnets, 2, nx, ny).

    Parameters
    ----------
    middles, arms
        Fields of unit forces on the magnets, and of `couple_loads`.
    """
    magnet = board.magnet
    assert magnet is not None
    sides = arms.reshape(len(board.actuators), 2, *arms.shape[1:])
    return np.asarray((sides - middles[:, None]) / (ARM * magnet.radius))
