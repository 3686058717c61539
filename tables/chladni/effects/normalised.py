"""From the 0 to 1 of `.haptic` and AHAP to hertz.

Neither format says what its frequency or sharpness is in hertz: each device has its own range. Ours
is 80 to 230 Hz, in straight proportion. Below, a finger feels little; above, boards focus less and
the low-pass begins.
"""

from __future__ import annotations

from collections.abc import Iterable

LOWEST_HZ, HIGHEST_HZ = 80.0, 230.0


def to_hz(share: float) -> float:
    """Of a frequency or sharpness from 0 to 1; beyond, the nearest."""
    return LOWEST_HZ + (HIGHEST_HZ - LOWEST_HZ) * min(max(share, 0.0), 1.0)


def from_hz(frequency_hz: float) -> float:
    """The frequency or sharpness that stands for it; of others the nearest, 0 or 1."""
    return min(max((frequency_hz - LOWEST_HZ) / (HIGHEST_HZ - LOWEST_HZ), 0.0), 1.0)


def beyond(frequency_hz: Iterable[float]) -> list[str]:
    """What of some frequencies 0 to 1 cannot say."""
    others = [hz for hz in frequency_hz if not LOWEST_HZ <= hz <= HIGHEST_HZ]
    if not others:
        return []
    return [f"{min(others):g} to {max(others):g} Hz, beyond {LOWEST_HZ:g} to {HIGHEST_HZ:g}"]
