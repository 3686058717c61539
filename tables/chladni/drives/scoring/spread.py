"""A number over many places: its median and its tails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Spread:
    """A number over places."""

    median: float
    p10: float
    p90: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Median and percentiles."""
        median, p10, p90 = np.percentile(np.asarray(values, dtype=np.float64), (50.0, 10.0, 90.0))
        return cls(float(median), float(p10), float(p90))
