"""How much later several fingers are heard than one: their drives are found in the main loop."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.host.emulation.emulator import Emulator, TouchEvent
from firmware.bank_boards import LIMITS
from made_up import device_of, starts_of
from plate_of_bumps import responses_table

PLACES = ((-18.0, 30.0), (17.0, -25.0), (-20.0, -30.0), (20.0, 32.0), (0.0, 0.0))
Place = tuple[float, float]


def lay(emulator: Emulator, at_ms: float, fingers: dict[int, Place | None]) -> None:
    for finger, place in fingers.items():
        emulator.touch(TouchEvent(at_ms, place, finger=finger))


def coils_at_random(channels: int) -> list[Place]:
    """m from the middle."""
    rng = np.random.default_rng(5)
    return [(rng.uniform(-0.025, 0.025), rng.uniform(-0.045, 0.045)) for _ in range(channels)]


@pytest.mark.parametrize(("channels", "fingers", "turns"), [(5, 2, 0), (16, 2, 0), (16, 5, 3)])
def test_a_finger_more_is_heard_within_turns(channels: int, fingers: int, turns: int) -> None:
    """A turn of the main loop is a millisecond: so much later than the first finger alone.

    And the bus brings eight bytes more of each finger, 0.2 ms; a sample takes 0.05.
    """
    table = responses_table(coils_at_random(channels), limits=LIMITS)

    def latency_ms(count: int) -> float:
        emulator = Emulator(device_of(table), table, level=1.0)
        lay(emulator, 20.0, dict(enumerate(PLACES[:count])))
        recording = emulator.run(80.0)
        first = np.flatnonzero(recording.duty_steps.any(axis=1))[0]
        return float(first / recording.carrier_hz * 1e3)

    assert latency_ms(fingers) - latency_ms(1) <= turns + 0.3 * fingers


@pytest.mark.parametrize("channels", [5, 16])
def test_two_fingers_are_heard_a_millisecond_later_than_one(channels: int) -> None:
    """From the panel's call to the first duty, p99 of 200 touches; each λ is chosen."""
    table = responses_table(coils_at_random(channels), limits=LIMITS)

    def p99_ms(count: int) -> float:
        rng = np.random.default_rng(6)
        emulator = Emulator(device_of(table), table, level=1.0)
        at = 20.0
        for _ in range(200):
            x, y = rng.uniform(-20.0, -9.0), rng.uniform(-38.0, 38.0)
            places: tuple[Place, ...] = ((x, y), (-x, rng.uniform(-38.0, 38.0)))
            lay(emulator, at, dict(enumerate(places[:count])))
            lay(emulator, at + 25.0, dict.fromkeys(range(count)))
            at += rng.uniform(70.0, 80.0)
        recording = emulator.run(at + 60.0)
        calls, starts = np.array(emulator.core.calls), starts_of(recording)
        waits = [float(own - calls[calls < own].max()) / recording.carrier_hz for own in starts]
        assert len(waits) == 200
        return 1e3 * float(np.percentile(waits, 99))

    assert p99_ms(2) - p99_ms(1) <= 1.0
