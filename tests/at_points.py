"""Fields at scattered points: a grid of one point each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.loads import Load
from chladni.sim.plate.response import PlateModel

ComplexArray = NDArray[np.complex128]


def respond_at(
    model: PlateModel,
    loads: Sequence[Load],
    frequency_hz: float,
    points: Sequence[Sequence[float]] | NDArray[np.float64],
    *,
    tolerance: float,
) -> ComplexArray:
    """Displacement per newton at points (points, 2) in metres, shape (loads, points)."""
    values = [
        model.respond(
            loads, frequency_hz=frequency_hz, x=np.array([x]), y=np.array([y]), tolerance=tolerance
        ).values[:, 0, 0]
        for x, y in points
    ]
    return np.array(values).T
