"""A sheet in splines: its energies' matrices, with magnets, foam and cut-outs at its points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from chladni.sim.plate.geometry import PlateGeometry

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

FloatArray = NDArray[np.float64]
Matrix: TypeAlias = Any
"""A sparse array, CSR."""

DEGREE = 3
POINTS = 4
"""Gauss points each way in an element, so that circles are followed to a quarter of one."""
EDGE = 0.6
"""Of an element, by which a rigid disc is drawn smaller. Splines do not kink at its rim, and would
hold the sheet as one larger by about so much: fields are then within 3 to 5 % of those of the Ritz
plate with elements of 1.5 and 2 mm, and 30 to 40 % too small without (`quiet16`)."""
SHEAR_OF_FOAM = 1.0 / 2.6
"""Of its modulus in compression, with a Poisson's ratio of 0.3: foam holds a sheet sideways too."""


@dataclass(frozen=True)
class Foam:
    """What lies under the sheet.

    Attributes
    ----------
    stiffness
        k, static, N/m³.
    loss_factor
        Of the vibration.
    thickness
        m; 0 where it is not known, and foam is a straight line.
    full_strain
        Compression at which it is solid, as a share of its thickness.
    """

    stiffness: float
    loss_factor: float
    thickness: float
    full_strain: float

    def pressure(self, deflection: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pressure under a deflection (down is above 0), Pa, and its slope, N/m³.

        σ = E ε/(1 − (ε/ε_D)³): a straight line at first, 1.04 times that at a quarter, bottoming
        at ε_D; pulled, a straight line. Its form is ours, ε_D that of Gibson and Ashby, Cellular
        Solids, 2nd edition, eq. (5.16).
        """
        if not self.thickness:
            return self.stiffness * deflection, np.full(deflection.shape, self.stiffness)
        full = self.thickness * self.full_strain
        share = np.maximum(deflection, 0.0) / full
        stiffened = 1.0 / (1.0 - share**3)
        slope = self.stiffness * stiffened * (1.0 + 3.0 * share**3 * stiffened)
        return self.stiffness * deflection * stiffened, slope


def axis(length: float, elements: int) -> tuple[BSpline, FloatArray, FloatArray]:
    """Cubic splines along one side, and Gauss points with their weights."""
    # Half a second of SciPy, which most commands do not need.
    from scipy.interpolate import BSpline  # noqa: PLC0415

    ends = np.linspace(-length / 2.0, length / 2.0, elements + 1)
    knots = np.concatenate([[ends[0]] * DEGREE, ends, [ends[-1]] * DEGREE])
    splines = BSpline(knots, np.eye(elements + DEGREE), DEGREE)
    node, weight = np.polynomial.legendre.leggauss(POINTS)
    half = length / elements / 2.0
    middles = (ends[:-1] + ends[1:]) / 2.0
    points = (middles[:, None] + half * node).ravel()
    return splines, points, np.tile(half * weight, elements)


class SplineSheet:
    """A rectangle on foam with rigid discs on it, in bicubic splines.

    Parameters
    ----------
    geometry
        Of the plate: size, bending stiffness, mass, discs and the foundation's cut-outs.
    membrane
        E h/(1 − ν²), N/m.
    foam
        What lies under it.
    element
        About how long elements are, m.

    Attributes
    ----------
    x, y
        Gauss points, m, shape (points,).
    weights
        Areas, m².
    value, slope, curvature
        Of the splines at the points: one matrix, two along x and y, and three of κxx, κyy, 2κxy;
        each (points, splines).
    """

    def __init__(
        self, geometry: PlateGeometry, membrane: float, foam: Foam, element: float
    ) -> None:
        self.geometry, self.foam = geometry, foam
        sides = (geometry.width, geometry.length)
        along = [axis(side, max(8, round(side / element))) for side in sides]
        self._splines = (along[0][0], along[1][0])
        self.x, self.y = (
            own.ravel() for own in np.meshgrid(along[0][1], along[1][1], indexing="ij")
        )
        self.weights = np.outer(along[0][2], along[1][2]).ravel()
        points = (along[0][1], along[1][1])
        self.value = self.at(*points)
        self.slope = (self.at(*points, (1, 0)), self.at(*points, (0, 1)))
        self.curvature = (
            self.at(*points, (2, 0)),
            self.at(*points, (0, 2)),
            2.0 * self.at(*points, (1, 1)),
        )
        self.size = self.value.shape[1]
        rigid = np.ones(self.weights.size)
        mass = np.full(self.weights.size, geometry.areal_mass)
        rotary = np.zeros(self.weights.size)
        for disc in geometry.inclusions:
            inside = self.disc(disc.x, disc.y, disc.radius)
            # The points' own area of the disc is a few hundredths off, its mass is not.
            true = np.pi * disc.radius**2 / self.weights[inside].sum()
            held = self.disc(disc.x, disc.y, disc.radius - EDGE * element)
            rigid[held] = disc.stiffness_ratio
            mass[inside] += disc.areal_mass * true
            rotary[inside] += disc.rotary * true
        layer = geometry.foundation
        self.rigid = rigid
        # How stiff the foam is at points over what it is elsewhere; 0 where there is none.
        self.lies = layer.lies(self.x, self.y) if layer else np.zeros(self.weights.size)
        nu = geometry.poisson
        self.elastic = np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, (1.0 - nu) / 2.0]])
        self.membrane = membrane * rigid
        self.bending = self.form(self.curvature, geometry.bending_stiffness * rigid, self.elastic)
        self.mass = self.gram(self.value, mass) + sum(self.gram(own, rotary) for own in self.slope)
        zero = sparse.csr_array(self.value.shape)
        gx, gy = self.slope
        # Strains xx, yy, xy of the motion along the sheet, by its splines u and then v.
        self.strain = (
            sparse.hstack([gx, zero], format="csr"),
            sparse.hstack([zero, gy], format="csr"),
            sparse.hstack([gy, gx], format="csr"),
        )
        sideways = self.gram(self.value, SHEAR_OF_FOAM * foam.stiffness * self.lies)
        self.sideways = sparse.block_diag([sideways, sideways], format="csr")
        self.stretch = self.form(self.strain, self.membrane, self.elastic)

    def at(self, x: FloatArray, y: FloatArray, order: tuple[int, int] = (0, 0)) -> Matrix:
        """The splines' derivative on the grid x × y, (points, splines)."""
        parts = [
            sparse.csr_array(spline(points, nu=nu))
            for spline, points, nu in zip(self._splines, (x, y), order, strict=True)
        ]
        return sparse.kron(parts[0], parts[1], format="csr")

    def disc(self, x: float, y: float, radius: float) -> NDArray[np.bool_]:
        """Which points lie in a disc."""
        return np.asarray(np.hypot(self.x - x, self.y - y) <= radius)

    def mean(self, x: float, y: float, radius: float) -> FloatArray:
        """What splines have as their mean in a disc, which is also a newton spread over it."""
        inside = self.disc(x, y, radius)
        share = np.where(inside, self.weights, 0.0) / self.weights[inside].sum()
        return np.asarray(self.value.T @ share)

    def gram(self, values: Matrix, density: FloatArray) -> Matrix:
        """∫ density · products."""
        return (values.T @ sparse.diags_array(self.weights * density) @ values).tocsr()

    def form(
        self, parts: tuple[Matrix, Matrix, Matrix], density: FloatArray, elastic: FloatArray
    ) -> Matrix:
        """∫ density · εᵀ C ε of three strains."""
        weighted = sparse.diags_array(self.weights * density)
        total = sparse.csr_array((parts[0].shape[1],) * 2)
        for i in range(3):
            for j in range(3):
                if elastic[i, j]:
                    total = total + elastic[i, j] * (parts[i].T @ weighted @ parts[j])
        return total.tocsr()
