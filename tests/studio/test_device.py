"""A device at a port: the studio presses, writes, tests and configures it, and outlives it."""

from __future__ import annotations

import json
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from websockets.sync.client import ClientConnection

from chladni.host.device.wires.virtual_port import VirtualPort
from chladni.host.emulation.emulator import Emulator
from chladni.host.studio import server
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.sim.board.board import Board
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from studio.conftest import OpenPage, Studio, serving, serving_here
from studio.pages import RULES, press
from studio.wire import PRESS, TIMEOUT_S, opened, told_of


@dataclass
class OwnDevice:
    """An emulated device without a table, at a pseudo-terminal, in a thread of its own."""

    port: VirtualPort
    ends: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.thread = threading.Thread(target=self.port.serve, args=(self.ends.is_set,))
        self.thread.start()

    def vanish(self) -> None:
        """As if its cable were pulled."""
        self.ends.set()
        self.thread.join()
        self.port.close()


@pytest.fixture
def own_device(small_board: Board) -> Iterator[OwnDevice]:
    device = OwnDevice(VirtualPort(Emulator(small_board, None, must_play=False)))
    yield device
    if not device.ends.is_set():
        device.vanish()


@pytest.fixture
def with_device(own_device: OwnDevice, ready: ReadyBoard) -> Iterator[Studio]:
    with serving_here(ready, own_device.port.port) as own:
        yield own


def ask(own: ClientConnection, **message: Any) -> None:
    own.send(json.dumps(message))


def order(own: ClientConnection, what: str, text: str = "") -> dict[str, Any]:
    """The device as it is after an order."""
    ask(own, type="order", what=what, text=text)
    return told_of(own, "device")


@pytest.mark.slow
def test_a_device_is_written_pressed_tested_and_set(
    own_device: OwnDevice, with_device: Studio, small_table: tuple[Table, TableReport]
) -> None:
    core, port = own_device.port.emulator.core, own_device.port.port
    with opened(with_device) as own, opened(with_device) as other:
        ask(own, type="attach", port=port)
        found = told_of(own, "device")
        assert (found["port"], dict(found["rows"])["table"]) == (port, "none")
        # A port has one page, and a page no other port.
        ask(other, type="attach", port=port)
        assert "another program has it" in told_of(other, "device")["said"]
        ask(other, type="attach", port="/dev/null")
        assert "port: expected one of" in told_of(other, "device")["said"]
        written = order(own, "flash")
        assert "the table plays" in written["said"], written["said"]
        data = pack(small_table[0])
        assert data in core.flash_bytes()
        assert f"{len(data):,} bytes" in dict(written["rows"])["table"]
        ask(own, **PRESS)
        assert told_of(own, "played")["state"] == "playing"  # of the emulated one
        assert dict(order(own, "about")["rows"])["state"] == "playing"
        ask(own, type="lift", number=2, finger=0)
        told_of(own, "lifted")
        assert dict(order(own, "about")["rows"])["state"] != "playing"
        changed = order(own, "set", "level=0.5")
        assert changed["said"] == "level: 0.8 → 0.5"
        assert dict(changed["settings"])["level"] == "0.5"
        assert "level" in order(own, "set", "level=7")["said"]
        assert dict(order(own, "about")["settings"])["level"] == "0.5"
        order(own, "set", "max_duty=0.5")
        assert "max_duty: 0.5 → 1" in order(own, "configure")["said"]
        ask(own, type="attach", port=None)
        assert told_of(own, "device")["port"] is None
        ask(other, type="attach", port=port)
        assert told_of(other, "device")["port"] == port


@pytest.mark.slow
def test_a_port_that_vanishes_is_said_and_the_page_plays_on(
    open_page: OpenPage, own_device: OwnDevice, with_device: Studio, small_board: Board
) -> None:
    page = open_page(with_device.url)
    page.get_by_text("Device at a port").click()
    page.get_by_role("button", name="Attach").click()
    page.get_by_role("row", name="table none").wait_for()
    page.get_by_role("button", name="Self-test").click()
    page.get_by_text("all 5 coils draw what they should").wait_for()
    found = Axe().run(page, options=RULES)
    assert found.response["violations"] == [], found.generate_report()
    own_device.vanish()
    page.get_by_role("button", name="Ask again").click()
    page.get_by_role("button", name="Attach").wait_for()
    assert page.locator('[data-part="deviceSaid"]').inner_text() not in ("", "At work.")
    press(page, small_board, (10.0, 25.0))


@pytest.mark.parametrize("way", ["closed", "torn", "mute", "let go"])
def test_a_finger_is_lifted_when_its_page_goes(
    ready: ReadyBoard,
    small_board: Board,
    small_table: tuple[Table, TableReport],
    monkeypatch: pytest.MonkeyPatch,
    way: str,
) -> None:
    if way == "mute":
        monkeypatch.setattr(server, "PING_S", 0.2)
        monkeypatch.setattr(server, "PONG_S", 0.5)
    device = OwnDevice(VirtualPort(Emulator(small_board, small_table[0])))
    core, port = device.port.emulator.core, device.port.port
    try:
        with serving_here(ready, port) as studio, opened(studio) as own:
            ask(own, type="attach", port=port)
            told_of(own, "device")
            ask(own, **PRESS)
            told_of(own, "played")
            assert wait_for(core, "playing")
            if way == "let go":
                ask(own, type="attach", port=None)
                assert told_of(own, "device")["port"] is None
            elif way == "torn":
                own.socket.close()
            elif way == "mute":  # as if its network went away
                monkeypatch.setattr(own.protocol, "recv_frame", lambda _: None)
            else:
                own.close()
            assert wait_for(core, "idle")
            # Lifted, that is, and not given up by the device.
            assert core.faults == []
    finally:
        device.vanish()


def wait_for(core: Any, state: str) -> bool:
    """Whether a device comes to a state."""
    deadline = time.monotonic() + TIMEOUT_S
    while core.state != state and time.monotonic() < deadline:
        time.sleep(0.01)
    return bool(core.state == state)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_a_finger_is_lifted_when_the_studio_ends(
    small_file: Path,
    small_board: Board,
    small_table: tuple[Table, TableReport],
    number: signal.Signals,
) -> None:
    device = OwnDevice(VirtualPort(Emulator(small_board, small_table[0])))
    core, port = device.port.emulator.core, device.port.port
    try:
        with serving(small_file, "--port", "0", "--device", port) as studio, opened(studio) as own:
            ask(own, type="attach", port=port)
            told_of(own, "device")
            ask(own, **PRESS)
            told_of(own, "played")
            assert wait_for(core, "playing")
            studio.process.send_signal(number)
            assert wait_for(core, "idle")
            assert [cause for cause, _, _ in core.faults] == (
                ["host silent"] if number == signal.SIGKILL else []
            )
    finally:
        device.vanish()
