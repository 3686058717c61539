"""Finite-element routes to the same fields: scikit-fem's Argyris elements, and the test oracle's.

Both work on the oracle's graded meshes (tests/plate_fem/mesh.py), which follow screws and magnets.
scikit-fem shares all second derivatives at a vertex, so it converges slowly where the stiffness
jumps; the oracle splits them there.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementTriArgyris, MeshTri
from skfem.helpers import dd, ddot, trace

from chladni.sim.board.board import Board
from chladni.sim.fields.board_plate import plate_geometry
from chladni.sim.fields.transfer import actuator_loads
from chladni.sim.ritz.basis import quadrature

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
from plate_fem.mesh import Disc, PlateMesh, plate_mesh
from plate_fem.plate import ArgyrisPlate, Inclusion, Material

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
FACTORS = {
    "permc_spec": "MMD_AT_PLUS_A",
    "diag_pivot_thresh": 0.001,
    "options": {"SymmetricMode": True},
}


@dataclass(frozen=True)
class FemRun:
    """One finite-element solution; `seconds` is all of it, `image_seconds` the evaluation alone."""

    fields: ComplexArray
    unknowns: int
    seconds: float
    image_seconds: float


def mesh_of(board: Board, size: float, segments: int) -> PlateMesh:
    """A mesh that follows the board's screws and magnets; `size` in metres."""
    geometry = plate_geometry(board)
    return plate_mesh(
        geometry.width,
        geometry.length,
        [Disc(rim.x, rim.y, rim.radius) for rim in geometry.rims],
        [Disc(disc.x, disc.y, disc.radius) for disc in geometry.inclusions],
        size,
        segments=segments,
    )


def oracle(board: Board, frequency_hz: float, size: float, segments: int) -> FemRun:
    """The test suite's Argyris elements, a few hundred lines of NumPy made for this plate."""
    started = time.perf_counter()
    plate, geometry = board.plate, plate_geometry(board)
    material = Material(
        plate.youngs_modulus,
        plate.poissons_ratio,
        plate.density,
        plate.thickness,
        plate.loss_factor,
    )
    elements = ArgyrisPlate(
        mesh_of(board, size, segments),
        material,
        [Inclusion(disc.areal_mass, disc.stiffness_ratio) for disc in geometry.inclusions],
        "free" if geometry.rims else "supported",
    )
    points = np.stack(np.meshgrid(board.x, board.y, indexing="ij"), axis=-1).reshape(-1, 2)
    loads = [((load.x, load.y), load.radius) for load in actuator_loads(board)]
    # The solver goes through the image's points by itself; its share is not told apart.
    fields = elements.responses(loads, frequency_hz, points)
    return FemRun(
        fields.reshape(len(loads), board.x.size, board.y.size),
        elements.stiffness.shape[0],
        time.perf_counter() - started,
        0.0,
    )


def scikit_fem(board: Board, frequency_hz: float, size: float, segments: int) -> FemRun:
    """scikit-fem as its users would write it: assemble, factorise, solve, probe the image."""
    started = time.perf_counter()
    plate, geometry = board.plate, plate_geometry(board)
    nu, width = plate.poissons_ratio, geometry.width
    mesh = mesh_of(board, size, segments)
    # Lengths in board widths, so that the element's monomials stay of order one.
    points = np.ascontiguousarray(mesh.points.T / width)
    basis = Basis(
        MeshTri(points, np.ascontiguousarray(mesh.triangles.T)), ElementTriArgyris(), intorder=8
    )
    bending, areal = np.full(mesh.regions.size, 1.0), np.full(mesh.regions.size, 1.0)
    for number, disc in enumerate(geometry.inclusions):
        bending[mesh.regions == number] *= disc.stiffness_ratio
        areal[mesh.regions == number] += disc.areal_mass / plate.areal_mass

    @BilinearForm
    def strain(u, v, w):  # type: ignore[no-untyped-def]
        return w.ratio * ((1 - nu) * ddot(dd(u), dd(v)) + nu * trace(dd(u)) * trace(dd(v)))

    @BilinearForm
    def inertia(u, v, w):  # type: ignore[no-untyped-def]
        return w.ratio * u * v

    spread = np.ones((1, basis.dx.shape[1]))
    stiffness = (
        plate.bending_stiffness / width**2 * strain.assemble(basis, ratio=bending[:, None] * spread)
    )
    mass = plate.areal_mass * width**2 * inertia.assemble(basis, ratio=areal[:, None] * spread)
    free = _free_unknowns(basis, board)
    dynamic = (1 + 1j * plate.loss_factor) * stiffness - (2 * np.pi * frequency_hz) ** 2 * mass
    factor = splu(csc_array(free.T @ dynamic @ free), **FACTORS)
    forces = np.stack([_force(basis, load, width) for load in actuator_loads(board)], axis=1)
    solution = free @ factor.solve((free.T @ forces).astype(complex))
    solved = time.perf_counter()
    grid = np.stack(np.meshgrid(board.x, board.y, indexing="ij")).reshape(2, -1)
    on_plate = np.ones(grid.shape[1], dtype=bool)
    for rim in geometry.rims:
        # The mesh's rim is a polygon of the same area, and reaches out a little.
        on_plate &= np.hypot(grid[0] - rim.x, grid[1] - rim.y) > 1.03 * rim.radius
    fields = np.zeros((solution.shape[1], grid.shape[1]), dtype=complex)
    inside = (1 - 1e-9) / width
    fields[:, on_plate] = (basis.probes(grid[:, on_plate] * inside) @ solution).T
    ended = time.perf_counter()
    shape = (solution.shape[1], board.x.size, board.y.size)
    return FemRun(fields.reshape(shape), free.shape[1], ended - started, ended - solved)


def _force(basis: Basis, load: object, width: float) -> FloatArray:
    """A unit load as work on the unknowns."""
    if load.radius == 0.0:  # type: ignore[attr-defined]
        points, weights = np.array([[load.x], [load.y]]), np.ones(1)  # type: ignore[attr-defined]
    else:
        disc = quadrature.disc(load.x, load.y, load.radius, 12, 48)  # type: ignore[attr-defined]
        points, weights = np.stack((disc.x, disc.y)), disc.weights / disc.weights.sum()
    return np.asarray(basis.probes(points / width).T @ weights)


def _free_unknowns(basis: Basis, board: Board) -> csr_array:
    """Matrix from the free unknowns to all of them: screws clamped, or outer edges supported."""
    geometry, mesh = plate_geometry(board), basis.mesh
    held: list[Sequence[int]] = []
    extra: list[tuple[NDArray[np.intp], FloatArray]] = []
    vertices = mesh.boundary_nodes()
    x, y = mesh.p * geometry.width
    for rim in geometry.rims:
        own = vertices[np.hypot(x[vertices] - rim.x, y[vertices] - rim.y) < 1.1 * rim.radius]
        held.append(basis.nodal_dofs[:, own].ravel())
        angle = np.arctan2(y[own] - rim.y, x[own] - rim.x)
        # Along a clamped rim only the second derivative across it is left.
        across = np.array([np.cos(angle) ** 2, np.cos(angle) * np.sin(angle), np.sin(angle) ** 2])
        extra += list(zip(basis.nodal_dofs[3:, own].T, across.T, strict=True))
        middle = mesh.p[:, mesh.facets].mean(axis=1) * geometry.width
        near = np.hypot(middle[0] - rim.x, middle[1] - rim.y) < 1.02 * rim.radius
        facets = np.intersect1d(mesh.boundary_facets(), np.flatnonzero(near))
        held.append(basis.facet_dofs[:, facets].ravel())
    if not geometry.rims:
        sides = ((x, geometry.width, [0, 2, 5]), (y, geometry.length, [0, 1, 3]))
        for along, side, kinds in sides:
            own = vertices[np.abs(np.abs(along[vertices]) - side / 2) < 1e-9]
            held.append(basis.nodal_dofs[np.ix_(kinds, own)].ravel())
    keep = np.setdiff1d(np.arange(basis.N), np.concatenate(held))
    rows = np.concatenate([keep, *[dofs for dofs, _ in extra]])
    values = np.concatenate([np.ones(keep.size), *[across for _, across in extra]])
    columns = np.concatenate(
        (np.arange(keep.size), keep.size + np.repeat(np.arange(len(extra)), 3))
    )
    return csr_array((values, (rows, columns)), shape=(basis.N, keep.size + len(extra)))
