"""How what coils feel of each other changes with the plate: first order, from the fields alone.

A little more stiffness k ψ(x, y) under the plate changes what coil i feels of coil j by
−k ∫ψ Wᵢ Wⱼ dA, a little more mass by +ω² ∫m Wᵢ Wⱼ dA; W are the fields of a newton of each. If all
stiffness and all mass grow alike, every answer falls alike: Σ ∂G/∂ln(…) = −G. Bending stiffness or
foam takes what the others leave. A coil that moves listens where it moved to, and pushes there; its
magnet's mass and the hole in the foam go with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.unknowns import Unknowns, uneven_feet
from chladni.drives.fingers.responses import interpolated
from chladni.drives.scoring.tolerances import with_moved_coils
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Spring
from chladni.sim.errors import InputError
from chladni.sim.fields.board_plate import plate_geometry
from chladni.sim.fields.driven import moved_coils
from chladni.sim.fields.induced import OpenCoils
from chladni.sim.fields.magnetic_coupling import MagneticCoupling, magnetic_coupling
from chladni.sim.plate.geometry import PlateGeometry, patch_weights

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MOVE = 2e-5
"""m, over which neighbours' forces are taken to change in proportion."""


def compliance_slopes(
    unknowns: Unknowns,
    board: Board,
    coils: OpenCoils,
    frequency_hz: float,
    differences: Mapping[str, ComplexArray],
) -> ComplexArray:
    """∂G by every unknown but the forces, (unknowns − actuators, actuators, actuators).

    Parameters
    ----------
    board
        As it is for the values at which the slopes are wanted.
    coils
        Of that board, at this frequency.
    differences
        ∂G by the logarithms of those scales that are found by solving once more. Fields about a
        screw are steeper than image points are close. Foam and bending nearly balance each other on
        a soft sheet, and the foam's integral is not exact to what bending leaves.
    """
    parts = _Parts(board, coils, frequency_hz)
    screws = differences.get("screws", np.zeros_like(coils.compliance))
    others = parts.mass + parts.magnets_mass + parts.magnets_pull + screws
    others += parts.feet + parts.riders_mass
    foam = parts.foam
    bending = -coils.compliance - others - foam
    if "modulus" in differences:
        bending = differences["modulus"]
        foam = -coils.compliance - others - bending
    by_name = {
        "sheet thickness": 3.0 * bending + parts.mass,
        "modulus": bending,
        "sheet's loss": parts.sheet_loss(bending, screws),
        "foam": foam,
        "foam's loss": parts.foam_loss,
        "screws": screws,
        "feet": parts.feet,
    }
    slopes = [by_name[name] for name in unknowns.scales]
    return np.array([*slopes, *parts.patches(), *parts.places()])


def patch_slopes(board: Board, first: ComplexArray, second: ComplexArray) -> list[ComplexArray]:
    """∂ by the logarithm of each patch's stiffness of what a newton at one place does at another.

    And of each foot's. Of fields (fields, nx, ny) of newtons at both, every one of the first with
    every one of the second.
    """
    found: list[ComplexArray] = []
    geometry = plate_geometry(board)
    layer = geometry.foundation
    if layer is not None and layer.patches:
        one, other = (own.reshape(len(own), -1) for own in (first, second))
        grid = np.meshgrid(board.x, board.y, indexing="ij")
        stiffness = (1.0 + 1j * layer.loss_factor) * _foundation(geometry, grid) * _areas(board)
        shares = patch_weights(layer.patches, *grid)
        found += [np.asarray(-(one * (stiffness * own).ravel()) @ other.T) for own in shares]
    feet = uneven_feet(board)
    at = np.array([own.at for own in feet]).reshape(-1, 2)
    one, other = (interpolated(board.x, board.y, own, at) for own in (first, second))
    return found + [
        np.asarray(-stiffness * np.outer(one[:, k], other[:, k]))
        for k, stiffness in enumerate(_of_springs(board, feet))
    ]


def _of_springs(board: Board, feet: Sequence[Spring]) -> ComplexArray:
    """Of each, k (1 + iη), N/m; the plate's η where it has none of its own."""
    plate = board.section.loss_factor
    losses = [plate if own.loss_factor is None else own.loss_factor for own in feet]
    return np.array([own.stiffness for own in feet]) * (1.0 + 1j * np.array(losses))


def slopes_at_coils(board: Board, fields: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Of fields (fields, nx, ny) along x and along y, at every coil: (actuators, fields) each."""
    step = board.magnet.radius / 2.0 if board.magnet else float(board.x[1] - board.x[0])
    found = []
    for shift in ((step, 0.0), (0.0, step)):
        back = (-shift[0], -shift[1])
        ahead, behind = (moved_coils(board, fields, by) for by in (shift, back))
        found.append(np.asarray((ahead - behind) / (2.0 * step)))
    return found[0], found[1]


@lru_cache(maxsize=1)
def _moved_couplings(board: Board) -> list[MagneticCoupling | None]:
    """With each coil moved along x and along y; None where its winding touches another's.

    The same at every frequency.
    """
    found: list[MagneticCoupling | None] = []
    for move in np.eye(2 * len(board.actuators)) * MOVE:
        try:
            found.append(magnetic_coupling(with_moved_coils(board, move.reshape(-1, 2))))
        except InputError:
            found.append(None)
    return found


class _Parts:
    """Shares of a board's parts in what its coils feel, each for a part that grows by e."""

    def __init__(self, board: Board, coils: OpenCoils, frequency_hz: float) -> None:
        self._board, self._coils = board, coils
        self._values = np.asarray(coils.fields.values)
        self._omega = 2.0 * np.pi * frequency_hz
        self._at = moved_coils(board, self._values)
        self._area = _areas(board)
        self._geometry = plate_geometry(board)
        self._grid = np.meshgrid(board.x, board.y, indexing="ij")

    def _integral(self, weight: FloatArray) -> ComplexArray:
        """∫ weight Wᵢ Wⱼ dA."""
        flat = self._values.reshape(len(self._values), -1)
        return np.asarray((flat * (weight * self._area).ravel()) @ flat.T)

    @property
    def mass(self) -> ComplexArray:
        """Of the sheet."""
        own = np.full(self._area.shape, self._geometry.areal_mass)
        return np.asarray(self._omega**2 * self._integral(own))

    @property
    def _magnet_mass(self) -> float:
        """Of one, kg."""
        magnet = self._board.magnet
        return magnet.areal_mass * np.pi * magnet.radius**2 if magnet else 0.0

    @property
    def magnets_mass(self) -> ComplexArray:
        """Of all magnets, discs that turn as they move."""
        moved = self._at.T @ self._at
        if self._board.magnet is not None:
            arm = self._board.magnet.radius / 2.0
            moved = moved + arm**2 * sum(own.T @ own for own in self._slopes)
        return np.asarray(self._omega**2 * self._magnet_mass * moved)

    @property
    def riders_mass(self) -> ComplexArray:
        """Of what else rides on the plate."""
        moved = self._at_places([own.at for own in self._board.masses])
        masses = np.array([own.mass for own in self._board.masses])
        return np.asarray(self._omega**2 * (moved * masses) @ moved.T)

    @property
    def feet(self) -> ComplexArray:
        """Of all feet, each at its point."""
        return self._of_feet(self._board.springs)

    def _of_feet(self, feet: Sequence[Spring]) -> ComplexArray:
        moved = self._at_places([own.at for own in feet])
        return np.asarray(-(moved * _of_springs(self._board, feet)) @ moved.T)

    def sheet_loss(self, bending: ComplexArray, screws: ComplexArray) -> ComplexArray:
        """Of what the sheet loses, and with it feet and screws whose file names no loss.

        Parameters
        ----------
        bending, screws
            Of their stiffness.
        """
        board = self._board
        twice = replace(board.plate, loss_factor=2.0 * board.plate.loss_factor)
        own = board.section.loss_factor
        # A panel's layer has its own, and the section's is a mean.
        more = replace(board, plate=twice).section.loss_factor - own
        lossy = bending + self._of_feet(
            [foot for foot in board.springs if foot.loss_factor is None]
        )
        if all(screw.loss_factor is None for screw in board.screws):
            lossy = lossy + screws
        return np.asarray(1j * more / (1.0 + 1j * own) * lossy)

    def _at_places(self, places: Sequence[tuple[float, float]]) -> ComplexArray:
        """Every field at places, (coils, places)."""
        at = np.array(places).reshape(-1, 2)
        return interpolated(self._board.x, self._board.y, self._values, at)

    @property
    def magnets_pull(self) -> ComplexArray:
        """Of the springs that magnets are to each other."""
        if self._coils.coupling is None:
            return np.zeros(self._at.shape, np.complex128)
        return np.asarray(-(self._at.T @ self._coils.coupling.stiffness @ self._at))

    @cached_property
    def _foundation(self) -> FloatArray:
        return _foundation(self._geometry, self._grid)

    @property
    def _loss(self) -> float:
        """Of the foundation."""
        layer = self._geometry.foundation
        return layer.loss_factor if layer else 0.0

    @cached_property
    def foam(self) -> ComplexArray:
        """Of the foundation."""
        return np.asarray(-(1.0 + 1j * self._loss) * self._integral(self._foundation))

    def patches(self) -> list[ComplexArray]:
        """Of each patch of the foundation, and of each foot."""
        return patch_slopes(self._board, self._values, self._values)

    @property
    def foam_loss(self) -> ComplexArray:
        """Of what the foundation loses."""
        return np.asarray(-1j * self._loss * self._integral(self._foundation))

    def places(self) -> list[ComplexArray]:
        """Of moves of each coil along x and along y, m."""
        result = []
        coupling = self._coils.coupling
        pushes = np.eye(len(self._at)) if coupling is None else coupling.forces
        carried = self._omega**2 * self._magnet_mass + self._holes
        for coil, moved in enumerate(self._at):
            for axis in (0, 1):
                slope = self._slopes[axis][coil]
                own = np.outer(carried[coil] * moved + pushes[coil], slope)
                result.append(own + own.T + self._of_neighbours(coil, axis))
        return result

    def _of_neighbours(self, coil: int, axis: int) -> ComplexArray | float:
        """Of what magnets and coils do to each other, where one of them moves."""
        before = self._coils.coupling
        if before is None:
            return 0.0
        after = _moved_couplings(self._board)[2 * coil + axis]
        if after is None:
            return 0.0
        felt = (after.forces - before.forces).T @ self._at
        for own, slopes in zip((0, 1), self._slopes, strict=True):
            felt = felt + (after.couples - before.couples)[:, :, own].T @ slopes
        pull = self._at.T @ (after.stiffness - before.stiffness) @ self._at
        return np.asarray((felt + felt.T - pull) / MOVE)

    @property
    def _holes(self) -> ComplexArray:
        """Stiffness that the hole about each coil takes from the foam, N/m."""
        layer, own = self._geometry.foundation, self._board.foundation
        places = np.array([actuator.at for actuator in self._board.actuators])
        if layer is None or own is None:
            return np.zeros(len(places), np.complex128)
        stiffness = layer.stiffness * layer.ratio(*places.T) * np.pi * own.coil_cut_out**2
        return np.asarray((1.0 + 1j * layer.loss_factor) * stiffness)

    @cached_property
    def _slopes(self) -> tuple[ComplexArray, ComplexArray]:
        """At every coil (row), of the field of every coil (column)."""
        return slopes_at_coils(self._board, self._values)


def _foundation(geometry: PlateGeometry, grid: Sequence[FloatArray]) -> FloatArray:
    """Stiffness of the foundation at image points, N/m³."""
    layer = geometry.foundation
    return layer.stiffness * layer.lies(*grid) if layer else np.zeros(grid[0].shape)


def _areas(board: Board) -> FloatArray:
    """Of image points, m²."""
    return np.outer(*(_weights(axis) for axis in (board.x, board.y)))


def _weights(axis: FloatArray) -> FloatArray:
    """Of the trapezium rule on equal steps."""
    own = np.full(axis.size, axis[1] - axis[0])
    own[[0, -1]] /= 2.0
    return own
