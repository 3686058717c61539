"""Regularised least squares: the drive whose complex field is nearest to the target's.

min ‖G c − w‖² + μ ‖c‖² (Tikhonov and Arsenin, Solutions of Ill-Posed Problems, 1977), solved by
singular values, with μ at −80 dB of the largest: far below what the drives resolve.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.problem import Problem

ComplexArray = NDArray[np.complex128]

DAMPING = 1e-4
"""Square root of μ over the largest singular value."""


def least_squares(problem: Problem, options: Options) -> Found:
    """The damped solution over the whole image, with the fields' condition number."""
    del options
    drive, condition = damped(
        problem.transfer.reshape(len(problem.transfer), -1).T, problem.wanted.ravel()
    )
    return Found(drive, details={"condition": condition})


def damped(fields: ComplexArray, wanted: ComplexArray) -> tuple[ComplexArray, float]:
    """(drive, condition number) of min ‖fields · c − wanted‖; fields (points, actuators)."""
    left, singular, right = np.linalg.svd(fields, full_matrices=False)
    if singular[0] == 0.0:
        return np.zeros(fields.shape[1], dtype=np.complex128), float("inf")
    gain = singular / (singular**2 + (DAMPING * singular[0]) ** 2)
    condition = singular[0] / singular[-1] if singular[-1] > 0.0 else float("inf")
    return np.asarray(right.conj().T @ (gain * (left.conj().T @ wanted))), float(condition)
