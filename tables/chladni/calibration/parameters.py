"""Values of a whole board as they were found, each with its interval."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.unknowns import Unknowns

FloatArray = NDArray[np.float64]

INTERVAL = 1.96
"""Standard deviations of 95 %."""
INEXACT, UNFITTED = 0.01, {"foam": 0.025, "foam's loss": 0.005, "sheet's loss": 0.04}
"""Deviations of a value's logarithm that no covariance knows of: fields that are not exact, and
patches of foam that are smaller than those that are fitted. By what 88 hidden plates on foam were
off (bench/calibration/hidden_boards.py): 0.023 to 0.037 of foam, 0.004 to 0.022 of its loss."""
BESIDE_FOAM = 0.06
"""The same of the sheet's loss on foam, which loses most: with 0.04 intervals held 37 of 45."""
TOLD_APART = 0.7
"""Of its spread before, that a value's must be below to count as measured."""


@dataclass(frozen=True)
class Parameter:
    """One value as it was found.

    Attributes
    ----------
    name
        In words.
    value, low, high
        Over the drawn one, with its 95 % interval.
    told
        Whether the readings tell it; else it is what was believed before, or goes with others.
    """

    name: str
    value: float
    low: float
    high: float
    told: bool

    @classmethod
    def of_logarithm(cls, name: str, value: float, deviation: float, told: bool) -> Parameter:
        """Of a ratio whose logarithm is known with this deviation."""
        reach = INTERVAL * deviation
        found, low, high = np.exp((value, value - reach, value + reach)).tolist()
        return cls(name, found, low, high, told)


def parameters_of(
    unknowns: Unknowns, values: FloatArray, covariance: FloatArray, inexact: float = 0.0
) -> Iterator[Parameter]:
    """What was found of the whole board, and of each foot; foam and feet are means of all of them.

    Of the first of the unknowns' values, as many as were fitted. `inexact` is the least deviation
    of each one's logarithm that no covariance knows of, where the readings are worse than coils'.
    """
    for row, name in enumerate(unknowns.scales):
        takes = np.zeros(values.size)
        takes[row] = 1.0
        parts = {"foam": unknowns.patch_values, "feet": unknowns.foot_values}.get(name, slice(0, 0))
        takes[parts] = 1.0 / max(parts.stop - parts.start, 1)
        least = UNFITTED.get(name, INEXACT)
        if name == "sheet's loss" and "foam" in unknowns.scales:
            least = BESIDE_FOAM
        least = max(least, inexact)
        yield _parameter(unknowns, values, covariance, name, takes, least)
    feet = unknowns.foot_values
    for row in range(feet.start, min(feet.stop, values.size)):
        takes = np.zeros(values.size)
        takes[[unknowns.scales.index("feet"), row]] = 1.0
        # Of feet that mirror each other coils on a middle line tell the mean alone, which leaves
        # 0.71 of what each is over all of them.
        is_told = np.sqrt(covariance[row, row]) < TOLD_APART * unknowns.spread[row]
        least = max(INEXACT, inexact)
        found = _parameter(unknowns, values, covariance, unknowns.names[row], takes, least)
        yield replace(found, told=found.told and bool(is_told))


def _parameter(
    unknowns: Unknowns,
    values: FloatArray,
    covariance: FloatArray,
    name: str,
    takes: FloatArray,
    least: float,
) -> Parameter:
    """Of the sum of some of the values, shares `takes`, that is never known better than `least`."""
    own = float(np.hypot(np.sqrt(takes @ covariance @ takes), least))
    before = float(np.sqrt(takes**2 @ unknowns.spread[: values.size] ** 2))
    return Parameter.of_logarithm(name, float(takes @ values), own, own < TOLD_APART * before)
