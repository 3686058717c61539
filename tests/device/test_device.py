"""One suite for the emulated device and for a board on the bench.

pytest tests/device                                    the emulated device
pytest tests/device --port /dev/ttyUSB0                a board, whose table is exchanged
pytest tests/device --embedded-services idf,qemu       a linked image in Espressif's QEMU
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.host.device.checks.readiness import check_ready
from chladni.host.device.configure import restart_with
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import SerialWire
from chladni.host.protocol.board_config import config_of
from chladni.host.protocol.link import VERSION_MAJOR
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.tables.format import pack
from chladni.tables.table import Table
from device.chip_in_qemu import PROGRAM, NoChip, chip_in_qemu
from made_up import make_table

pytestmark = pytest.mark.slow
TRIES = 5
USUAL = ("reset", "panel missing", "coil hot", "no table")
"""What a board notes that was just set up or powered, and has no panel."""
MOST_COOLING_S = 20
BUILD = "build"
"""Where `idf.py build` leaves the image; that of PlatformIO is in .pio/build/esp32."""


@pytest.fixture(scope="session")
def board() -> Board:
    """The board of the device under test."""
    return load_board("prototype")


def table_of(board: Board, gain: float) -> Table:
    """A table of one region that says it is the board's."""
    drive = np.full((1, config_of(board)["channels"]), gain, dtype=complex)
    return replace(make_table(drive), board_name=board.name, board_fingerprint=board.fingerprint())


@pytest.fixture(scope="session")
def emulated_port(board: Board, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A pseudo-terminal with the emulated device behind it."""
    path = Path(tmp_path_factory.mktemp("device")) / "first.chl"
    path.write_bytes(pack(table_of(board, 5.0)))
    process = subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli.app", "emulate", str(path), "--serial"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    yield process.stdout.readline().strip()
    process.terminate()
    process.wait()


@pytest.fixture(scope="session")
def another_table(board: Board) -> Table:
    """A table for the device that is not the one it has."""
    return table_of(board, 8.0)


@pytest.fixture
def embedded_services() -> str:
    """What pytest-embedded reaches the device by."""
    return "serial"


@pytest.fixture(scope="session")
def qemu_port(
    board: Board, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[str]:
    """A chip in QEMU, blank at first, that is set up as a new owner would."""
    option = request.config.getoption
    build = Path(option("build_dir") or BUILD)
    chip = chip_in_qemu(
        build,
        tmp_path_factory.mktemp("chip"),
        option("qemu_prog_path") or PROGRAM,
        option("qemu_extra_args") or "",
    )
    with ExitStack() as stack:
        try:
            port = stack.enter_context(chip)
        except NoChip as reason:
            pytest.skip(str(reason))
        with Device(SerialWire(port)) as device:
            restart_with(device, config_of(board).by_wire())
            device.flash(table_of(board, 5.0))
        yield port


@pytest.fixture
def port(request: pytest.FixtureRequest) -> str:
    """`--port`, that of a chip in QEMU, or the emulated device's."""
    services = request.config.getoption("embedded_services") or ""
    other = "qemu_port" if "qemu" in services.split(",") else "emulated_port"
    return str(request.config.getoption("port") or request.getfixturevalue(other))


@pytest.fixture
def slowness(request: pytest.FixtureRequest) -> float:
    """How many times slower than a chip the device runs."""
    return float(request.config.getoption("slowness"))


@contextmanager
def device_of(dut: Any) -> Iterator[Device]:
    """The link on the port that pytest-embedded holds, which stops reading meanwhile."""
    with dut.serial.disable_redirect_thread():
        yield Device(SerialWire.of(dut.serial.proc))


def cooled(device: Device, slowness: float) -> None:
    """A board that was just powered takes its coils for hot: wait, as its user would."""
    for _ in range(round(MOST_COOLING_S * slowness)):
        if "coil hot" not in device.info()["standing"]:
            return
        device.link.wait(1.0)
    check_ready(device.info())


def test_the_console_answers(dut: Any, slowness: float) -> None:
    dut.write("info\n")
    dut.expect_exact("ok", timeout=5.0 * slowness)
    dut.write("nonsense\n")
    dut.expect("expected: touch", timeout=5.0 * slowness)


def test_handshake(dut: Any, board: Board) -> None:
    with device_of(dut) as device:
        assert device.version.fields["major"] == VERSION_MAJOR
        assert device.info()["channels"] == len(board.actuators)


def test_a_table_is_flashed_outlives_a_restart_and_the_one_before_comes_back(
    dut: Any, another_table: Table, slowness: float
) -> None:
    """Two updates: a device from blank flash has five, and one more each minute."""
    with device_of(dut) as device:
        before = device.info()["table_crc"]
        done = device.flash(another_table)
        assert done.verified
        flashed = device.info()["table_crc"]
        device.restart()
        device.link.wait(slowness)
        assert device.info()["table_crc"] == flashed != before
        assert device.previous() != done.slot
        assert device.info()["table_crc"] == before


def test_a_touch_plays_and_ends(dut: Any, slowness: float) -> None:
    with device_of(dut) as device:
        cooled(device, slowness)
        device.touch(0.0, 0.0)
        device.link.wait(0.3 * slowness)
        info = device.info()
        device.lift()
        device.link.wait(0.2 * slowness)
        assert info["state"] == "playing"
        assert device.info()["state"] == "idle"
        assert not [f for f in device.faults() if f["cause"] not in USUAL]


def test_a_live_drive_draws_current(dut: Any, board: Board, slowness: float) -> None:
    with device_of(dut) as device:
        for _ in range(round(8 * slowness)):
            device.live([0.5] + [0.0] * (len(board.actuators) - 1), 160.0)
            device.link.wait(0.04)
        drawn = device.info()["supply_ma"]
        device.stop()
    # Of an amplitude of a quarter upon as much bias.
    assert drawn == pytest.approx(333.0 * (0.25**2 + 0.25**2 / 2.0), rel=0.1)


def test_a_restart_is_survived_and_remembered(dut: Any, slowness: float) -> None:
    with device_of(dut) as device:
        device.restart()
        device.link.wait(slowness)
        assert device.info()["uptime_ms"] < 5_000 * slowness
        assert {"cause": "reset", "detail": 1} in [
            {k: v for k, v in fault.items() if k != "at_ms"} for fault in device.faults()
        ]


def test_a_start_greets_on_the_console(dut: Any, slowness: float) -> None:
    """What the firmware prints before anybody asks; a board's ROM says more before it."""
    with device_of(dut) as device:
        device.restart()
        device.link.wait(slowness)
        assert "idle\r\nok\r\n" in device.log


def test_raw_duties_are_played(dut: Any, board: Board, slowness: float) -> None:
    """One piece, enough for the device to begin, so that the port's rate does not matter."""
    channels = len(board.actuators)
    t = np.arange(120)[:, None] / 9765.625
    duties = 0.2 + 0.1 * np.sin(2.0 * np.pi * 160.0 * t + np.zeros(channels))
    with device_of(dut) as device:
        # A machine that is held up for a tenth of a second has lost its stream, as it should.
        for _ in range(TRIES):
            with suppress(LinkError):
                assert device.stream(duties) == len(duties)
                break
        assert device.info()["state"] == "streaming"
        device.stop()
        device.link.wait(0.2 * slowness)
        assert device.info()["state"] == "idle"
