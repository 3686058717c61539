"""The network: nothing is read or changed without the key, and nothing counts twice."""

from __future__ import annotations

import hashlib
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.host.device.device import Device
from chladni.host.device.wires.udp import (
    EmulatedPort,
    ReplayWindow,
    UdpWire,
    seal,
    unseal,
)
from chladni.host.device.wires.wire import EmulatorWire, WireError
from chladni.host.protocol.link import BY_NAME, RESPONSE, Status
from chladni.host.protocol.network import (
    HELLO_BYTES,
    MAC_BYTES,
    RENEW_AT,
    SESSION,
    SESSION_SILENCE_MS,
    Kind,
)
from made_up import powered
from networked import BIG, KEY, NEW, OLD, OTHER_KEY, Recorder, exchange, networked, session_of

INFO = bytes([BY_NAME["info"].code, 1])
PIECE = bytes([BY_NAME["table_data"].code, 1, 0, 0, 0, 0, 9])


def hmac_by_hand(key: bytes, data: bytes) -> bytes:
    """RFC 2104, written out."""
    padded = key.ljust(64, b"\0")
    inner = hashlib.sha256(bytes(b ^ 0x36 for b in padded) + data).digest()
    return hashlib.sha256(bytes(b ^ 0x5C for b in padded) + inner).digest()


def test_a_datagram_is_what_the_page_says_byte_by_byte() -> None:
    """As in docs/security.md: magic, version, kind, counter, session, body, half an HMAC."""
    data = seal(KEY, Kind.REQUEST, 0x01020304, 0x1122334455667788, b"\2\1")
    head = bytes.fromhex("1dc4 01 00 04030201 8877665544332211") + b"\2\1"
    assert data == head + hmac_by_hand(KEY, head)[:MAC_BYTES]


def test_a_device_without_a_key_is_silent() -> None:
    emulator = powered(OLD)
    assert exchange(emulator, seal(KEY, Kind.HELLO, 0, 1, bytes(SESSION.size))) == []
    assert Device(EmulatorWire(emulator)).network()["state"] == "off"


def test_requests_over_the_network_do_what_they_do_over_the_wire() -> None:
    emulator = networked()
    with Device(UdpWire(EmulatedPort(emulator), KEY)) as device:
        assert device.info()["table_bytes"] == len(OLD)
        done = device.flash(BIG)
        assert (done.verified, done.repeated) == (True, 0)
        device.touch(0.0, 0.0)
        assert emulator.run(60.0).duty_steps[-1].any()
        device.lift()
        found = device.network()
    assert (found["state"], found["ssid"], found["rejected"]) == ("on", "lab", 0)


def test_another_key_gets_no_answer() -> None:
    emulator = networked()
    with pytest.raises(WireError, match="the key its own"):
        UdpWire(EmulatedPort(emulator), OTHER_KEY)
    assert Device(EmulatorWire(emulator)).network()["rejected"] == 4


def test_every_single_flipped_bit_of_a_hello_and_of_a_request_is_refused() -> None:
    emulator = networked()
    session = session_of(emulator)
    hello = seal(KEY, Kind.HELLO, 0, 5, bytes(SESSION.size))
    request = seal(KEY, Kind.REQUEST, 1, session, INFO)
    for whole in (hello, request):
        spoilt = []
        for bit in range(8 * len(whole)):
            flipped = bytearray(whole)
            flipped[bit // 8] ^= 1 << bit % 8
            spoilt.append(bytes(flipped))
        # While hellos are many, those that bring no cookie are asked for one.
        said = exchange(emulator, *spoilt, apart=True)
        assert {data[3] for data in said} <= {Kind.CHALLENGE}
        shorter = (whole[:size] for size in range(len(whole)))
        assert exchange(emulator, *shorter, apart=True) == []
        assert exchange(emulator, whole + b"\0") == []
        assert len(exchange(emulator, whole)) == 1


def test_a_hello_is_no_shorter_than_its_answer() -> None:
    emulator = networked()
    hello = seal(KEY, Kind.HELLO, 0, 5, bytes(SESSION.size))
    (welcome,) = exchange(emulator, hello)
    assert len(welcome) <= len(hello) == HELLO_BYTES


def test_nothing_that_was_recorded_counts_again() -> None:
    """All of an update and a touch, both ways, sent again: at once, and after a restart."""
    emulator = networked()
    recorder = Recorder(EmulatedPort(emulator))
    device = Device(UdpWire(recorder, KEY))
    device.flash(NEW)
    device.touch(0.0, 0.0)
    device.lift()
    wire = Device(EmulatorWire(emulator))
    wire.previous()
    emulator.run(100.0)
    requests = [data for data in recorder.sent if data[3] == Kind.REQUEST]
    assert len(requests) >= 7
    assert exchange(emulator, *requests, *recorder.got) == []
    emulator.core.restart("software")
    emulator.core.udp_read()
    assert exchange(emulator, *requests, *recorder.got) == []
    assert wire.info()["table_crc"] == f"{int.from_bytes(OLD[-4:], 'little'):#010x}"
    assert not emulator.run(50.0).duty_steps.any()
    # A hello that is replayed is answered with what helps no one.
    hellos = [data for data in recorder.sent if data[3] == Kind.HELLO]
    for data in exchange(emulator, *hellos):
        opened = unseal(KEY, data)
        assert opened is not None
        assert opened.kind == Kind.WELCOME


@given(st.lists(st.tuples(st.integers(0, 80), st.booleans()), min_size=1, max_size=60))
@settings(max_examples=60, deadline=None)
def test_a_counter_is_taken_once_and_only_pieces_of_tables_late(
    counters: list[tuple[int, bool]],
) -> None:
    """The firmware against a set of what was taken, and the host's window beside it."""
    emulator = networked()
    session = session_of(emulator)
    window, taken, highest = ReplayWindow(), set(), 0
    for counter, is_piece in counters:
        body = PIECE if is_piece else INFO
        is_new = counter > 0 and counter not in taken
        expected = is_new and counter > highest - (32 if is_piece else 0)
        answered = exchange(emulator, seal(KEY, Kind.REQUEST, counter, session, body))
        assert (len(answered) == 1) == expected
        if expected:
            assert window.take(counter)
            taken.add(counter)
            highest = max(highest, counter)
        elif not is_new:
            assert not window.take(counter)


def test_counters_end_long_before_they_run_out() -> None:
    emulator = networked()
    session = session_of(emulator)
    last = seal(KEY, Kind.REQUEST, RENEW_AT, session, INFO)
    assert len(exchange(emulator, last)) == 1
    assert exchange(emulator, seal(KEY, Kind.REQUEST, RENEW_AT + 1, session, INFO)) == []
    assert session_of(emulator, session) != session
    assert exchange(emulator, last) == []


def test_what_was_held_back_is_out_of_date() -> None:
    """A touch that arrives after its repetition and the lift, and one after a long silence."""
    emulator = networked()
    session = session_of(emulator)
    touch, lift = (
        bytes([BY_NAME[name].code, k]) + bytes(sum(f.size for f in BY_NAME[name].request))
        for k, name in ((1, "touch"), (2, "lift"))
    )
    held, again, up = (
        seal(KEY, Kind.REQUEST, counter, session, body)
        for counter, body in ((1, touch), (2, touch), (3, lift))
    )
    assert len(exchange(emulator, again, up)) == 2
    emulator.run(100.0)
    assert exchange(emulator, held) == []
    newest = seal(KEY, Kind.REQUEST, 9, session, touch)
    emulator.run(SESSION_SILENCE_MS + 10.0)
    assert exchange(emulator, newest) == []
    assert not emulator.run(50.0).duty_steps.any()


def test_a_silent_host_goes_on_where_it_left() -> None:
    emulator = networked()
    device = Device(UdpWire(EmulatedPort(emulator), KEY))
    for silence_ms in (100.0, SESSION_SILENCE_MS * 0.7, SESSION_SILENCE_MS * 3.0):
        emulator.run(silence_ms)
        before = device.link.repeated
        assert device.info()["state"] == "idle"
        assert device.link.repeated == before


def test_replayed_hellos_do_not_end_a_session() -> None:
    emulator = networked()
    session = session_of(emulator)
    assert len(exchange(emulator, seal(KEY, Kind.REQUEST, 1, session, INFO))) == 1
    hello = seal(KEY, Kind.HELLO, 0, 5, bytes(SESSION.size))
    for _ in range(50):
        exchange(emulator, hello)
    assert len(exchange(emulator, seal(KEY, Kind.REQUEST, 2, session, INFO))) == 1


def test_any_request_over_the_network_gets_one_answer_with_its_number() -> None:
    emulator = networked()
    session, taken = session_of(emulator), 0
    rng = random.Random(4)
    for k, code in enumerate(rng.choices(range(1, 40), k=80)):
        if code == BY_NAME["restart"].code:
            continue
        taken += 1
        body = bytes([code, k + 1]) + rng.randbytes(rng.randrange(60))
        (data,) = exchange(emulator, seal(KEY, Kind.REQUEST, taken, session, body))
        opened = unseal(KEY, data)
        assert opened is not None
        assert opened.body[:2] == bytes([code | RESPONSE, k + 1])
        Status(opened.body[2])
        emulator.run(60.0)
    # What asks nothing is not answered: an answer's kind, and less than a head.
    for body in (bytes([RESPONSE | 2, 1]), b"\2", b""):
        taken += 1
        assert exchange(emulator, seal(KEY, Kind.REQUEST, taken, session, body)) == []
