"""Factors of symmetric systems against NumPy's own solver, which takes no symmetry for granted."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.sim.ritz.symmetric_factors import SymmetricFactors

AnyArray = NDArray[Any]


def system(size: int, constraints: int, *, is_complex: bool, seed: int) -> AnyArray:
    """[A Vᵀ; V 0] as a plate with supports has it: indefinite, and zero where pivots would be."""
    rng = np.random.default_rng(seed)
    form = rng.standard_normal((size, size))
    matrix = np.zeros((size + constraints,) * 2, dtype=complex if is_complex else float)
    matrix[:size, :size] = form @ form.T - 0.5 * size * np.eye(size)
    matrix[:size, :size] *= 1.0 + 0.02j if is_complex else 1.0
    matrix[:size, size:] = rng.standard_normal((size, constraints))
    matrix[size:, :size] = matrix[:size, size:].T
    return matrix


@pytest.mark.parametrize("is_complex", [False, True])
@pytest.mark.parametrize(
    ("size", "constraints"), [(1, 0), (1, 1), (2, 1), (5, 4), (70, 30), (150, 0)]
)
def test_solutions_are_those_of_the_whole_matrix(
    size: int, constraints: int, is_complex: bool
) -> None:
    for seed in range(10):
        matrix = system(size, constraints, is_complex=is_complex, seed=seed)
        right = np.random.default_rng(seed + 100).standard_normal((len(matrix), 3))
        factors = SymmetricFactors(np.triu(matrix))
        assert factors.is_complex == is_complex
        found = factors.solve(right.astype(matrix.dtype))
        exact = np.linalg.solve(matrix, right)
        # Both are stable backwards, so they agree to the condition number times the rounding.
        condition = np.linalg.cond(matrix)
        assert np.abs(found - exact).max() < 1e-14 * condition * np.abs(exact).max()


def test_a_matrix_of_zero_diagonal_takes_rows_two_by_two() -> None:
    matrix = np.array(
        [[0.0, 2.0, 0.0, 0.0], [2.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 5.0], [0.0, 1.0, 5.0, 0.0]]
    )
    found = SymmetricFactors(np.triu(matrix)).solve(np.eye(4))
    assert found == pytest.approx(np.linalg.inv(matrix), abs=1e-15)


def test_a_singular_matrix_is_refused() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="pivot 2 of a symmetric matrix is zero"):
        SymmetricFactors(np.ones((2, 2)))
