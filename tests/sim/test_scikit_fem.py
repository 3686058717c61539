"""scikit-fem's Argyris elements on a bare plate: forced response, and how it converges."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve
from skfem import Basis, BilinearForm, ElementTriArgyris, MeshTri
from skfem.helpers import dd, ddot, trace

from chladni.sim.plate.geometry import PlateGeometry
from chladni.sim.plate.loads import Load
from chladni.sim.ritz.plate import RitzPlate

WIDTH, LENGTH, NU, LOSS = 1.0, 1.5, 0.3, 0.02
FORCE = (0.125, -0.25)
X, Y = np.linspace(-0.45, 0.45, 13), np.linspace(-0.7, 0.7, 17)


def elements(cells: int, omega: float) -> NDArray[np.complex128]:
    """K(1 + iη) − ω²M with D = ρh = 1, all edges free, a unit point force at a vertex."""

    @BilinearForm  # type: ignore[untyped-decorator]
    def bending(u: Any, v: Any, _: Any) -> Any:
        return (1 - NU) * ddot(dd(u), dd(v)) + NU * trace(dd(u)) * trace(dd(v))

    @BilinearForm  # type: ignore[untyped-decorator]
    def inertia(u: Any, v: Any, _: Any) -> Any:
        return u * v

    x = np.linspace(-WIDTH / 2, WIDTH / 2, cells + 1)
    y = np.linspace(-LENGTH / 2, LENGTH / 2, round(1.5 * cells) + 1)
    basis = Basis(MeshTri.init_tensor(x, y), ElementTriArgyris(), intorder=8)
    system = (1 + 1j * LOSS) * bending.assemble(basis) - omega**2 * inertia.assemble(basis)
    force = basis.probes(np.array([[FORCE[0]], [FORCE[1]]])).toarray()[0]
    solution = spsolve(system.tocsc(), force.astype(complex))
    points = np.stack(np.meshgrid(X, Y, indexing="ij")).reshape(2, -1)
    return np.asarray(basis.probes(points) @ solution).reshape(X.size, Y.size)


@pytest.mark.slow
@pytest.mark.parametrize("omega", [7.0, 30.0])
def test_forced_response_matches_and_elements_converge_to_it(omega: float) -> None:
    """Within 1 % (relative L²), and the elements close in at the rate theory gives.

    A point force leaves w in H³⁻ᵉ, so Argyris displacements converge as h² in L²; halving h must
    cut the difference to ours by a factor near four, unless ours were the one that is off.
    """
    plate = RitzPlate(PlateGeometry(WIDTH, LENGTH, 1.0, NU, 1.0), LOSS)
    ours = plate.respond(
        [Load(*FORCE)], frequency_hz=omega / (2 * np.pi), x=X, y=Y, tolerance=1e-6
    ).values[0]
    errors = [
        float(np.linalg.norm(elements(cells, omega) - ours) / np.linalg.norm(ours))
        for cells in (4, 8)
    ]
    assert errors[1] < 0.01
    assert errors[1] < errors[0] / 3.0
