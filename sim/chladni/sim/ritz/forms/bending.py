"""Strain energy of the bare plate by its bending stiffness D, and the work of edge forces.

Rim functions are biharmonic off their rim, so by Green's identity for a Kirchhoff plate,

    a(u, v) = D ∮ [M(u) ∂v/∂n − V(u) v] ds + 2(1 − ν) D Σ corners ± u_xy v + rim terms,

with M = u_nn + ν u_ss and V = u_nnn + (2 − ν) u_nss, their strain energy with any other function
needs only the four edges and their own rim: no singular integral over the area is left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.circles.derivatives import Derivative
from chladni.sim.ritz.forms.rims import add_jump_work
from chladni.sim.ritz.forms.samples import Samples, Tables

FloatArray = NDArray[np.float64]


def plate_bending(samples: Samples, parity: ParityBasis) -> FloatArray:
    """Strain energy form of the bare plate, by D; shape (size, size), real symmetric."""
    p = parity.polynomials
    form = np.zeros((parity.size, parity.size))
    form[:p, :p] = parity.polynomial_bending()
    if parity.members:
        rows = edge_work(samples, parity, samples.own, first=p)
        add_jump_work(samples, parity, rows)
        form[p:] = rows
        form[:p, p:] = rows[:, :p].T
        form[p:, p:] = (rows[:, p:] + rows[:, p:].T) / 2.0
        _set_bubbles(samples, parity, form)
    return form


def edge_work(
    samples: Samples, parity: ParityBasis, tables: Tables, *, first: int = 0
) -> FloatArray:
    """Work of functions' edge forces on the basis, by D, from the `first` function on.

    Shape (functions, size).
    """
    nu, sets = samples.basis.geometry.poisson, samples.sets
    total: FloatArray | float = 0.0
    for edge, own, basis in zip(sets.edges, tables.edges, samples.own.edges, strict=True):
        nn, ss, nnn, nss = edge.derivatives
        slope: Derivative = (1, 0) if edge.axis == 0 else (0, 1)
        along = {d: own.values(parity, d)[:, first:] for d in edge.derivatives}
        moment = along[nn] + nu * along[ss]
        shear = along[nnn] + (2.0 - nu) * along[nss]
        weights = edge.points.weights * edge.normal
        total = total + (moment.T * weights) @ basis.values(parity, slope)
        total = total - (shear.T * weights) @ basis.values(parity, (0, 0))
    twist = tables.corners.values(parity, (1, 1))[:, first:].T * sets.corners.weights
    corners = twist @ samples.own.corners.values(parity, (0, 0))
    return np.asarray(total + 2.0 * (1.0 - nu) * corners)


def _set_bubbles(samples: Samples, parity: ParityBasis, form: FloatArray) -> None:
    """Bubbles end at their rim, so their energy by D is the integral over the disc."""
    for circle, _ in samples.discs.spans():
        members = parity.members[parity.members_of(circle)]
        first = parity.polynomials + parity.members_of(circle).start
        own = first + np.flatnonzero(
            [not samples.basis.circles[circle].members[m.column][0].outside for m in members]
        )
        rows = samples.discs.bending_of(circle, own, samples.on_discs(parity, samples.own))
        form[own] = rows
        form[:, own] = rows.T
