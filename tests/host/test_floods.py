"""Recorded and endless hellos, and hosts that die in the middle of a touch."""

from __future__ import annotations

import hmac
import random
from dataclasses import replace

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.udp import (
    MOST_CHALLENGES,
    EmulatedPort,
    UdpWire,
    cookie_of,
    seal,
    unseal,
)
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.host.protocol.link import BY_NAME
from chladni.host.protocol.network import HEAD, HELLO_BYTES, SESSION, SESSION_SILENCE_MS, Kind
from chladni.tables.table import Limits
from made_up import LIMITS, MAX_ON_MS, RAMP_MS, make_table
from networked import KEY, LAB, OTHER_KEY, Recorder, exchange, networked, session_of

INFO = bytes([BY_NAME["info"].code, 1])
REPLAYER, VICTIM = 7, 1


def connected(emulator: Emulator, peer: int = VICTIM) -> Device:
    return Device(UdpWire(EmulatedPort(emulator, peer), KEY))


def test_a_flood_of_recorded_hellos_locks_no_one_out() -> None:
    """333 a second; a new host's first request comes 20 ms after its hello."""
    emulator = networked()
    recorded = seal(KEY, Kind.HELLO, 0, 99, SESSION.pack(0))
    for visit in range(20):
        for _ in range(30):
            emulator.core.udp_write(recorded, REPLAYER)
            emulator.run(3.0)
        emulator.core.udp_read()
        emulator.core.udp_write(seal(KEY, Kind.HELLO, 0, visit, SESSION.pack(0)), VICTIM)
        emulator.run(2.0)
        (welcome,) = [data for peer, data in emulator.core.udp_read() if peer == VICTIM]
        opened = unseal(KEY, welcome)
        assert opened is not None
        (session,) = SESSION.unpack(opened.body)
        for _ in range(7):
            emulator.core.udp_write(recorded, REPLAYER)
            emulator.run(3.0)
        request = seal(KEY, Kind.REQUEST, 1, session, INFO)
        emulator.core.udp_read()
        emulator.core.udp_write(request, VICTIM)
        emulator.run(5.0)
        assert [peer for peer, _ in emulator.core.udp_read()].count(VICTIM) == 1


class FloodedPort(EmulatedPort):
    """Whoever forges this host's address sends a hello of his own in each millisecond."""

    def __init__(self, emulator: Emulator, peer: int) -> None:
        super().__init__(emulator, peer)
        self.rng = random.Random(peer)

    def receive(self, timeout_s: float) -> bytes | None:
        end = self.now_s() + timeout_s
        data = None
        while data is None and self.now_s() < end:
            self.emulator.core.udp_write(garbage(self.rng), self.peer)
            data = super().receive(1e-3)
        return data


def garbage(rng: random.Random) -> bytes:
    """A hello under no key."""
    return seal(OTHER_KEY, Kind.HELLO, rng.getrandbits(32), rng.getrandbits(64), SESSION.pack(0))


def hello_of(nonce: int, cookie: int = 0) -> bytes:
    return seal(KEY, Kind.HELLO, cookie, nonce, SESSION.pack(0))


def out_of_credit() -> Emulator:
    """A device that asks each hello for a cookie."""
    emulator = networked()
    rng = random.Random(1)
    exchange(emulator, *(garbage(rng) for _ in range(20)))
    return emulator


def answers_to(emulator: Emulator, hello: bytes, peer: int = VICTIM) -> list[bytes]:
    emulator.core.udp_write(hello, peer)
    emulator.run(2.0)
    return [data for at, data in emulator.core.udp_read() if at == peer]


def challenged(emulator: Emulator, nonce: int, peer: int = VICTIM) -> int:
    """The cookie that a hello gets in place of a welcome."""
    (challenge,) = answers_to(emulator, hello_of(nonce), peer)
    assert len(challenge) == HEAD.size
    cookie = cookie_of(challenge, nonce)
    assert cookie is not None
    return cookie


def kinds(datagrams: list[bytes]) -> list[int]:
    return [data[3] for data in datagrams]


def test_a_flood_with_a_hosts_own_address_keeps_it_out_no_moment() -> None:
    """1,000 a second: each of fifty visits is let in by its first hello, or by its cookie."""
    emulator = networked()
    for visit in range(50):
        port = FloodedPort(emulator, VICTIM)
        for _ in range(50):
            port.receive(1e-3)
        recorder = Recorder(port)
        assert Device(UdpWire(recorder, KEY)).info()["state"] == "idle"
        assert kinds(recorder.sent).count(Kind.HELLO) <= 2, visit


def test_a_flood_of_hellos_costs_next_to_no_macs_and_is_not_amplified() -> None:
    """Garbage, with the host's address or others; and a hello that was recorded."""
    emulator = networked()
    made: list[int] = []

    def counted(key: bytes, data: bytes) -> bytes:
        made.append(len(data))
        return hmac.digest(key, data, "sha256")

    emulator.core.set_hmac(counted)
    rng = random.Random(3)
    sent = 0
    for k in range(1_000):
        emulator.core.udp_write(garbage(rng), VICTIM if k % 2 else k)
        emulator.run(1.0)
        sent += sum(len(data) for _, data in emulator.core.udp_read())
    assert 20 <= len(made) <= 20 + 11
    assert sent <= 1_000 * HELLO_BYTES // 2
    cookie = challenged(emulator, 5)
    made.clear()
    for _ in range(1_000):
        emulator.core.udp_write(hello_of(5, cookie), VICTIM)
        emulator.core.udp_write(hello_of(5, cookie), REPLAYER)
        emulator.run(1.0)
    # The first is looked at, and answered with a number and a MAC.
    assert len(made) == 3
    assert kinds([data for _, data in emulator.core.udp_read()]) == [Kind.WELCOME]


def test_a_cookie_is_good_for_its_source_its_hello_and_some_seconds() -> None:
    emulator = out_of_credit()
    cookie = challenged(emulator, 5)
    assert kinds(answers_to(emulator, hello_of(5, cookie), REPLAYER)) == [Kind.CHALLENGE]
    assert kinds(answers_to(emulator, hello_of(6, cookie))) == [Kind.CHALLENGE]
    assert kinds(answers_to(emulator, hello_of(5, cookie ^ 1))) == [Kind.CHALLENGE]
    assert kinds(answers_to(emulator, hello_of(5, cookie))) == [Kind.WELCOME]
    assert answers_to(emulator, hello_of(5, cookie)) == []
    cookie = challenged(emulator, 7)
    emulator.run(4_100.0)
    rng = random.Random(2)
    exchange(emulator, *(garbage(rng) for _ in range(40)))
    assert kinds(answers_to(emulator, hello_of(7, cookie))) == [Kind.CHALLENGE]


def test_replayed_hellos_use_no_numbers_up() -> None:
    """The lower half of a session's number counts: at its end none would open."""
    emulator = networked()
    before = session_of(emulator) % 2**32
    for _ in range(200):
        exchange(emulator, hello_of(99))
    (welcome,) = answers_to(emulator, hello_of(100))
    opened = unseal(KEY, welcome)
    assert opened is not None
    assert SESSION.unpack(opened.body)[0] % 2**32 == before + 1


class Heckler(Recorder):
    """Someone who listens answers each datagram of the host with wrong challenges, and first."""

    forged: list[bytes]

    def send(self, data: bytes) -> None:
        super().send(data)
        head = data[:3] + bytes([Kind.CHALLENGE])
        self.forged = [head + bytes([1, 2, 3, k]) + data[8:16] for k in range(50)]

    def receive(self, timeout_s: float) -> bytes | None:
        return self.forged.pop() if self.forged else super().receive(timeout_s)


def test_a_host_answers_few_challenges_and_gets_in_all_the_same() -> None:
    heckler = Heckler(EmulatedPort(networked(), VICTIM))
    assert Device(UdpWire(heckler, KEY)).info()["state"] == "idle"
    assert kinds(heckler.sent).count(Kind.HELLO) <= 1 + MOST_CHALLENGES


def test_a_session_that_ended_is_not_opened_again_by_what_was_recorded_of_it() -> None:
    """Silent for too long, or out of place: its first request is as good as none."""
    emulator = networked()
    session = session_of(emulator)
    touch = BY_NAME["touch"]
    body = bytes([touch.code, 1]) + bytes(sum(field.size for field in touch.request))
    first = seal(KEY, Kind.REQUEST, 1, session, body)
    assert len(exchange(emulator, first)) == 1
    # Seven others come; the one that was silent longest makes room.
    for peer in range(10, 17):
        emulator.run(250.0)
        connected(emulator, peer).info()
    assert exchange(emulator, first) == []
    emulator.run(SESSION_SILENCE_MS + 100.0)
    assert exchange(emulator, first) == []


def test_a_number_that_was_handed_out_opens_nothing_after_some_seconds() -> None:
    """What a host asked first and somebody held back does not happen later."""
    emulator = networked()
    session = session_of(emulator)
    held = seal(KEY, Kind.REQUEST, 1, session, INFO)
    emulator.run(4_100.0)
    assert exchange(emulator, held) == []


def test_numbers_of_another_start_open_nothing() -> None:
    emulator = networked()
    session = session_of(emulator)
    emulator.core.restart("software")
    emulator.run(10.0)
    assert exchange(emulator, seal(KEY, Kind.REQUEST, 1, session, INFO)) == []


def test_a_host_that_dies_in_mid_touch_is_not_in_the_next_fingers_way() -> None:
    """Its touch ends at the longest there may be; no fault stands; the next finger plays."""
    emulator = networked()
    device = Device(EmulatorWire(emulator))
    device.touch(0.0, 0.0)
    emulator.run(MAX_ON_MS + RAMP_MS + 20.0)
    assert emulator.core.state == "idle"
    assert not emulator.run(50.0).duty_steps.any()
    at = emulator.core.now_us / 1e3
    emulator.touch(TouchEvent(at + 5.0, (1.0, 1.0)))
    assert emulator.run(60.0).duty_steps[-1].any()
    assert [cause for cause, _, _ in emulator.core.faults] == ["touch too long"]


def test_a_finger_that_stays_too_long_still_has_to_lift() -> None:
    emulator = networked()
    emulator.touch(TouchEvent(5.0, (1.0, 1.0)))
    emulator.run(MAX_ON_MS + 100.0)
    assert emulator.core.state == "fault"


def test_a_touch_ends_with_the_session_that_holds_it() -> None:
    """Where touches may last longer than a silent session."""
    patient = Limits(LIMITS.ramp_us, LIMITS.touch_timeout_us, 60_000_000)
    table = replace(make_table(np.ones((1, 5))), limits=patient)
    emulator = Emulator(networked().config, table, network=LAB)
    connected(emulator).touch(0.0, 0.0)
    assert emulator.run(100.0).duty_steps[-1].any()
    emulator.run(SESSION_SILENCE_MS + 200.0)
    assert not emulator.run(100.0).duty_steps[-100:].any()
    assert emulator.core.state == "idle"


def test_a_session_that_ends_leaves_the_touch_that_the_wire_has_begun_since() -> None:
    patient = Limits(LIMITS.ramp_us, LIMITS.touch_timeout_us, 60_000_000)
    table = replace(make_table(np.ones((1, 5))), limits=patient)
    emulator = Emulator(networked().config, table, network=LAB)
    connected(emulator).touch(0.0, 0.0)
    wire = Device(EmulatorWire(emulator))
    wire.touch(1.0, 1.0)
    for _ in range(round(SESSION_SILENCE_MS / 500.0) + 1):
        emulator.run(500.0)
        wire.info()  # a host that holds a touch is not silent
    assert emulator.run(50.0).duty_steps[-1].any()
    wire.lift()
    assert not emulator.run(50.0).duty_steps[-1].any()


@pytest.mark.parametrize("line", [b"a\n", b"info\n", b"faults\n"])
def test_a_flood_of_lines_leaves_the_wire_free_for_requests(line: bytes) -> None:
    """A second of them, as fast as the wire takes them: 66 KB of answers in the first case, and so
    many seconds of a main loop that waits for its wire to take them."""
    emulator = networked()
    emulator.core.uart_write(line * (11_520 // len(line)))
    emulator.run(1_001.0)
    waiting = len(emulator.core.uart_read())
    assert waiting < 0.6 * 11_520
    device = Device(EmulatorWire(emulator))
    assert device.info()["state"] == "idle"
    assert device.link.repeated == 0
    # Whoever types afterwards is answered.
    emulator.run(200.0)
    emulator.core.uart_read()
    emulator.core.uart_write(b"lift\n")
    emulator.run(20.0)
    assert emulator.core.uart_read() == b"ok\r\n"
