"""Solutions of symmetric systems, real or complex, that need not be definite."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_blas_funcs, get_lapack_funcs

AnyArray = NDArray[Any]
"""Real or complex."""

BLOCK = 64
"""Columns that are eliminated together: memory for them makes the factors take half the time."""


class SymmetricFactors:
    """P L D Lᵀ Pᵀ of a symmetric matrix, with blocks of one or two rows in D.

    Half the work of LU factors, and as stable (J. R. Bunch and L. Kaufman, Some stable methods for
    calculating inertia and solving symmetric linear systems, Math. Comp. 31, 1977). A complex
    matrix is its own transpose here, not its conjugate's.

    Parameters
    ----------
    matrix
        Shape (size, size), row by row in memory. Only what is on its diagonal and above is read.
        It is overwritten.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is singular to the last digit.
    """

    def __init__(self, matrix: AnyArray) -> None:
        factor: Any = get_lapack_funcs("sytrf", (matrix,))
        convert: Any = get_lapack_funcs("syconv", (matrix,))
        self._divide_by_lower: Any = get_blas_funcs("trsm", (matrix,))
        # LAPACK reads columns, so what is above the diagonal here is below it there.
        packed, pivots, info = factor(matrix.T, lower=1, lwork=BLOCK * len(matrix), overwrite_a=1)
        if info > 0:
            raise np.linalg.LinAlgError(f"pivot {info} of a symmetric matrix is zero")
        self._lower, beside, _ = convert(packed, pivots, lower=1, overwrite_a=1)
        self._order = _order_of(pivots)
        self._own, self._beside = _inverse_blocks(np.diag(self._lower), beside[:-1])

    @property
    def is_complex(self) -> bool:
        """Whether the matrix is complex."""
        return bool(np.iscomplexobj(self._lower))

    def solve(self, right: AnyArray) -> AnyArray:
        """Solutions of right-hand sides of the matrix's own type, shape (size, sides)."""
        columns = np.asfortranarray(right[self._order])
        columns = self._divide_by_lower(1.0, self._lower, columns, lower=1, diag=1, overwrite_b=1)
        divided = self._own[:, None] * columns
        divided[:-1] += self._beside[:, None] * columns[1:]
        divided[1:] += self._beside[:, None] * columns[:-1]
        columns = self._divide_by_lower(
            1.0, self._lower, divided, lower=1, diag=1, trans_a=1, overwrite_b=1
        )
        result: AnyArray = np.empty_like(columns)
        result[self._order] = columns
        return result


def _order_of(pivots: NDArray[np.int32]) -> NDArray[np.intp]:
    """Rows in the order in which they were eliminated.

    Of two rows that go together both have the pivot negative, and the second one is exchanged.
    """
    order = np.arange(pivots.size)
    row = 0
    while row < pivots.size:
        row += 0 if pivots[row] > 0 else 1
        other = abs(pivots[row]) - 1
        order[row], order[other] = order[other], order[row]
        row += 1
    return order


def _inverse_blocks(own: AnyArray, beside: AnyArray) -> tuple[AnyArray, AnyArray]:
    """D⁻¹ as its diagonal and the one beside it, of D's; a block of one row has zero beside it."""
    (first,) = np.nonzero(beside)
    of_first, of_second = own[first] / beside[first], own[first + 1] / beside[first]
    determinant = of_first * of_second - 1.0
    single = np.ones(own.size, dtype=bool)
    single[first] = single[first + 1] = False
    inverse, inverse_beside = np.zeros_like(own), np.zeros_like(beside)
    inverse[single] = 1.0 / own[single]
    inverse[first] = of_second / determinant / beside[first]
    inverse[first + 1] = of_first / determinant / beside[first]
    inverse_beside[first] = -1.0 / determinant / beside[first]
    return inverse, inverse_beside
