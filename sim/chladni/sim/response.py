"""What every plate model answers: natural frequencies, and fields under unit loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chladni.sim.loads import Load

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Response:
    """Steady-state displacement per newton under several loads, w(t) = Re(values · exp(iωt)).

    Attributes
    ----------
    values
        complex128, shape (loads, nx, ny), m/N.
    modes_used
        Modes (or Ritz functions) that carry the field.
    error_estimate
        Relative L² error over the board, the largest of the loads.
    """

    values: ComplexArray
    modes_used: int
    error_estimate: float


class PlateModel(Protocol):
    """A plate that can be asked for modes and fields."""

    def natural_frequencies(self, count: int) -> FloatArray:
        """The lowest natural frequencies without loss, Hz, shape (count,)."""

    def respond(
        self,
        loads: Sequence[Load],
        *,
        frequency_hz: float,
        x: FloatArray,
        y: FloatArray,
        tolerance: float,
    ) -> Response:
        """Fields on the grid x × y (m) under unit loads."""
