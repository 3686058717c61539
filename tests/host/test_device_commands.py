"""`chladni flash` and `chladni device`, on the emulated device and over a pseudo-terminal."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import serial

from chladni.host.cli.device import who_answers
from chladni.host.device.device import Device
from chladni.host.device.link import encode
from chladni.host.device.wire import SerialWire
from chladni.host.protocol.link import BY_NAME, RESPONSE
from chladni.sim.board.board import Board
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from conftest import CommandLine


@pytest.fixture
def table(coarse_table: tuple[Table, TableReport], prototype: Board, tmp_path: Path) -> Path:
    """A small table that says it is the shipped prototype's, so that no board need be named."""
    path = tmp_path / "t.chl"
    named = replace(coarse_table[0], board_fingerprint=prototype.fingerprint())
    path.write_bytes(pack(named))
    return path


@pytest.fixture
def port(table: Path) -> Iterator[str]:
    """An emulated device on a pseudo-terminal, in a process of its own."""
    process = subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli.app", "emulate", str(table), "--serial", "--ms",
         "60000"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    yield process.stdout.readline().strip()
    process.terminate()
    process.wait()


def test_flash_into_the_emulator(chladni: CommandLine, table: Path) -> None:
    done = chladni("flash", table, "--emulator", "--json")
    assert done.code == 0
    assert {"bytes", "seconds", "slot", "verified"} <= done.json.keys()
    assert done.json["verified"]
    assert done.json["bytes"] == table.stat().st_size


@pytest.mark.parametrize(
    "arguments",
    [
        ("info",), ("touch", "10,25", "--seconds", "0.2"), ("self-test",), ("config",),
        ("stream", "1@0,0.5@90,0,0,0", "--seconds", "0.3"), ("config", "set", "level_q15=1000"),
    ],
)  # fmt: skip
def test_every_device_command_answers(
    chladni: CommandLine, table: Path, arguments: tuple[str, ...]
) -> None:
    extra = ("--table", table) if arguments[0] in ("info", "touch") else ()
    done = chladni("device", *arguments, "--emulator", *extra, "--json")
    assert done.code == 0, done.err
    if arguments[0] == "self-test":
        # Half amplitude: a quarter of 333 mA and the shortest pulse.
        assert [row["supply_ma"] for row in done.json["channels"]] == pytest.approx([87] * 5, abs=4)
        assert [row["expected_ma"] for row in done.json["channels"]] == [83] * 5
        assert all(row["ok"] for row in done.json["channels"])
        assert done.json["supply_limit_ma"] > 0
    if arguments[-1] == "level_q15=1000":
        assert done.json["level_q15"] == 1000


def test_raw_duties_come_from_a_file(chladni: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "duties.csv"
    t = np.arange(3_000)[:, None] / (78_125 / 8)
    np.savetxt(path, 0.2 + 0.1 * np.sin(2.0 * np.pi * 160.0 * t + np.zeros(5)), delimiter=",")
    there = ("--emulator", "--baud", "921600")
    done = chladni("device", "stream", "--csv", path, *there, "--json")
    assert done.code == 0, done.err
    assert (done.json["frames"], done.json["faults"]) == (3_000, [])
    # At 115,200 baud five channels cannot keep up, and that is said beforehand.
    slow = chladni("device", "stream", "--csv", path, "--emulator")
    assert slow.code == 1
    assert "need a wire of" in slow.err


SCRIPT = """
import numpy as np
def duties(t):
    return 0.2 + 0.1 * np.sin(2.0 * np.pi * 160.0 * t[:, None] + np.zeros({channels})) {more}
"""


def test_a_script_is_streamed_for_as_long_as_asked(chladni: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "wave.py"
    path.write_text(SCRIPT.format(channels=5, more=""))
    done = chladni(
        "device", "stream", "--script", path, "--seconds", "0.25", "--emulator", "--baud",
        "921600", "--json",
    )  # fmt: skip
    assert done.code == 0, done.err
    assert done.json["frames"] == round(0.25 * 78_125 / 8)


@pytest.mark.parametrize(
    ("channels", "more", "words"),
    [(4, "", "5 channels"), (5, "+ 2.0", "duties from 0 to 1"), (5, "/ nothing", "NameError"),
     (5, "\nraise SystemExit", "SystemExit"), (5, "+ exit(0)", "SystemExit"),
     (5, ", 1", "duties(t)"), (5, ")[:3] + (0.0", "channels)")],
)  # fmt: skip
def test_a_script_that_gives_no_duties_is_named(
    chladni: CommandLine, tmp_path: Path, channels: int, more: str, words: str
) -> None:
    path = tmp_path / "wave.py"
    text = SCRIPT.format(channels=channels, more=more)
    path.write_text(text.replace("return", "return (") + ")" if "(" in more else text)
    done = chladni("device", "stream", "--script", path, "--emulator")
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("flash",), 2, "TABLE, --previous"),
        (("flash", "--previous", "--rom", "--port", "/dev/nothing"), 2, "needs a running device"),
        (("flash", "--firmware", "nothing.bin", "--port", "/dev/nothing"), 2, "readable file"),
        (("flash", "--firmware", "README.md", "--port", "/dev/nothing"), 2, "application image"),
        (("flash", "--firmware", "README.md"), 2, "--port"),
        (("flash", "nothing.chl", "--emulator"), 2, "nothing.chl"),
        (("device", "info"), 2, "--port, --udp, --emulator"),
        (("device", "info", "--port", "/dev/nothing"), 1, "no such port"),
        (("device", "touch", "10", "--emulator"), 2, "X,Y"),
        (("device", "touch", "1,1", "--emulator"), 1, "not in this state"),
        (("device", "stream", "1@0", "--emulator"), 2, "5 channels"),
        (("device", "stream", "2@0", "--emulator"), 2, "gain from 0 to 1"),
        (("device", "config", "set", "colour=3", "--emulator"), 2, "colour"),
        (("device", "config", "set", "--emulator"), 2, "NAME=VALUE"),
        (("device", "stream", "--emulator"), 2, "DRIVE, --csv, --script"),
        (("device", "stream", "--script", "nothing.py", "--emulator"), 2, "nothing.py"),
        (("device", "stream", "--script", "README.md", "--emulator"), 2, "SyntaxError in line"),
        (("device", "stream", "--script", "tests/made_up.py", "--emulator"), 2, "duties(t)"),
        (("device", "info", "--udp", "127.0.0.1"), 2, "--key"),
        (("device", "info", "--udp", ":5", "--key", "README.md"), 2, "HOST or HOST:PORT"),
        (("device", "info", "--udp", "h:0", "--key", "README.md"), 2, "HOST or HOST:PORT"),
        (("device", "info", "--udp", "127.0.0.1", "--key", "README.md"), 2, "hexadecimal"),
        (("device", "info", "--udp", "127.0.0.1", "--emulator"), 2, "one of the three"),
        (("device", "info", "--udp", "127.0.0.1:²", "--key", "README.md"), 2, "HOST or HOST:PORT"),
        (("device", "touch", "1e9,0", "--emulator"), 2, "board's centre"),
        (("device", "touch", "0,0", "--seconds", "nan", "--emulator"), 2, "--seconds"),
        (("device", "log", "--seconds", "nan", "--emulator"), 2, "--seconds"),
        (("device", "stream", "1@nan,0,0,0,0", "--emulator"), 2, "DRIVE"),
        (
            (
                "device",
                "network",
                "set",
                "--ssid",
                "\udcff",
                "--key",
                "k",
                "--passphrase-file",
                "README.md",
                "--emulator",
            ),
            2,
            "ssid",
        ),
        (("device", "config", "get", "colour", "--emulator"), 2, "a setting: one of"),
        (("emulate", "nothing.chl"), 2, "nothing.chl"),
        (("device", "log", "--udp", "127.0.0.1"), 2, "over the wire only"),
        (("device", "network", "set", "--emulator"), 2, "--ssid"),
        (("device", "network", "set", "--ssid", "x", "--emulator"), 2, "--key"),
        (("device", "network", "out", "--emulator"), 2, "one of the three"),
        (("device", "network", "off", "--udp", "127.0.0.1"), 2, "over the wire only"),
        (("device", "stream", "--csv", "README.md", "--emulator"), 2, "rows of numbers"),
        (("device", "config", "set", "level_q15=99999", "--emulator"), 2, "level_q15"),
        (("flash", "--previous", "--emulator"), 1, "no other table"),
    ],
)
def test_what_is_wrong_is_said(
    chladni: CommandLine, arguments: tuple[str, ...], code: int, words: str
) -> None:
    done = chladni(*arguments)
    assert done.code == code
    assert words in done.err
    assert "Traceback" not in done.err


@pytest.mark.slow
def test_a_pseudo_terminal_is_met_as_a_device(chladni: CommandLine, port: str, table: Path) -> None:
    """Flash, look, touch, power cycle; then the port is busy for a second program."""
    done = chladni("flash", table, "--port", port, "--json")
    assert done.code == 0, done.err
    assert done.json["verified"]
    shown = chladni("device", "info", "--port", port, "--json")
    assert shown.json["slot"] == 1
    assert chladni("flash", "--previous", "--port", port).code == 0
    assert chladni("device", "touch", "5,5", "--seconds", "0.3", "--port", port).code == 0
    with Device(SerialWire(port)) as device:
        busy = chladni("device", "info", "--port", port)
        assert (busy.code, "busy" in busy.err) == (1, True)
        device.restart()


@pytest.mark.slow
def test_a_program_that_speaks_something_else_is_not_taken_for_a_device(
    chladni: CommandLine,
) -> None:
    master, slave = os.openpty()
    os.write(master, b"login: \r\n" * 3)
    done = chladni("device", "info", "--port", os.ttyname(slave))
    assert done.code == 1
    assert "nobody answers" in done.err
    os.close(master)
    os.close(slave)


@pytest.fixture
def udp_port() -> int:
    """A UDP port that nobody has just now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


@pytest.mark.slow
def test_a_key_set_over_the_wire_opens_the_network(
    chladni: CommandLine, port: str, table: Path, tmp_path: Path, udp_port: int
) -> None:
    """Set, flash and touch over UDP, refuse another key, and close it again."""
    key, passphrase = tmp_path / "own.key", tmp_path / "passphrase"
    passphrase.write_text("a passphrase\n")
    there = ("--udp", f"127.0.0.1:{udp_port}", "--key", key)
    done = chladni(
        "device", "network", "set", "--ssid", "lab", "--key", key, "--passphrase-file", passphrase,
        "--udp-port", str(udp_port), "--port", port, "--json",
    )  # fmt: skip
    assert done.code == 0, done.err
    assert (done.json["state"], done.json["ssid"]) == ("on", "lab")
    assert chladni("flash", table, *there, "--json").json["verified"]
    assert chladni("device", "touch", "5,5", "--seconds", "0.3", *there).code == 0
    other = tmp_path / "other.key"
    other.write_text("ab" * 32)
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


@pytest.mark.slow
def test_a_touch_that_is_interrupted_is_lifted(port: str) -> None:
    """Ctrl-C in the middle: the finger does not stay behind."""
    command = [sys.executable, "-m", "chladni.host.cli.app", "device", "touch", "5,5"]
    process = subprocess.Popen([*command, "--seconds", "30", "--port", port])
    time.sleep(4.0)
    process.send_signal(signal.SIGINT)
    assert process.wait() != 0
    with Device(SerialWire(port)) as device:
        device.link.wait(0.2)
        assert device.info()["state"] == "idle"


@pytest.mark.slow
def test_a_plug_that_is_pulled_ends_a_command_with_a_reason(
    chladni: CommandLine, table: Path
) -> None:
    hello = encode(BY_NAME["hello"].code | RESPONSE, 1, struct.pack("<BBBHH", 0, 1, 1, 3, 1024))
    with Unplugged(hello) as port:
        done = chladni("flash", table, "--port", port)
    assert done.code == 1
    assert port in done.err
    assert "Traceback" not in done.err


@pytest.mark.slow
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
