"""Keys and names of networks: set over the wire, kept in flash, read from files."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.udp import (
    EmulatedPort,
    UdpWire,
    seal,
)
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.protocol.link import MESSAGES
from chladni.host.protocol.network import (
    Kind,
    NetworkSettings,
    make_key,
    pack_network,
    read_key,
)
from chladni.sim.errors import InputError
from made_up import powered
from networked import KEY, LAB, OLD, OTHER_KEY, exchange, networked, session_of


def test_the_key_is_set_over_the_wire_only_and_never_told() -> None:
    emulator = networked()
    over_network = Device(UdpWire(EmulatedPort(emulator), KEY))
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
    assert Device(UdpWire(EmulatedPort(emulator), KEY)).info()["state"] == "idle"
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
    with pytest.raises(LinkError, match="invalid fields"):
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
            assert Device(UdpWire(EmulatedPort(emulator), key)).info()["state"] == "idle"
    assert 0 in ports
    assert ports[-1] == new.port


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
