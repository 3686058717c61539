"""How one finger's push moves another: a small matrix from coil to coil in place of a field a pair.

g(a, b), the mean displacement of a fingertip at a by a newton on one at b, is written with what
coils do at both places,

    g(a, b) ≈ h̄(a)ᵀ M h̄(b),   M = Mᵀ,

where h̄(a) are the coils' mean displacements per newton under the fingertip. M = C⁻¹, with C what
coils do at coils, is Nyström's choice (Williams and Seeger, NIPS 13, 2001, 682-688). Here M is
fitted by least squares to the pairs that matter, fingers side by side and further apart: between
two pressing fingers that keeps 3 dB more on `strip5`, 1.5 on `quiet16` and as much on the phones
(bench/several_fingers/fingers.py). Eight more functions than the coils' own halve the error of g on
`phone15` and gain 3 dB of the 9 that are left to the exact one; each costs a table as much as a
coil.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.fingers import LEAST_APART

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

RELATIVE_CUT = 1e-8
"""Singular values of the fit that count as nothing, over the largest: products of smooth fields
are nearly dependent, and what they cannot tell apart stays small."""


def fitted_coupling(places: FloatArray, means: ComplexArray, pairs: ComplexArray) -> ComplexArray:
    """M of the least squared error over pairs of fingertips at least 16 mm apart (`LEAST_APART`).

    Parameters
    ----------
    places
        Middles of fingertips, m, shape (places, 2).
    means
        h̄ there, m/N, shape (places, actuators).
    pairs
        g, m/N, shape (places, places).

    Returns
    -------
    complex128, shape (actuators, actuators), symmetric, N/m; zeros where no two places are so far
    apart.
    """
    count = means.shape[1]
    apart = np.hypot(*(places[:, None] - places[None, :]).transpose(2, 0, 1))
    one, other = np.nonzero(np.triu(apart >= LEAST_APART))
    rows, columns = np.triu_indices(count)
    if one.size == 0:
        return np.zeros((count, count), dtype=np.complex128)
    products = means[one][:, rows] * means[other][:, columns]
    mixed = means[one][:, columns] * means[other][:, rows]
    products = products + np.where(rows == columns, 0.0, 1.0) * mixed
    sizes = np.linalg.norm(products, axis=0)
    sizes[sizes == 0.0] = np.inf  # of a dead coil: nothing, where rounding would be divided by 0
    both_ways = (pairs[one, other] + pairs[other, one]) / 2.0
    found = np.linalg.lstsq(products / sizes, both_ways, rcond=RELATIVE_CUT)[0] / sizes
    coupling = np.zeros((count, count), dtype=np.complex128)
    coupling[rows, columns] = found
    coupling[columns, rows] = found
    return coupling
