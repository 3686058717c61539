"""The network: nothing is read or changed without the key, and nothing counts twice."""

from __future__ import annotations

import contextlib
import hashlib
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.host.device.device import Device
from chladni.host.device.link import LinkError
from chladni.host.device.udp import (
    DatagramWire,
    EmulatedPort,
    ReplayWindow,
    seal,
    unseal,
)
from chladni.host.device.wire import EmulatorWire, WireError
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.link import BY_NAME, MESSAGES, RESPONSE, Status
from chladni.host.protocol.network import (
    HELLO_BYTES,
    KEY_BYTES,
    MAC_BYTES,
    RENEW_AT,
    SESSION,
    SESSION_SILENCE_MS,
    Kind,
    NetworkSettings,
    make_key,
    pack_network,
    read_key,
)
from chladni.sim.errors import InputError
from chladni.tables.format import pack
from made_up import assert_one_of_them_plays, make_table, powered, random_table

KEY = bytes(range(1, KEY_BYTES + 1))
OTHER_KEY = bytes(KEY_BYTES - 1) + b"\1"
LAB = NetworkSettings("lab", "a passphrase", KEY)
OLD, NEW = (pack(make_table(np.array([[gain, 1.0, 2.0, 3.0, 4.0]]))) for gain in (10.0, 5.0))
BIG = pack(random_table(30, 20, 5, 3))
INFO = bytes([BY_NAME["info"].code, 1])
PIECE = bytes([BY_NAME["table_data"].code, 1, 0, 0, 0, 0, 9])


def networked() -> Emulator:
    """An emulated device on the network."""
    return powered(OLD, network=LAB)


def exchange(emulator: Emulator, *datagrams: bytes) -> list[bytes]:
    """What the device answers within 5 ms."""
    for data in datagrams:
        emulator.core.udp_write(data)
    emulator.run(5.0)
    return [data for _, data in emulator.core.udp_read()]


def session_of(emulator: Emulator, known: int = 0) -> int:
    """The session that the device opens, or goes on with."""
    (welcome,) = exchange(emulator, seal(KEY, Kind.HELLO, 0, 99, SESSION.pack(known)))
    opened = unseal(KEY, welcome)
    assert opened is not None
    assert (opened.kind, opened.session) == (Kind.WELCOME, 99)
    return int(SESSION.unpack(opened.body)[0])


@dataclass
class Recorder:
    """A port that keeps what went either way, and may spoil it first."""

    inner: EmulatedPort
    spoil: Callable[[bytes], list[bytes]] = lambda data: [data]
    sent: list[bytes] = field(default_factory=list)
    got: list[bytes] = field(default_factory=list)
    name: str = "recorded"

    def send(self, data: bytes) -> None:
        """To the device."""
        self.sent.append(data)
        for part in self.spoil(data):
            self.inner.send(part)

    def receive(self, timeout_s: float) -> bytes | None:
        """From it."""
        data = self.inner.receive(timeout_s)
        if data is None:
            return None
        self.got.append(data)
        parts = self.spoil(data)
        return parts[0] if parts else None

    def now_s(self) -> float:
        """Virtual seconds."""
        return self.inner.now_s()

    def close(self) -> None:
        """Nothing."""


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
    with Device(DatagramWire(EmulatedPort(emulator), KEY)) as device:
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
        DatagramWire(EmulatedPort(emulator), OTHER_KEY)
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
        assert exchange(emulator, *spoilt) == []
        assert exchange(emulator, *(whole[:size] for size in range(len(whole)))) == []
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
    device = Device(DatagramWire(recorder, KEY))
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
    # A hello that is replayed is answered with what helps nobody.
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
    device = Device(DatagramWire(EmulatedPort(emulator), KEY))
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


def test_the_key_is_set_over_the_wire_only_and_never_told() -> None:
    emulator = networked()
    over_network = Device(DatagramWire(EmulatedPort(emulator), KEY))
    for settings_ in (None, NetworkSettings("other", "", OTHER_KEY)):
        with pytest.raises(LinkError, match="refuses"):
            over_network.set_network(settings_)
    told, counter, session = b"", 0, session_of(emulator)
    for message in MESSAGES:
        if message.name == "restart":
            continue
        body = bytes([message.code, 9]) + bytes(sum(f.size for f in message.request))
        counter += 1
        (answer,) = exchange(emulator, seal(KEY, Kind.REQUEST, counter, session, body))
        told += answer
    assert b"lab" in told
    assert KEY[:8] not in told
    assert b"passphrase" not in told


def test_the_wire_sets_a_key_for_the_next_start_and_takes_it_away() -> None:
    emulator = powered(OLD)
    device = Device(EmulatorWire(emulator))
    device.set_network(LAB)
    assert emulator.core.network_port == 0
    device.restart()
    emulator.run(400.0)
    assert emulator.core.network_port == LAB.port
    assert Device(DatagramWire(EmulatedPort(emulator), KEY)).info()["state"] == "idle"
    device.set_network(None)
    device.restart()
    emulator.run(400.0)
    assert emulator.core.network_port == 0


@given(st.integers(0, len(pack_network(LAB)) - 1), st.integers(1, 255))
@settings(max_examples=60, deadline=None)
def test_a_damaged_record_is_refused(at: int, change: int) -> None:
    record = bytearray(pack_network(LAB))
    record[at] ^= change
    emulator = powered(OLD)
    with pytest.raises(LinkError, match="fields that cannot be"):
        Device(EmulatorWire(emulator)).link.request("network_set", bytes(record))
    assert emulator.core.flash_bytes("network").strip(b"\xff") == b""


def test_a_cut_while_a_key_is_written_leaves_the_old_key_the_new_or_none() -> None:
    """After every byte of the erase and of the record."""
    new = NetworkSettings("lab", "a passphrase", OTHER_KEY)
    ports = []
    for after in [*range(0, 4096, 256), *range(4096, 4096 + len(pack_network(new)) + 1)]:
        emulator = networked()
        device = Device(EmulatorWire(emulator))
        emulator.core.cut_power_after(after, "network")
        with contextlib.suppress(LinkError):
            device.set_network(new)
        emulator.core.restore_power()
        emulator.core.boot()
        assert emulator.core.table_status == "ok"
        ports.append(emulator.core.network_port)
        if ports[-1]:
            key = OTHER_KEY if after >= 4096 else KEY
            assert Device(DatagramWire(EmulatedPort(emulator), key)).info()["state"] == "idle"
    assert 0 in ports
    assert ports[-1] == new.port


def test_a_restart_is_met_with_a_new_session() -> None:
    emulator = networked()
    device = Device(DatagramWire(EmulatedPort(emulator), KEY))
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


@given(st.floats(0.0, 0.25), st.floats(0.0, 0.1), st.floats(0.0, 0.3), st.floats(0.0, 0.3),
       st.integers(0, 10**6))  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_a_flash_over_a_bad_network_ends_right_or_says_that_it_failed(
    loss: float, flips: float, repeats: float, late: float, seed: int
) -> None:
    emulator = networked()
    recorder = Recorder(EmulatedPort(emulator), BadNetwork(loss, flips, repeats, late, seed))
    try:
        said = Device(DatagramWire(recorder, KEY)).flash(BIG).verified
    except (LinkError, WireError):
        said = False
    assert_one_of_them_plays(emulator, OLD, BIG, said=said)


def test_two_hosts_have_sessions_of_their_own() -> None:
    """Same numbers, other wishes: each is done, and none hears the other's answer."""
    emulator = networked()
    recorders = [Recorder(EmulatedPort(emulator, peer)) for peer in (1, 2)]
    first, second = (Device(DatagramWire(recorder, KEY)) for recorder in recorders)
    for device, level in ((first, 20_000), (second, 10_000)):
        device.set_config(device.config().with_values(level_q15=level))
    emulator.core.boot()
    assert Device(EmulatorWire(emulator)).config()["level_q15"] == 10_000
    answers = [data for data in recorders[0].got if data[3] == Kind.ANSWER]
    wire = second.wire
    assert isinstance(wire, DatagramWire)
    assert all(wire._take(data) == b"" for data in answers)


def test_many_short_visits_find_room_and_a_busy_host_keeps_its_own() -> None:
    """Twenty commands within seconds, while somebody asks again and again."""
    emulator = networked()
    busy = Device(DatagramWire(EmulatedPort(emulator, 99), KEY))
    for peer in range(20):
        for _ in range(4):
            busy.info()
            emulator.run(60.0)
        assert Device(DatagramWire(EmulatedPort(emulator, peer), KEY)).info()["state"] == "idle"
    assert busy.link.repeated == 0


def test_a_second_host_does_not_disturb_a_stream() -> None:
    emulator = networked()
    first, second = (Device(DatagramWire(EmulatedPort(emulator, k), KEY)) for k in (1, 2))
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

    device = Device(DatagramWire(Recorder(EmulatedPort(emulator), lose), KEY))
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
    Device(DatagramWire(recorder, KEY)).restart()
    assert [cause for cause, _, _ in emulator.core.faults] == ["reset"]
    assert emulator.core.state == "idle"


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


def test_keys_are_made_for_their_owner_and_read_with_reasons(tmp_path: Path) -> None:
    path = tmp_path / "device.key"
    key = make_key(path)
    assert path.stat().st_mode & 0o777 == 0o600
    assert read_key(path) == key
    with pytest.raises(InputError, match="a file to make"):
        make_key(path)
    with pytest.raises(InputError, match="a readable file"):
        read_key(tmp_path / "none")
    path.write_text("zz")
    with pytest.raises(InputError, match="64 hexadecimal digits"):
        read_key(path)


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"ssid": ""}, "ssid"),
        ({"ssid": "x" * 33}, "ssid"),
        ({"passphrase": "short"}, "passphrase"),
        ({"passphrase": "x" * 64}, "passphrase"),
        ({"key": bytes(32)}, "key"),
        ({"key": b"1"}, "key"),
        ({"port": 80}, "port"),
    ],
)
def test_settings_that_cannot_be_are_named(fields: dict[str, object], named: str) -> None:
    known: dict[str, object] = {"ssid": "lab", "passphrase": "", "key": KEY}
    with pytest.raises(InputError, match=named):
        NetworkSettings(**(known | fields))  # type: ignore[arg-type]


def test_the_record_has_its_fields_where_the_page_says() -> None:
    record = pack_network(LAB)
    assert record[:4] == b"CHLN"
    assert struct.unpack_from("<HH", record, 4) == (1, LAB.port)
    assert record[8:40] == KEY
    assert record[40:43] == b"lab"
    assert record[72:84] == b"a passphrase"
