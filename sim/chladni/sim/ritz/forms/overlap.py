"""∫ of functions' products over the whole rectangle: the plate's mass and an even foundation.

With a ratio that changes smoothly from place to place it is the form of a foundation in patches.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.basis.parity import ParityBasis
from chladni.sim.ritz.basis.quadrature import Points
from chladni.sim.ritz.forms.samples import Samples, Tables

FloatArray = NDArray[np.float64]
Ratio = Callable[[FloatArray, FloatArray], FloatArray]
"""Above 0 at places x and y, and smooth."""


def own_overlap(samples: Samples, parity: ParityBasis, ratio: Ratio | None = None) -> FloatArray:
    """The basis with itself, shape (size, size), symmetric; products count by `ratio`."""
    p = parity.polynomials
    form = np.zeros((parity.size, parity.size))
    form[:p, :p] = np.eye(p) if ratio is None else _of_polynomials(samples, parity, ratio)
    if parity.members:
        rows = _project(samples, parity, ratio)
        rows += _kinked(samples, parity, ratio)
        form[p:] = rows
        form[:p, p:] = rows[:, :p].T
    return form


def overlap_with(
    samples: Samples, parity: ParityBasis, tables: Tables, ratio: Ratio | None = None
) -> FloatArray:
    """Functions outside the basis with it, shape (functions, size); products count by `ratio`."""
    plate = _project(samples, parity, ratio, tables.area.values(parity, (0, 0)))
    on_discs = tables.discs.values(parity, (0, 0)).T * _weights(samples.discs.points, ratio)
    plate[:, parity.polynomials :] += on_discs @ parity.combine(samples.kinks)
    return plate


def _weights(points: Points, ratio: Ratio | None) -> FloatArray:
    return points.weights if ratio is None else points.weights * ratio(points.x, points.y)


def _lines(samples: Samples, parity: ParityBasis) -> tuple[FloatArray, FloatArray]:
    """The class's functions of x and those of y at the area's Gauss points, (points, functions)."""
    basis, sets = samples.basis, samples.sets
    x, y = sets.gauss_x[0], sets.gauss_y[0]
    along_x = basis.along_x.evaluate(x)[:, parity.degrees_x]
    return along_x, basis.along_y.evaluate(y)[:, parity.degrees_y]


def _of_polynomials(samples: Samples, parity: ParityBasis, ratio: Ratio) -> FloatArray:
    """Polynomials with themselves, summed along y before x; (polynomials, polynomials)."""
    x, y = _lines(samples, parity)
    weights = _weights(samples.sets.area, ratio).reshape(len(x), len(y))
    pairs_x, pairs_y = (np.einsum("pa,pb->pab", own, own).reshape(len(own), -1) for own in (x, y))
    form = pairs_x.T @ (weights @ pairs_y)
    count = parity.polynomials
    whole = form.reshape(x.shape[1], x.shape[1], y.shape[1], y.shape[1]).transpose(0, 2, 1, 3)
    return np.asarray(whole.reshape(count, count))


def _project(
    samples: Samples, parity: ParityBasis, ratio: Ratio | None, values: FloatArray | None = None
) -> FloatArray:
    """∫ of functions, given at the area points, times the basis; shape (functions, size).

    Without `values` the functions are the circles' own.
    """
    along_x, along_y = _lines(samples, parity)
    root = np.sqrt(_weights(samples.sets.area, ratio))[:, None]
    circles = root * samples.area.circle_values(parity, (0, 0))
    # A matrix by its own transpose takes half the time.
    rooted = circles if values is None else root * values
    count = rooted.shape[1]
    weighted = np.reshape((root * rooted).T, (count, len(along_x), len(along_y)))
    polynomials = (along_x.T @ weighted @ along_y).reshape(count, parity.polynomials)
    return np.concatenate((polynomials, rooted.T @ circles), axis=1)


def _kinked(samples: Samples, parity: ParityBasis, ratio: Ratio | None) -> FloatArray:
    """What the area's points leave out of circle functions; shape (members, size).

    With f = s + k and g = t + l, smooth parts and kinks: the area has st, the discs the rest,
    which is kg + fl − kl.
    """
    values = samples.own.discs.values(parity, (0, 0))
    kinks = parity.combine(samples.kinks)
    weights = _weights(samples.discs.points, ratio)
    rows = np.zeros((kinks.shape[1], values.shape[1]))
    for circle, points in samples.discs.spans():
        # Only the disc's own functions have a kink there.
        own = parity.members_of(circle)
        kinked = kinks[points, own]
        weighted = kinked.T * weights[points]
        rows[own] += weighted @ values[points]
        others = values[points, parity.polynomials :] - kinks[points]
        rows[:, parity.polynomials :][:, own] += (weighted @ others).T
    return rows
