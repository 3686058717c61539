"""Finite-element oracle for thin (Kirchhoff) plates, with NumPy and SciPy only.

Solves D (1 + i eta) grad^4 w - rho h omega^2 w = load on a rectangle with free or simply supported
edges, clamped circular holes and disc inclusions, on Argyris triangles.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from plate_fem.element import HESSIAN, ArgyrisSpace
from plate_fem.mesh import FloatArray, PlateMesh

ComplexArray = npt.NDArray[np.complex128]
Edges = Literal["free", "supported"]


@dataclass(frozen=True)
class Material:
    """A plate's elastic material.

    Attributes
    ----------
    young
        Young's modulus, in pascals.
    poisson
        Poisson's ratio.
    density
        Density, in kg/m^3.
    thickness
        Thickness, in metres.
    loss_factor
        Imaginary over real part of the stiffness.
    """

    young: float
    poisson: float
    density: float
    thickness: float
    loss_factor: float = 0.0


@dataclass(frozen=True)
class Inclusion:
    """What a disc adds to the plate.

    Attributes
    ----------
    added_mass
        Mass per area on top of the plate's own, in kg/m^2.
    stiffness_ratio
        Factor on the plate's bending stiffness.
    """

    added_mass: float
    stiffness_ratio: float = 1.0
    rotary: float = 0.0


class ArgyrisPlate:
    """A thin plate's stiffness and mass matrices, and what follows from them.

    Parameters
    ----------
    mesh
        Mesh; the rims of its holes are clamped.
    material
        The plate's material.
    inclusions
        What each inclusion of the mesh adds.
    edges
        Whether the outer edges are free or simply supported.
    foundation
        Complex stiffness per area of what the plate lies on, N/m^3, and the inclusions of the mesh
        under which there is none of it.
    """

    def __init__(
        self,
        mesh: PlateMesh,
        material: Material,
        inclusions: Sequence[Inclusion] = (),
        edges: Edges = "free",
        foundation: tuple[complex, Sequence[int]] = (0.0, ()),
    ) -> None:
        self.mesh = mesh
        self.material = material
        areal = np.full(len(mesh.triangles), material.density * material.thickness)
        bending = np.full(
            len(mesh.triangles),
            material.young * material.thickness**3 / (12.0 * (1.0 - material.poisson**2)),
        )
        for number, inclusion in enumerate(inclusions):
            areal[mesh.regions == number] += inclusion.added_mass
            bending[mesh.regions == number] *= inclusion.stiffness_ratio
        self._space = ArgyrisSpace(mesh, bending, edges == "supported")
        nu = material.poisson
        moments = np.array([[1.0, 0.0, nu], [0.0, 2.0 - 2.0 * nu, 0.0], [nu, 0.0, 1.0]])
        self.stiffness = self._space.assembled(HESSIAN, moments, bending, 4)
        self.mass = self._space.assembled([(0, 0)], np.eye(1), areal, 6)
        turning = np.zeros(len(mesh.triangles))
        for number, inclusion in enumerate(inclusions):
            turning[mesh.regions == number] = inclusion.rotary
        if turning.any():
            self.mass = self.mass + self._space.assembled([(1, 0), (0, 1)], np.eye(2), turning, 6)
        lies = np.where(np.isin(mesh.regions, foundation[1]), 0.0, 1.0)
        self.foundation = foundation[0] * self._space.assembled([(0, 0)], np.eye(1), lies, 6)

    def natural_frequencies(self, count: int) -> FloatArray:
        """Return the lowest natural frequencies, in hertz; rigid motions count as zeros.

        Parameters
        ----------
        count
            How many.

        Returns
        -------
        FloatArray
            Ascending frequencies.
        """
        material = self.material
        size = max(self.mesh.width, self.mesh.height)
        shift = -material.young * material.thickness**2 / (material.density * size**4)
        factor = splu(
            csc_array(self.stiffness - shift * self.mass),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        inverse = LinearOperator(self.stiffness.shape, matvec=factor.solve, dtype=np.float64)
        start = np.random.default_rng(1).standard_normal(self.stiffness.shape[0])
        squares = eigsh(
            self.stiffness,
            count,
            self.mass,
            sigma=shift,
            OPinv=inverse,
            v0=start,
            return_eigenvectors=False,
        )
        squares = np.where(squares < 1e-6 * abs(shift), 0.0, squares)
        return np.asarray(np.sort(np.sqrt(squares)) / (2.0 * np.pi))

    def response(
        self,
        load_xy: tuple[float, float],
        load_radius: float,
        frequency_hz: float,
        points: FloatArray,
    ) -> ComplexArray:
        """Return the displacement per newton at points, zero off the plate and in holes.

        Parameters
        ----------
        load_xy
            Centre of the load, in metres.
        load_radius
            Radius of the disc the unit force is uniform over, in metres, before it is clipped to
            the plate; zero for a point force.
        frequency_hz
            Frequency, in hertz.
        points
            Where, shape (n, 2), in metres.

        Returns
        -------
        ComplexArray
            Shape (n,), in metres per newton.
        """
        return np.asarray(self.responses([(load_xy, load_radius)], frequency_hz, points)[0])

    def responses(
        self,
        loads: Sequence[tuple[tuple[float, float], float]],
        frequency_hz: float,
        points: FloatArray,
    ) -> ComplexArray:
        """Return `response` for several loads, shape (loads, points), with one factorisation."""
        square = (2.0 * np.pi * frequency_hz) ** 2
        dynamic = self.stiffness * (1.0 + 1j * self.material.loss_factor) - square * self.mass
        dynamic = dynamic + self.foundation
        factor = splu(
            csc_array(dynamic),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.001,
            options={"SymmetricMode": True},
        )
        forces = np.empty((dynamic.shape[0], len(loads)), dtype=np.complex128)
        for column, (centre, radius) in enumerate(loads):
            where, weight = _load_points(self.mesh, centre, radius)
            forces[:, column] = self._space.evaluation(where).T @ weight
        solution = factor.solve(forces)
        solution += factor.solve(forces - dynamic @ solution)
        return np.asarray((self._space.evaluation(points) @ solution).T)


def _load_points(
    mesh: PlateMesh, centre: tuple[float, float], radius: float
) -> tuple[FloatArray, FloatArray]:
    """Return points and weights (sum 1) of a uniform load on a disc clipped to the plate."""
    if radius == 0.0:
        return np.array([centre]), np.ones(1)
    rays, order = 512, 6
    node, gauss = np.polynomial.legendre.leggauss(order)
    half = 0.5 * np.array([mesh.width, mesh.height])
    points, weights = [], []
    for angle in 2.0 * np.pi * (np.arange(rays) + 0.5) / rays:
        direction = np.array([np.cos(angle), np.sin(angle)])
        exits = (half - np.sign(direction) * centre) / np.abs(direction)
        last = max(0.0, min(radius, float(np.min(exits))))
        cuts = [0.0, last]
        for hole in mesh.holes:
            to_hole = np.array([hole.x, hole.y]) - centre
            along = float(to_hole @ direction)
            spare = hole.radius**2 - float(to_hole @ to_hole) + along**2
            if spare > 0.0:
                chord = np.array([along - np.sqrt(spare), along + np.sqrt(spare)])
                cuts.extend(np.clip(chord, 0.0, last).tolist())
        cuts.sort()
        for start, end in pairwise(cuts):
            middle = np.array(centre) + 0.5 * (start + end) * direction
            if end - start < 1e-12 or any(
                h.distance(middle[None])[0] < h.radius for h in mesh.holes
            ):
                continue
            reach = 0.5 * (start + end) + 0.5 * (end - start) * node
            points.append(np.array(centre) + reach[:, None] * direction)
            weights.append(0.5 * (end - start) * gauss * reach)
    if not weights:
        raise ValueError(f"no part of the load at {centre} lies on the plate")
    weight = np.concatenate(weights)
    return np.vstack(points), weight / np.sum(weight)
