"""The focus objective as a program of second-order cones, by a general solver (tests and bench)."""

from __future__ import annotations

import clarabel
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]


def cone_program(
    mean: ComplexArray, far: ComplexArray, near: ComplexArray, cap: float, limit: float
) -> float:
    """The least t² by a general solver of second-order cones, every norm a cone of its own."""
    level, _, status = solved_cones(mean, far, near, cap, limit)
    assert status == "Solved"
    return level


def solved_cones(
    mean: ComplexArray, far: ComplexArray, near: ComplexArray, cap: float, limit: float
) -> tuple[float, ComplexArray, str]:
    """The least t², the drive, and what the solver says of them.

    Over (Re u, Im u, t): ‖R^½u‖ ≤ t, ‖Q^½u‖ ≤ √c, |uₙ| ≤ limit, Re m·u = 1, Im m·u = 0.
    """
    n = mean.size
    rows: list[FloatArray] = []
    right: list[float] = []
    cones: list[object] = [clarabel.ZeroConeT(2)]
    rows += [
        np.concatenate((mean.real, -mean.imag, [0.0])),
        np.concatenate((mean.imag, mean.real, [0.0])),
    ]
    right += [1.0, 0.0]

    def norm(root: ComplexArray, bound: float | None) -> None:
        """‖root u‖ ≤ bound, or ≤ t."""
        top = np.zeros(2 * n + 1)
        if bound is None:
            top[-1] = -1.0
        rows.append(top)
        right.append(bound or 0.0)
        for own in root:
            rows.append(-np.concatenate((own.real, -own.imag, [0.0])))
            rows.append(-np.concatenate((own.imag, own.real, [0.0])))
            right.extend((0.0, 0.0))
        cones.append(clarabel.SecondOrderConeT(1 + 2 * len(root)))

    for forms, bound in ((far, None), (near, float(np.sqrt(cap)))):
        for form in forms:
            values, vectors = np.linalg.eigh(form)
            # Beyond 80 dB below the form's largest there is nothing to be heard.
            kept = values > 1e-8 * values[-1]
            norm(np.sqrt(values[kept])[:, None] * vectors[:, kept].conj().T, bound)
    for coil in np.eye(n):
        norm(coil[None].astype(np.complex128), limit)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cost = np.zeros(2 * n + 1)
    cost[-1] = 1.0
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix((2 * n + 1, 2 * n + 1)),
        cost,
        sparse.csc_matrix(np.array(rows)),
        np.array(right),
        cones,
        settings,
    ).solve()
    found = np.array(solution.x)
    return (
        float(solution.obj_val) ** 2,
        np.asarray(found[:n] + 1j * found[n : 2 * n]),
        str(solution.status),
    )
