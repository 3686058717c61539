"""The compiled inner loop of the drive search (tables/native/kernel)."""

import numpy as np
from numpy.typing import NDArray

class Fields:
    """Fields of unit drives: float32 planes, shape (drives, 2, nx, ny), real then imaginary."""

    def __init__(self, planes: NDArray[np.float32]) -> None: ...
    @property
    def shape(self) -> tuple[int, int, int]: ...

class Objective:
    """weight_ssim · SSIM + weight_contrast · ln(contrast) over real vectors (Re z, Im z)."""

    def __init__(
        self,
        fields: Fields,
        target: NDArray[np.float64],
        weight_ssim: float,
        weight_contrast: float,
        inside: NDArray[np.float64],
        outside: NDArray[np.float64],
    ) -> None: ...
    @property
    def evaluations(self) -> int: ...
    def evaluate(self, drive: NDArray[np.float64], gradient: NDArray[np.float64]) -> float:
        """The value; writes the gradient."""
    def value(self, drive: NDArray[np.float64]) -> float:
        """The value alone."""
    def climb(
        self,
        drive: NDArray[np.float64],
        curvature: NDArray[np.float64],
        steps: int,
        tolerance: float,
    ) -> float:
        """Climb in place, the inverse Hessian handed in and out; the value reached."""
