"""Commands at ports as they are: pseudo-terminals, wrong rates, pulled plugs."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import struct
import threading
import tty
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import serial

from chladni.host.cli.device.commands import who_answers
from chladni.host.device.device import Device
from chladni.host.device.wires.link import Link, encode
from chladni.host.device.wires.wire import SerialWire
from chladni.host.protocol.codes import DEVICE_STATE
from chladni.host.protocol.link import BY_NAME, RESPONSE
from chladni.sim.board.board import Board
from chladni.tables.format import pack, read_table
from conftest import CommandLine
from made_up import SCRIPT


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A greeting is sent once: four with waits that double take 4 s, and none is answered."""
    monkeypatch.setattr("chladni.host.device.device.GREETING_TRIES", 1)
    monkeypatch.setattr("chladni.host.device.wires.udp.HELLO_TRIES", 1)


@pytest.mark.slow
def test_a_pseudo_terminal_is_met_as_a_device(
    chladni: CommandLine, port: str, table_file: Path
) -> None:
    """Flash, look, touch, power cycle; then the port is busy for a second program."""
    done = chladni("flash", table_file, "--port", port, "--json")
    assert done.code == 0, done.err
    assert done.json["verified"]
    shown = chladni("device", "info", "--port", port, "--json")
    assert (shown.json["slot"], shown.json["erases"]) == (0, 0)  # it was there already
    other = table_file.with_name("other.chl")
    written = read_table(table_file)
    other.write_bytes(pack(replace(written, limits=replace(written.limits, ramp_us=5_000))))
    assert chladni("flash", other, "--port", port).code == 0
    assert chladni("device", "info", "--port", port, "--json").json["slot"] == 1
    assert chladni("flash", "--previous", "--port", port).code == 0
    assert chladni("device", "touch", "5,5", "--seconds", "0.3", "--port", port).code == 0
    with Device(SerialWire(port)) as device:
        busy = chladni("device", "info", "--port", port)
        assert (busy.code, "busy" in busy.err) == (1, True)
        device.restart()


@pytest.mark.usefixtures("impatient")
def test_a_program_that_speaks_something_else_is_not_taken_for_a_device(
    chladni: CommandLine,
) -> None:
    master, slave = os.openpty()
    os.write(master, b"login: \r\n" * 3)
    done = chladni("device", "info", "--port", os.ttyname(slave))
    assert done.code == 1
    assert "no device answers" in done.err
    os.close(master)
    os.close(slave)


@pytest.fixture
def udp_port() -> int:
    """A UDP port that is free, and that neither the system nor another worker gives away."""
    first = 21_000 + 100 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
    for number in range(first, first + 100):
        with contextlib.suppress(OSError), socket.socket(type=socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", number))
            return number
    raise AssertionError("no UDP port is free")


@pytest.mark.slow
def test_a_key_set_over_the_wire_opens_the_network(
    chladni: CommandLine,
    port: str,
    table_file: Path,
    tmp_path: Path,
    udp_port: int,
    request: pytest.FixtureRequest,
) -> None:
    """Set, flash and touch over UDP, refuse another key, and close it again."""
    key, passphrase = tmp_path / "own.key", tmp_path / "passphrase"
    passphrase.write_text("a passphrase\n")
    there = ("--udp", f"127.0.0.1:{udp_port}", "--key", key)
    done = chladni(
        "device",
        "network",
        "set",
        "--ssid",
        "lab",
        "--key",
        key,
        "--passphrase-file",
        passphrase,
        "--udp-port",
        str(udp_port),
        "--port",
        port,
        "--json",
    )
    assert done.code == 0, done.err
    assert (done.json["state"], done.json["ssid"]) == ("on", "lab")
    assert chladni("flash", table_file, *there, "--json").json["verified"]
    assert chladni("device", "touch", "5,5", "--seconds", "0.3", *there).code == 0
    request.getfixturevalue("impatient")
    other = tmp_path / "other.key"
    other.write_text("ab" * 32)
    other.chmod(0o600)
    refused = chladni("device", "info", "--udp", there[1], "--key", other)
    assert (refused.code, "the key its own" in refused.err) == (1, True)
    assert chladni("device", "network", "off", "--port", port, "--json").json["state"] == "off"
    assert chladni("device", "info", *there).code == 1


class Unplugged:
    """A pseudo-terminal that is taken away in the middle of a command."""

    def __init__(self, answers: bytes) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        self.port, self._answers, self._slave = os.ttyname(slave), answers, slave
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> str:
        self._thread.start()
        return self.port

    def _run(self) -> None:
        os.read(self.master, 100)
        os.write(self.master, self._answers)
        os.read(self.master, 100)
        os.close(self._slave)
        os.close(self.master)

    def __exit__(self, *_: object) -> None:
        self._thread.join()


def test_a_channel_that_draws_nothing_fails_the_self_test(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its row says so, and so does the exit code; the object is whole all the same."""
    ask = Device.live

    def lose(self: Device, gains: list[complex], *rest: Any) -> None:
        ask(self, [0j if k == 2 else gain for k, gain in enumerate(gains)], *rest)

    monkeypatch.setattr(Device, "live", lose)
    done = chladni("device", "self-test", "--emulator", "--json")
    assert done.code == 1
    assert [row["ok"] for row in done.json["channels"]] == [True, True, False, True, True]
    assert "something else: 2" in done.err


@pytest.mark.slow
def test_the_emulated_wire_follows_its_configuration(
    chladni: CommandLine, port: str, tmp_path: Path
) -> None:
    """As docs/device.md says: set `link_baud`, then stream."""
    done = chladni("device", "config", "set", "link_baud=921600", "--port", port)
    assert done.code == 0, done.err
    path = tmp_path / "wave.py"
    path.write_text(SCRIPT.format(channels=5, more=""))
    there = ("--port", port, "--baud", "921600", "--json")
    for _ in range(6):
        done = chladni("device", "stream", "--script", path, "--seconds", "1", *there)
        if done.code == 0 and not done.json["faults"]:
            break  # a busy machine may leave a gap
    assert done.code == 0, done.err
    assert done.json["frames"] == 9_766
    shown = chladni("device", "config", "get", "link_baud", *there)
    assert shown.json == {"link_baud": 921_600}


def test_a_touch_that_is_interrupted_is_lifted(
    chladni: CommandLine, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C in the middle: the finger does not stay behind."""
    states = []

    def press_ctrl_c(link: Link, _: float) -> None:
        states.append(DEVICE_STATE.text(link.request("info").fields["state"]))
        signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as waiting:
        waiting.setattr(Link, "wait", press_ctrl_c)
        done = chladni("device", "touch", "5,5", "--seconds", "30", "--port", port)
    assert (done.code, done.err) == (130, "chladni: interrupted\n")
    assert states == ["playing"]
    with Device(SerialWire(port)) as device:
        device.link.wait(0.2)
        assert device.info()["state"] == "idle"


@pytest.mark.slow
def test_a_plug_that_is_pulled_ends_a_command_with_a_reason(
    chladni: CommandLine, table_file: Path
) -> None:
    hello = encode(BY_NAME["hello"].code | RESPONSE, 1, struct.pack("<BBBHH", 0, 1, 1, 3, 1024))
    with Unplugged(hello) as port:
        done = chladni("flash", table_file, "--port", port)
    assert done.code == 1
    assert port in done.err
    assert "Traceback" not in done.err


@pytest.mark.usefixtures("impatient")
def test_another_baud_rate_is_not_taken_for_a_device(chladni: CommandLine) -> None:
    """A console that prints at 9600 while we listen at 115200: bytes that make no sense."""
    master, slave = os.openpty()
    tty.setraw(slave)
    os.write(master, bytes((37 * k * k + 11) % 256 for k in range(3000)))
    done = chladni("device", "info", "--port", os.ttyname(slave))
    assert done.code == 1
    assert "baud rate" in done.err
    os.close(master)
    os.close(slave)


def test_no_permission_is_said_with_what_to_do(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Root may open anything, so the refusal is the operating system's in name only."""

    def refuse(_: object) -> None:
        raise serial.SerialException(13, "could not open port: [Errno 13] Permission denied")

    monkeypatch.setattr(serial.Serial, "open", refuse)
    done = chladni("device", "info", "--port", "/dev/ttyS0")
    assert done.code == 1
    assert "join the group" in done.err


def test_who_answers_at_a_port_is_told(port: str, prototype: Board) -> None:
    assert who_answers(port) == {"board": prototype.name, "why": None}
    found = who_answers("/dev/nothing")
    assert found["board"] is None
    assert "no such port" in str(found["why"])


def test_a_command_waits_for_the_link_of_a_device_that_starts(
    chladni: CommandLine, port: str, tmp_path: Path
) -> None:
    link = tmp_path / "a-port"
    late = threading.Timer(0.4, link.symlink_to, (port,))
    late.start()
    answer = chladni("device", "info", "--port", link, "--json")
    late.join()
    assert answer.code == 0, answer.err
    assert answer.json["state"] == "idle"


def test_a_command_says_that_it_waits_for_a_port_outside_of_dev(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An emulated device makes its link some seconds after it was started."""
    monkeypatch.setattr("chladni.host.cli.device.connection.STARTS_S", 0.1)
    link = tmp_path / "own.port"
    waits, ended = chladni("device", "info", "--port", link).err.splitlines()
    assert waits.startswith(f"chladni: {link} is not there: waiting up to 0.1 s")
    assert "no such port; an emulated device may still be starting, or has ended" in ended
    assert f"`chladni emulate --serial --port-link {link}` makes it" in ended
    assert "waiting" not in chladni("device", "info", "--port", "/dev/nothing").err
