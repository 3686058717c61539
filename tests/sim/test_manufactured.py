"""Manufactured solutions: a deflection is chosen, the load that makes it is put on, and it returns.

w = (1 − ξ²)⁴(1 − η²)⁴(1 + 0.3ξ + 0.5η + 0.2ξη) vanishes on every edge with its first three
derivatives, so it meets free, simply supported and clamped edges alike; its load is
f = D(1 + iη)∇⁴w − ρhω²w, and point springs and masses add their own reactions.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from chladni.sim.board.parts import EdgeKind, Edges
from chladni.sim.plate.geometry import PlateGeometry, PointFeature
from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis.basis_values import BasisTable
from chladni.sim.ritz.basis.quadrature import Points
from chladni.sim.ritz.basis.resolution import Resolution
from chladni.sim.ritz.forms.loads import ClassLoad
from chladni.sim.ritz.solver import Solver

WIDTH, LENGTH, BENDING, NU, AREAL, LOSS = 0.07, 0.14, 1.9, 0.3, 1.7, 0.05
OMEGA = 2.0 * np.pi * 230.0
FloatArray = NDArray[np.float64]

BUMP = Polynomial([1.0, 0.0, -1.0]) ** 4
SHIFTED = BUMP * Polynomial([0.0, 1.0])


def chosen(x: FloatArray, y: FloatArray, by_x: int = 0, by_y: int = 0) -> FloatArray:
    """The deflection or a derivative of it, by m per metre of each order."""
    u, v = 2.0 * x / WIDTH, 2.0 * y / LENGTH
    (p, q), (r, s) = (
        [f.deriv(order)(at) if order else f(at) for f in (BUMP, SHIFTED)]
        for at, order in ((u, by_x), (v, by_y))
    )
    values = p * r + 0.3 * q * r + 0.5 * p * s + 0.2 * q * s
    return np.asarray(values * (2.0 / WIDTH) ** by_x * (2.0 / LENGTH) ** by_y)


@pytest.mark.parametrize(
    # With point features the basis holds ρ² ln ρ around them, which Gauss points integrate slowly:
    # 200 each way leave 5e-7 of this test's own load, 24 left 2e-4.
    ("spring", "mass", "points", "tolerance"),
    [(0.0, 0.0, 24, 1e-10), (3e3, 2e-3, 200, 2e-6)],
)
@pytest.mark.parametrize("kinds", [
    ("free", "free", "free", "free"),
    ("clamped", "clamped", "clamped", "clamped"),
    ("simply supported", "simply supported", "simply supported", "simply supported"),
    ("clamped", "free", "simply supported", "free"),
])  # fmt: skip
def test_a_chosen_deflection_returns_from_its_load(
    kinds: tuple[EdgeKind, EdgeKind, EdgeKind, EdgeKind],
    spring: float,
    mass: float,
    points: int,
    tolerance: float,
) -> None:
    """Degree 9 each way lies in a basis of 14: what is left is rounding and quadrature."""
    on_spring, on_mass = (0.011, -0.02), (-0.02, 0.033)
    features = (PointFeature(*on_spring, stiffness=spring), PointFeature(*on_mass, mass=mass))
    geometry = PlateGeometry(
        WIDTH, LENGTH, BENDING, NU, AREAL, points=features if spring else (), edges=Edges(*kinds)
    )
    solver = Solver(geometry, Mirrors(False, False), Resolution(14, 14, 0, 0, 0))
    (only,) = solver.classes
    nodes, weights = np.polynomial.legendre.leggauss(points)
    x, y = (a.ravel() for a in np.meshgrid(nodes * WIDTH / 2, nodes * LENGTH / 2, indexing="ij"))
    area = np.outer(weights, weights).ravel() * WIDTH * LENGTH / 4.0
    biharmonic = chosen(x, y, 4, 0) + 2.0 * chosen(x, y, 2, 2) + chosen(x, y, 0, 4)
    table = BasisTable(solver.basis, Points(x, y, area)).values(only.basis, (0, 0))
    at = np.array([on_spring, on_mass])
    held = BasisTable(solver.basis, Points(at[:, 0], at[:, 1], np.ones(2))).values(
        only.basis, (0, 0)
    )
    there = chosen(at[:, 0], at[:, 1])
    # Springs share the plate's loss. By linearity, stiff and inert parts are solved in one go.
    stiff = table.T @ (area * BENDING * biharmonic) + held[0] * spring * there[0]
    inert = table.T @ (area * AREAL * chosen(x, y)) + held[1] * mass * there[1]
    force = (1.0 + 1j * LOSS) * stiff - OMEGA**2 * inert
    load = ClassLoad(np.stack((force.real, force.imag), 1), np.zeros((only.basis.size, 2)), None)
    real, imaginary = only.modes.respond(load, OMEGA, LOSS).T
    found = table @ (real + 1j * imaginary)
    assert np.linalg.norm(found - chosen(x, y)) < tolerance * np.linalg.norm(chosen(x, y))
