"""Raw duties over an emulated network: how late a host may be, and how far away."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.streaming import BUFFER_S, SMALLEST_PIECE, StreamStep
from chladni.host.device.wires.udp import UdpWire
from networked import FRAME_HZ, KEY, UnpunctualPort, late_ms, networked, wave


def streamed(
    port: UnpunctualPort, *, buffer_s: float = BUFFER_S
) -> tuple[Device, list[StreamStep]]:
    device = Device(UdpWire(port, KEY))
    steps = list(device.stream_steps(wave(10.0), buffer_s=buffer_s))
    assert sum(step.taken for step in steps) == len(wave(10.0))
    return device, steps


@pytest.mark.parametrize("late_s", [2e-3, 5e-3])
def test_a_host_that_is_late_by_less_than_the_ring_is_not_heard(late_s: float) -> None:
    device, steps = streamed(UnpunctualPort(networked(), late_s=late_s))
    assert device.faults() == []
    assert np.percentile(late_ms(steps), 99) < 10.0
    # Late pieces are in the ring for less time, and do not make the others come earlier.
    assert late_ms(steps).min() < np.median(late_ms(steps)) - 0.8e3 * late_s
    in_time = late_ms(streamed(UnpunctualPort(networked()))[1])
    assert np.median(late_ms(steps)) == pytest.approx(np.median(in_time), abs=0.3)


def test_a_host_that_is_later_than_the_ring_makes_underruns_and_a_longer_ring_none() -> None:
    device, _ = streamed(UnpunctualPort(networked(), late_s=9e-3))
    assert {fault["cause"] for fault in device.faults()} == {"stream underrun"}
    device, _ = streamed(UnpunctualPort(networked(), late_s=9e-3), buffer_s=0.02)
    assert device.faults() == []


@pytest.mark.parametrize("way_s", [0.0, 3e-3])
def test_pieces_are_as_long_as_the_way_asks_for(way_s: float) -> None:
    """A radio's answer takes longer than 1.6 ms: pieces that short could not be sent in time."""
    device, steps = streamed(UnpunctualPort(networked(), way_s=way_s), buffer_s=0.02)
    assert device.faults() == []
    piece = max(step.taken for step in steps)
    assert piece / FRAME_HZ > 2.0 * way_s
    assert piece >= SMALLEST_PIECE
