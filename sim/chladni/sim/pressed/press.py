"""Large deflection of a sheet under a finger (von Kármán), and small vibration about it.

    εxx = u,x + w,x²/2   εyy = v,y + w,y²/2   γxy = u,y + v,x + w,x w,y   N = E h/(1 − ν²) C ε

A press of more than a third of a sheet's thickness stretches it. The stretch carries a part of the
press, and stiffens the sheet against what vibrates under the finger.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from chladni.sim.errors import ToleranceError
from chladni.sim.pressed.sheet import Matrix, SplineSheet

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

STEPS = 40
SETTLED = 1e-8
"""Of the press that is left unbalanced."""
NEARLY_SOLID = 0.9
"""Of what is left to foam's bottoming, the most that a step of the solution takes."""


@dataclass(frozen=True)
class Equilibrium:
    """A sheet at rest, under a finger or with nothing on it.

    Attributes
    ----------
    along, deflection
        Coefficients of u and v, and of w (down).
    tension
        N_xx, N_yy, N_xy at the points, N/m, shape (3, points).
    """

    along: FloatArray
    deflection: FloatArray
    tension: FloatArray


def flat(sheet: SplineSheet) -> Equilibrium:
    """The sheet with nothing on it."""
    return Equilibrium(
        np.zeros(2 * sheet.size), np.zeros(sheet.size), np.zeros((3, sheet.weights.size))
    )


def press(sheet: SplineSheet, load: FloatArray, newtons: float, start: Equilibrium) -> Equilibrium:
    """The sheet at rest under a press, by Newton's method.

    Parameters
    ----------
    load
        One newton, (splines,).
    start
        Where to begin: `flat`, or the sheet under less.

    Raises
    ------
    ToleranceError
        It does not settle.
    """
    along, deflection = start.along.copy(), start.deflection.copy()
    scale = newtons * float(np.linalg.norm(load))
    left = np.inf
    for _ in range(STEPS):
        rows, tension = _stretched(sheet, along, deflection)
        pressure, spring = sheet.foam.pressure(sheet.value @ deflection)
        force_along = _work(sheet, sheet.strain, tension) + sheet.sideways @ along
        force = (
            sheet.bending @ deflection
            + _work(sheet, rows, tension)
            + sheet.value.T @ (sheet.weights * sheet.lies * pressure)
            - newtons * load
        )
        left = float(np.hypot(np.linalg.norm(force_along), np.linalg.norm(force))) / scale
        if left < SETTLED:
            return Equilibrium(along, deflection, tension)
        foam = sheet.gram(sheet.value, sheet.lies * spring)
        tangent = _tangent(sheet, rows, tension, foam, sheet.sideways)
        step = factor(tangent).solve(-np.concatenate([force_along, force]))
        share = _share(sheet, deflection, step[2 * sheet.size :])
        along += share * step[: 2 * sheet.size]
        deflection += share * step[2 * sheet.size :]
    raise ToleranceError(left, SETTLED)


def vibration(
    sheet: SplineSheet,
    at: Equilibrium,
    loads: FloatArray,
    omega: float,
    *,
    loss_factor: float,
    foam_factor: float = 1.0,
    fingers: tuple[FloatArray, complex] | None = None,
) -> ComplexArray:
    """Coefficients of the vibration by unit loads about a press, shape (splines, loads).

    Motion along the sheet follows without inertia.

    Parameters
    ----------
    loads
        Shape (splines, loads).
    loss_factor
        Of the sheet.
    foam_factor
        Dynamic over static stiffness of the foam.
    fingers
        A newton of each, shape (splines, fingers), and their force over displacement, N/m.
    """
    rows, tension = _stretched(sheet, at.along, at.deflection)
    _, spring = sheet.foam.pressure(sheet.value @ at.deflection)
    lossy = foam_factor * (1.0 + 1j * sheet.foam.loss_factor) / (1.0 + 1j * loss_factor)
    foam = lossy * sheet.gram(sheet.value, sheet.lies * spring)
    dynamic = (1.0 + 1j * loss_factor) * _tangent(
        sheet, rows, tension, foam, lossy * sheet.sideways
    )
    n = 2 * sheet.size
    inertia = sparse.block_diag([sparse.csr_array((n, n)), omega**2 * sheet.mass], format="csr")
    touches, stiffness = (loads[:, :0], 0.0) if fingers is None else fingers
    right = np.zeros((n + sheet.size, loads.shape[1] + touches.shape[1]), dtype=np.complex128)
    right[n:] = np.concatenate((loads, touches), axis=1)
    found = factor(dynamic - inertia).solve(right)[n:]
    moved, pushed = np.split(found, [loads.shape[1]], axis=1)
    if fingers is None:
        return np.asarray(moved)
    resting = np.eye(touches.shape[1]) + stiffness * (touches.T @ pushed)
    return np.asarray(moved - pushed @ np.linalg.solve(resting, stiffness * (touches.T @ moved)))


def _stretched(
    sheet: SplineSheet, along: FloatArray, deflection: FloatArray
) -> tuple[tuple[Matrix, Matrix, Matrix], FloatArray]:
    """By which w's splines strain the sheet about a deflection, and the tension there."""
    (gx, gy), slopes = sheet.slope, [own @ deflection for own in sheet.slope]
    dx, dy = (sparse.diags_array(own) for own in slopes)
    rows = ((dx @ gx).tocsr(), (dy @ gy).tocsr(), (dx @ gy + dy @ gx).tocsr())
    bent = (slopes[0] ** 2 / 2.0, slopes[1] ** 2 / 2.0, slopes[0] * slopes[1])
    strain = np.stack([own @ along + more for own, more in zip(sheet.strain, bent, strict=True)])
    return rows, np.asarray(sheet.membrane * (sheet.elastic @ strain))


def _work(
    sheet: SplineSheet, rows: tuple[Matrix, Matrix, Matrix], tension: FloatArray
) -> FloatArray:
    """What tension does to the splines, by their strains."""
    return np.asarray(
        sum(own.T @ (sheet.weights * part) for own, part in zip(rows, tension, strict=True))
    )


def _tangent(
    sheet: SplineSheet,
    rows: tuple[Matrix, Matrix, Matrix],
    tension: FloatArray,
    foam: Matrix,
    sideways: Matrix,
) -> Matrix:
    """Stiffness about a deflection, of u, v and w."""
    (gx, gy), weights = sheet.slope, sheet.weights
    crossed = gx.T @ sparse.diags_array(weights * tension[2]) @ gy
    geometric = sheet.gram(gx, tension[0]) + sheet.gram(gy, tension[1]) + crossed + crossed.T
    both = sparse.csr_array((2 * sheet.size, sheet.size))
    weighted = sparse.diags_array(weights * sheet.membrane)
    for i in range(3):
        for j in range(3):
            if sheet.elastic[i, j]:
                both = both + sheet.elastic[i, j] * (sheet.strain[i].T @ weighted @ rows[j])
    own = sheet.bending + foam + geometric + sheet.form(rows, sheet.membrane, sheet.elastic)
    return sparse.block_array([[sheet.stretch + sideways, both], [both.T, own]], format="csr")


def _share(sheet: SplineSheet, deflection: FloatArray, step: FloatArray) -> float:
    """How much of a step may be taken before foam is solid."""
    foam = sheet.foam
    if not foam.thickness:
        return 1.0
    now, more = sheet.value @ deflection, sheet.value @ step
    more, now = more[sheet.lies > 0.0], now[sheet.lies > 0.0]
    left = NEARLY_SOLID * (foam.thickness * foam.full_strain - now)
    grows = more > 0.0
    return float(min(1.0, (left[grows] / more[grows]).min(initial=np.inf)))


def factor(matrix: Matrix) -> SuperLU:
    """LU of a symmetric matrix, by an order of its pattern: four times as fast as by columns."""
    from scipy.sparse.linalg import splu  # noqa: PLC0415  (as the splines of a sheet)

    return splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
