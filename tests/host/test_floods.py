"""Recorded and endless hellos, and hosts that die in the middle of a touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.udp import EmulatedPort, UdpWire, seal, unseal
from chladni.host.device.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.host.protocol.link import BY_NAME
from chladni.host.protocol.network import SESSION, SESSION_SILENCE_MS, Kind
from chladni.tables.table import Limits
from made_up import LIMITS, MAX_ON_MS, RAMP_MS, make_table
from networked import KEY, LAB, exchange, networked, session_of

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


def test_one_source_gets_ten_answers_a_second_and_the_others_theirs() -> None:
    emulator = networked()
    hello = seal(KEY, Kind.HELLO, 0, 99, SESSION.pack(0))
    answers = 0
    for _ in range(1_000):
        emulator.core.udp_write(hello, REPLAYER)
        emulator.run(2.0)
        answers += len(emulator.core.udp_read())
    assert 20 + 18 <= answers <= 20 + 21
    assert connected(emulator).info()["state"] == "idle"


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
    emulator.run(SESSION_SILENCE_MS + 200.0)
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
