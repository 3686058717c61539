"""How still a finger's drive leaves the others: λ for each finger of a set.

A smaller λ costs level and buys isolation. What counts is whether another finger feels anything, so

1. every finger first gets λ = 1e-3;
2. where its share at another finger, at the level that will be played, is above what that one
   feels, it gets 1e-4, unless that leaves less than a tenth (-20 dB) of the loudest drive's own;
3. where 1e-3 leaves less than a tenth, it gets 1e-2, else 0.1, else the loudest drive: the first
   that leaves a tenth. None is taken whose share at another finger is above what that one has
   of its own (with λ = 1e-3), or above what it feels if it plays nothing; the one before stays.

A finger chooses by the others' first drives, so the order of fingers does not matter. A device does
the same (firmware/esp32/core/fingers/choice.hpp) from sums that it keeps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers.silence import (
    REGULARISATION,
    FingerDrives,
    KnownPlate,
    Place,
    PressedPoints,
)
from chladni.sim.errors import ArgumentError

FloatArray = NDArray[np.float64]

STILLER = 1e-4
LOUDEST = 1e9
"""λ that leaves 3e-8 of the others' points in a drive: h̄*, to single precision."""
LOUDER = (1e-2, 1e-1, LOUDEST)
LEAST_OF_LOUDEST_DB = -20.0


@dataclass(frozen=True)
class ChosenDrives:
    """Drives for a set of fingers, and the λ of each.

    Attributes
    ----------
    found
        The drives, of their levels.
    regularisation
        λ over the mean square of a point's responses, shape (fingers,); `LOUDEST` for the loudest.
    """

    found: FingerDrives
    regularisation: FloatArray


def chosen_drives(
    plate: KnownPlate,
    fingers: Sequence[Place],
    *,
    thresholds: Sequence[float],
    levels: Sequence[float] | None = None,
    stiffness: complex = 0.0,
    real: bool | Sequence[bool] = False,
) -> ChosenDrives:
    """A drive for each finger, as still for the others as they feel it and no stiller.

    Parameters
    ----------
    plate
        What is known of the plate.
    fingers
        Middles of the fingertips, m from the plate's centre, one to five.
    thresholds
        Displacement that each finger feels, m, RMS over its disc, peak in time.
    levels
        Largest force of each drive as it will be played, N; 0 plays nothing; 1 each if left out.
    stiffness
        Force over displacement of each finger, N/m; 0 for a free plate.
    real
        Whether drives have real gains, as of `drives_for`.

    Returns
    -------
    ChosenDrives

    Raises
    ------
    ArgumentError
        No finger or more than five, or not a threshold for each.
    """
    count = len(fingers)
    felt = np.asarray(thresholds, dtype=np.float64)
    if felt.shape != (count,):
        raise ArgumentError("thresholds", felt.shape, f"one for each of {count} fingers")
    sizes = np.ones(count) if levels is None else np.asarray(levels, dtype=np.float64)
    pressed = PressedPoints.of(plate, fingers, stiffness, real)

    @cache
    def tried(each: float) -> FingerDrives:
        return pressed.drives(sizes, each)

    first = tried(REGULARISATION)
    tolerated = np.where(sizes > 0.0, np.diag(first.shares), felt)
    chosen = np.array([_choose(tried, own, felt, tolerated) for own in range(count)])
    chosen[sizes <= 0.0] = REGULARISATION
    return ChosenDrives(pressed.drives(sizes, chosen), chosen)


def _choose(
    tried: Callable[[float], FingerDrives], own: int, felt: FloatArray, tolerated: FloatArray
) -> float:
    """λ of one finger, by what others feel and what they tolerate, m."""
    others = np.arange(len(felt)) != own

    def is_quiet(each: float) -> bool:
        return bool(tried(each).below_loudest_db[own] < LEAST_OF_LOUDEST_DB)

    def is_above(each: float, most: FloatArray) -> bool:
        return bool(np.any(tried(each).shares[own][others] > most[others]))

    if not is_quiet(REGULARISATION):
        stiller = is_above(REGULARISATION, felt) and not is_quiet(STILLER)
        return STILLER if stiller else REGULARISATION
    taken = REGULARISATION
    for each in LOUDER:
        if is_above(each, tolerated):
            break
        taken = each
        if not is_quiet(each):
            break
    return taken
