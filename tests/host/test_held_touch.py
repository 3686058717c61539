"""A touch that a host holds: it lasts while the host does, and is lifted on every way out."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.udp import EmulatedPort, UdpWire
from chladni.host.device.wires.virtual_port import VirtualPort
from chladni.host.device.wires.wire import EmulatorWire, SerialWire
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.link import TOUCH_SILENCE_MS
from chladni.host.protocol.network import NetworkSettings
from chladni.tables.table import Limits, Table
from conftest import CommandLine
from made_up import device_of, make_table

RAMP_MS = 4.0
KEY = bytes(range(32))
REQUEST_MS = 20.0
"""Of a request and its answer on the wire, at least."""


@pytest.fixture(scope="module")
def table() -> Table:
    limits = Limits(int(RAMP_MS * 1e3), 60_000, 20_000_000)
    return replace(make_table(np.array([[10.0, -5.0j, 1.0 + 1.0j, 4.0, 2.0]])), limits=limits)


@pytest.fixture
def emulator(table: Table) -> Emulator:
    network = NetworkSettings("own", "", KEY, 1234)
    own = Emulator(device_of(table), table, network=network)
    own.run(50.0)
    return own


def causes(emulator: Emulator) -> list[str]:
    return [cause for cause, _, _ in emulator.core.faults]


def test_the_touch_of_a_host_that_says_nothing_ends_within_a_second(emulator: Emulator) -> None:
    device = Device(EmulatorWire(emulator))
    device.touch(0.0, 0.0)
    emulator.core.take_duties()
    recording = emulator.run(1000.0)
    on = np.flatnonzero(recording.duty_steps.any(axis=1))
    off_ms = float(on[-1] + 1) / recording.carrier_hz * 1e3
    assert TOUCH_SILENCE_MS - REQUEST_MS <= off_ms <= TOUCH_SILENCE_MS + RAMP_MS + 2.0
    assert (emulator.core.state, causes(emulator)) == ("idle", ["host silent"])
    device.touch(0.0, 0.0)
    assert emulator.run(100.0).duty_steps[-1].any()


def test_any_request_of_its_host_keeps_a_touch_and_none_of_another(emulator: Emulator) -> None:
    own, other = Device(EmulatorWire(emulator)), Device(UdpWire(EmulatedPort(emulator), KEY))
    own.touch(0.0, 0.0)
    for _ in range(15):
        emulator.run(100.0)
        own.faults()
    assert emulator.core.state == "playing"
    for _ in range(9):
        emulator.run(100.0)
        other.info()
    assert (emulator.core.state, causes(emulator)) == ("idle", ["host silent"])


def test_a_touch_that_is_typed_at_the_console_stays(emulator: Emulator) -> None:
    emulator.core.command("touch 0 0")
    assert emulator.run(2.0 * TOUCH_SILENCE_MS).duty_steps[-1].any()
    assert causes(emulator) == []


def test_a_touch_lasts_as_long_as_its_program_waits(emulator: Emulator) -> None:
    with Device(EmulatorWire(emulator)) as device:
        device.touch(0.0, 0.0)
        device.link.wait(3.0)
        assert device.info()["state"] == "playing"
        assert device.lift() >= 3.0
    assert causes(emulator) == []


def test_a_touch_lasts_while_its_program_sleeps_and_is_lifted_with_the_wire(
    emulator: Emulator,
) -> None:
    """In real time, as on a chip; the wait is the shortest that a silent host would not outlast."""
    port, ends = VirtualPort(emulator), threading.Event()
    served = threading.Thread(target=port.serve, args=(ends.is_set,))
    served.start()
    try:
        with Device(SerialWire(port.port)) as device:
            device.touch(0.0, 0.0)
            time.sleep(1.5 * TOUCH_SILENCE_MS / 1e3)
            assert device.info()["state"] == "playing"
        with Device(SerialWire(port.port)) as device:
            assert device.info()["state"] == "idle"
            assert device.faults() == []
    finally:
        ends.set()
        served.join()
        port.close()


@pytest.mark.parametrize("ends", [KeyboardInterrupt, SystemExit, ValueError])
def test_what_ends_a_program_lifts_its_finger(
    emulator: Emulator, ends: type[BaseException]
) -> None:
    states = []

    def play() -> None:
        with Device(EmulatorWire(emulator)) as device:
            device.touch(0.0, 0.0)
            device.link.wait(0.1)
            states.append(emulator.core.state)
            raise ends

    with pytest.raises(ends):
        play()
    assert [*states, emulator.core.state] == ["playing", "idle"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_a_command_as_an_error_does(number: signal.Signals) -> None:
    script = f"""
import os
from chladni.host.cli.app import as_process
def work():
    try:
        os.kill(os.getpid(), {int(number)})
        return 0
    finally:
        print("lifted")
as_process(["json"], work)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "lifted\n", "")


def test_the_command_plays_for_as_long_as_it_is_told(
    chladni: CommandLine, table_file: Path
) -> None:
    answer = chladni(
        "device", "touch", "0,0", "--seconds", "2.5", "--emulator", "--table", table_file
    )
    assert answer.code == 0, answer.err
    assert "played for" in answer.out
