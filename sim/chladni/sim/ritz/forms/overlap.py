"""∫ of functions' products over the whole rectangle: mass and foundation are multiples of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.forms.samples import Samples, Tables

FloatArray = NDArray[np.float64]


def own_overlap(samples: Samples, parity: ParityBasis) -> FloatArray:
    """The basis with itself, shape (size, size), symmetric."""
    p = parity.polynomials
    form = np.zeros((parity.size, parity.size))
    form[:p, :p] = np.eye(p)
    if parity.members:
        rows = _project(samples, parity)
        rows += _kinked(samples, parity)
        form[p:] = rows
        form[:p, p:] = rows[:, :p].T
    return form


def overlap_with(samples: Samples, parity: ParityBasis, tables: Tables) -> FloatArray:
    """Functions outside the basis with it; shape (functions, size)."""
    plate = _project(samples, parity, tables.area.values(parity, (0, 0)))
    on_discs = tables.discs.values(parity, (0, 0)).T * samples.discs.points.weights
    plate[:, parity.polynomials :] += on_discs @ parity.combine(samples.kinks)
    return plate


def _project(samples: Samples, parity: ParityBasis, values: FloatArray | None = None) -> FloatArray:
    """∫ of functions, given at the area points, times the basis; shape (functions, size).

    Without `values` the functions are the circles' own.
    """
    basis, sets = samples.basis, samples.sets
    (x, _), (y, _) = sets.gauss_x, sets.gauss_y
    root = np.sqrt(sets.area.weights)[:, None]
    circles = root * samples.area.circle_values(parity, (0, 0))
    # A matrix by its own transpose takes half the time.
    rooted = circles if values is None else root * values
    along_x = basis.along_x.evaluate(x)[:, parity.degrees_x]
    along_y = basis.along_y.evaluate(y)[:, parity.degrees_y]
    count = rooted.shape[1]
    weighted = np.reshape((root * rooted).T, (count, x.size, y.size))
    polynomials = (along_x.T @ weighted @ along_y).reshape(count, parity.polynomials)
    return np.concatenate((polynomials, rooted.T @ circles), axis=1)


def _kinked(samples: Samples, parity: ParityBasis) -> FloatArray:
    """What the area's points leave out of circle functions; shape (members, size).

    With f = s + k and g = t + l, smooth parts and kinks: the area has st, the discs the rest,
    which is kg + fl − kl.
    """
    values = samples.own.discs.values(parity, (0, 0))
    kinks = parity.combine(samples.kinks)
    rows = np.zeros((kinks.shape[1], values.shape[1]))
    for circle, points in samples.discs.spans():
        # Only the disc's own functions have a kink there.
        own = parity.members_of(circle)
        kinked = kinks[points, own]
        weighted = kinked.T * samples.discs.points.weights[points]
        rows[own] += weighted @ values[points]
        others = values[points, parity.polynomials :] - kinks[points]
        rows[:, parity.polynomials :][:, own] += (weighted @ others).T
    return rows
