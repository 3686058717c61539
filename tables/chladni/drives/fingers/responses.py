"""The plate as several fingers need it: what coils do at places, and what fingers do to another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers.coupling import fitted_coupling
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.threads import one_blas_thread
from chladni.sim.board.fingers import Active
from chladni.sim.board.quantity import MM
from chladni.sim.image import metrics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FIT_PITCH = 7e-3
"""m between the fingertips of which every pair is fitted."""
MOST_FITTED = 400
"""Fingertips, of which all pairs are fitted; larger boards have them further apart."""


@dataclass(frozen=True)
class Responses:
    """What coils do at the nodes of a grid, bilinear between them and constant beyond the last.

    Attributes
    ----------
    x, y
        Nodes along both sides, m, ascending, at least one each way.
    values
        Displacement per newton of each coil, complex128, shape (actuators, nx, ny), m/N.
    own_x, own_y, own
        Mean displacement of a fingertip by a newton of its own, shape (len(own_x), len(own_y)),
        m/N, at nodes of its own.
    coupling
        M, shape (actuators, actuators), N/m (coupling.py).
    frequency_hz
        Of all of them.
    """

    x: FloatArray
    y: FloatArray
    values: ComplexArray
    own_x: FloatArray
    own_y: FloatArray
    own: ComplexArray
    coupling: ComplexArray
    frequency_hz: float

    def at(self, places: FloatArray) -> ComplexArray:
        """What each coil does at places (k, 2), m; shape (k, actuators), m/N."""
        return interpolated(self.x, self.y, self.values, places).T

    def own_at(self, places: FloatArray) -> ComplexArray:
        """A fingertip's own compliance at places (k, 2), m; shape (k,), m/N."""
        return interpolated(self.own_x, self.own_y, self.own, places)


def responses_at(solved: SolvedBoard) -> Responses:
    """The responses of a board at its image points, and all fingertips' coupling.

    Parameters
    ----------
    solved
        The board at its own frequency.
    """
    board, values = solved.board, solved.fields.values
    fine = max(FIT_PITCH, float(np.sqrt(np.prod(board.plate.size) / MOST_FITTED)))
    margin = (board.active or Active()).margin
    x, y = (fit_nodes(side - 2.0 * margin, fine) for side in board.plate.size)
    places = np.array([(along_x, along_y) for along_x in x for along_y in y])
    discs = [
        metrics.disc_mask(board.x, board.y, (own[0], own[1]), metrics.FINGERTIP_RADIUS)
        for own in places
    ]
    means = np.array([values[:, disc].mean(axis=1) for disc in discs])
    pairs = np.empty((len(places), len(places)), dtype=np.complex128)
    with one_blas_thread():
        at = [(float(own[0] / MM), float(own[1] / MM)) for own in places]
        row = 0
        for group in solved.groups(at):
            for answer in solved.under_finger(group):
                pairs[row] = [answer[disc].mean() for disc in discs]
                row += 1
    return Responses(
        x=board.x,
        y=board.y,
        values=values,
        own_x=x,
        own_y=y,
        own=np.diag(pairs).reshape(x.size, y.size).copy(),
        coupling=fitted_coupling(places, means, pairs),
        frequency_hz=solved.fields.frequency_hz,
    )


def fit_nodes(side: float, pitch: float) -> FloatArray:
    """Along a side (m) of where fingers' middles may be, ends included, about a pitch apart."""
    count = max(2, round(side / pitch) + 1)
    return np.linspace(-side / 2.0, side / 2.0, count)


def interpolated(
    x: FloatArray, y: FloatArray, values: ComplexArray, places: FloatArray
) -> ComplexArray:
    """Values (…, nx, ny) of nodes at places (k, 2), bilinear, constant beyond; shape (…, k)."""
    left, along_x = _between(x, places[:, 0])
    below, along_y = _between(y, places[:, 1])
    right, above = np.minimum(left + 1, x.size - 1), np.minimum(below + 1, y.size - 1)
    lower = values[..., left, below] * (1.0 - along_x) + values[..., right, below] * along_x
    upper = values[..., left, above] * (1.0 - along_x) + values[..., right, above] * along_x
    return np.asarray(lower * (1.0 - along_y) + upper * along_y)


def _between(axis: FloatArray, at: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """The node below each place, and the share of the way from it to the next."""
    if axis.size == 1:
        return np.zeros(at.shape, dtype=np.intp), np.zeros(at.shape)
    steps = np.interp(at, axis, np.arange(axis.size, dtype=np.float64))
    low = np.minimum(steps.astype(np.intp), axis.size - 2)
    return low, steps - low
