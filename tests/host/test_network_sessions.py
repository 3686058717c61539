"""Sessions over a bad network: restarts, two hosts, streams, lost datagrams."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.udp import (
    EmulatedPort,
    UdpWire,
    unseal,
)
from chladni.host.device.wires.wire import EmulatorWire, WireError
from chladni.host.protocol.link import BY_NAME, RESPONSE
from chladni.host.protocol.network import (
    Kind,
)
from made_up import assert_one_of_them_plays
from networked import BIG, KEY, OLD, Recorder, networked, session_of


def test_a_restart_is_met_with_a_new_session() -> None:
    emulator = networked()
    device = Device(UdpWire(EmulatedPort(emulator), KEY))
    before = session_of(emulator)
    device.restart()
    emulator.run(400.0)
    assert device.info()["state"] == "idle"
    assert session_of(emulator, before) != before


@dataclass
class BadNetwork:
    """Loses, repeats, holds back and bends datagrams, with a seed."""

    loss: float
    flips: float
    repeats: float
    late: float
    seed: int
    held: list[bytes] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.random = random.Random(self.seed)

    def __call__(self, data: bytes) -> list[bytes]:
        """What arrives now instead of one datagram."""
        out = [*self.held]
        self.held = []
        if self.random.random() < self.flips:
            spoilt = bytearray(data)
            spoilt[self.random.randrange(len(spoilt))] ^= 1 << self.random.randrange(8)
            data = bytes(spoilt)
        if self.random.random() < self.late:
            self.held = [data]  # it is overtaken by the next
        elif self.random.random() >= self.loss:
            out.insert(0, data)
        return out * (2 if self.random.random() < self.repeats else 1)


@given(
    st.floats(0.0, 0.25),
    st.floats(0.0, 0.1),
    st.floats(0.0, 0.3),
    st.floats(0.0, 0.3),
    st.integers(0, 10**6),
)
@settings(max_examples=40, deadline=None)
def test_a_flash_over_a_bad_network_ends_right_or_says_that_it_failed(
    loss: float, flips: float, repeats: float, late: float, seed: int
) -> None:
    emulator = networked()
    recorder = Recorder(EmulatedPort(emulator), BadNetwork(loss, flips, repeats, late, seed))
    try:
        said = Device(UdpWire(recorder, KEY)).flash(BIG).verified
    except (LinkError, WireError):
        said = False
    assert_one_of_them_plays(emulator, OLD, BIG, said=said)


def test_two_hosts_have_sessions_of_their_own() -> None:
    """Same numbers, other wishes: each is done, and none hears the other's answer."""
    emulator = networked()
    recorders = [Recorder(EmulatedPort(emulator, peer)) for peer in (1, 2)]
    first, second = (Device(UdpWire(recorder, KEY)) for recorder in recorders)
    for device, level in ((first, 20_000), (second, 10_000)):
        device.set_config(device.config().with_values(level_q15=level))
    emulator.core.boot()
    assert Device(EmulatorWire(emulator)).config()["level_q15"] == 10_000
    answers = [data for data in recorders[0].got if data[3] == Kind.ANSWER]
    wire = second.wire
    assert isinstance(wire, UdpWire)
    assert all(wire._take(data) == b"" for data in answers)


def test_many_short_visits_find_room_and_a_busy_host_keeps_its_own() -> None:
    """Twenty commands within seconds, while somebody asks again and again."""
    emulator = networked()
    busy = Device(UdpWire(EmulatedPort(emulator, 99), KEY))
    for peer in range(20):
        for _ in range(4):
            busy.info()
            emulator.run(60.0)
        assert Device(UdpWire(EmulatedPort(emulator, peer), KEY)).info()["state"] == "idle"
    assert busy.link.repeated == 0


def test_a_second_host_does_not_disturb_a_stream() -> None:
    emulator = networked()
    first, second = (Device(UdpWire(EmulatedPort(emulator, k), KEY)) for k in (1, 2))
    t = np.arange(9_766)[:, None] / 9765.625
    steps = first.stream_steps(0.3 + 0.2 * np.sin(2.0 * np.pi * 160.0 * t + np.zeros(5)))
    taken = 0
    for k, step in enumerate(steps):
        taken += step.taken
        if k % 40 == 20:
            assert second.info()["state"] == "streaming"
    assert taken == len(t)
    assert first.faults() == []


@pytest.mark.parametrize("direction", ["request", "answer"])
def test_one_lost_datagram_does_not_end_a_stream(direction: str) -> None:
    emulator = networked()
    count = 0

    def lose(data: bytes) -> list[bytes]:
        nonlocal count
        if (data[3] == Kind.REQUEST) != (direction == "request"):
            return [data]
        count += 1
        return [] if count == 60 else [data]

    device = Device(UdpWire(Recorder(EmulatedPort(emulator), lose), KEY))
    t = np.arange(9_766)[:, None] / 9765.625
    duties = 0.3 + 0.2 * np.sin(2.0 * np.pi * 160.0 * t + np.zeros(5))
    assert device.stream(duties) == len(t)
    assert {fault["cause"] for fault in device.faults()} <= {"stream underrun"}


def test_a_restart_whose_answer_is_lost_is_done_once() -> None:
    emulator = networked()
    emulator.run(3_000.0)

    def lose(data: bytes) -> list[bytes]:
        opened = unseal(KEY, data)
        assert opened is not None
        lost = opened.kind == Kind.ANSWER and opened.body[0] == BY_NAME["restart"].code | RESPONSE
        return [] if lost else [data]

    recorder = Recorder(EmulatedPort(emulator), lose)
    Device(UdpWire(recorder, KEY)).restart()
    assert [cause for cause, _, _ in emulator.core.faults] == ["reset"]
    assert emulator.core.state == "idle"
