"""Support conditions as constraints on scaled coefficients: independent rows of unit length."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from chladni.sim.ritz.forms.supports import SupportConditions

FloatArray = NDArray[np.float64]
AnyArray = NDArray[Any]
"""Real or complex."""

CONDITION_FLOOR = 1e-9
"""A support condition this much smaller than the largest holds by parity alone."""
CORNER_FLOOR = 1e-10
"""Between the smallest condition that edges make (1e-4 of the largest, of 36 × 56 polynomials) and
what corners make superfluous (1e-15, by rounding)."""


class Constraints:
    """The conditions `taken` on the functions `subset`, scaled.

    Parameters
    ----------
    supports
        All conditions on all functions.
    subset, taken
        Indices of the functions and of the support conditions that take part.
    scale
        Of each function of the subset: its coefficient is the scaled one times this.
    polynomials
        How many of all functions are polynomials; they come first.
    """

    def __init__(
        self,
        supports: SupportConditions,
        subset: NDArray[np.intp],
        taken: NDArray[np.intp],
        scale: FloatArray,
        *,
        polynomials: int,
    ) -> None:
        self._taken = taken
        own = supports.moments[np.ix_(taken, subset)] * scale
        self._edges = int(np.count_nonzero(taken >= supports.moments.shape[0] - supports.edges))
        self._met = met_by_polynomials(own[own.shape[0] - self._edges :, subset < polynomials])
        combined = self._combined(own)
        norms = np.linalg.norm(combined, axis=1)
        self._kept = norms > CONDITION_FLOOR * norms.max(initial=0.0)
        self._row_scale = 1.0 / norms[self._kept]
        self._conditions = combined[self._kept] * self._row_scale[:, None]

    @property
    def rows(self) -> FloatArray:
        """Rows that scaled coefficients meet: the conditions, or their independent directions."""
        return self._conditions if self.is_independent else self._directions[1]

    @cached_property
    def null_space(self) -> FloatArray:
        """What obeys the conditions, in scaled coefficients; (subset size, free size)."""
        directions = self._directions[1]
        if not directions.size:
            return np.eye(directions.shape[1])
        whole, _ = qr(directions.T)
        return np.asarray(whole[:, directions.shape[0] :])

    def along_rows(self, moments: AnyArray) -> AnyArray:
        """Support moments (conditions, loads) along `rows`."""
        own = self._combined(moments[self._taken])[self._kept] * self._row_scale[:, None]
        return np.asarray(own if self.is_independent else self._directions[0] @ own)

    def least(self, along_rows: AnyArray) -> AnyArray:
        """The least scaled coefficients with given moments `along_rows`; (subset size, loads)."""
        if self.is_independent:
            along_rows = self._directions[0] @ along_rows
        return np.asarray(self._directions[1].T @ along_rows)

    def released_from(self, finer: Constraints) -> tuple[NDArray[np.bool_], FloatArray]:
        """Constraints of a finer basis that are none of these; rows of both must be independent.

        Returns
        -------
        tuple[NDArray[np.bool_], FloatArray]
            Whether each row of rims and pins is released, shape (rows,), and the directions that
            are released among the rows of edges, shape (edge rows, released).
        """
        count = finer._taken.size - finer._edges
        others = finer._taken[:count][finer._kept[:count]]
        edges = released_by_fewer(finer._met[finer._kept[count:]], self._met)
        # A multiplier acts on its combination times the row's scale.
        edges *= finer._row_scale[others.size :, None]
        return ~np.isin(others, self._taken), edges

    def _combined(self, moments: AnyArray) -> AnyArray:
        """Conditions or moments by row, those of the edges as combinations that can be met."""
        count = moments.shape[0] - self._edges
        return np.concatenate((moments[:count], self._met @ moments[count:]))

    @cached_property
    def is_independent(self) -> bool:
        """Whether the conditions are independent, so that each can be a constraint as it is."""
        return bool(self._directions[1].shape[0] == self._conditions.shape[0])

    @cached_property
    def _directions(self) -> tuple[FloatArray, FloatArray]:
        """(U/s)ᵀ and V of the conditions' singular values s: orthonormal constraints as rows."""
        if not self._conditions.size:
            return np.zeros((0, 0)), np.zeros((0, self._conditions.shape[1]))
        left, singular, right = np.linalg.svd(self._conditions, full_matrices=False)
        rank = int(np.sum(singular > CONDITION_FLOOR * singular[0]))
        return (left[:, :rank] / singular[:rank]).T, right[:rank]


def met_by_polynomials(edges: FloatArray) -> FloatArray:
    """Combinations of edge conditions that polynomials can meet; shape (combinations, conditions).

    Two edges meet in a corner, and both set w, its slopes and its twist there: for
    polynomials 16 combinations on a plate clamped all round, and 4 on a supported one, come to
    nothing. Rim functions are no polynomials. Their moments, cut off at the basis's degree, do not
    agree in the corners, and if they had to, by however little, they could not be used at all.
    """
    if not edges.size:
        return np.zeros((0, edges.shape[0]))
    left, singular, _ = np.linalg.svd(edges, full_matrices=False)
    return np.asarray(left[:, singular > CORNER_FLOOR * singular[0]].T)


def released_by_fewer(met: FloatArray, by_fewer: FloatArray) -> FloatArray:
    """What of the combinations `met_by_polynomials` fewer polynomials need not meet.

    Fewer polynomials can meet a part of the span of `met`. What is perpendicular to that part is
    released, as columns of shares of the combinations; shape (combinations, released).
    """
    if not by_fewer.size:
        return np.eye(met.shape[0])
    return np.asarray(np.linalg.qr(met @ by_fewer.T, mode="complete")[0][:, by_fewer.shape[0] :])
