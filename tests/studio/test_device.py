"""A device at a port: the studio presses, writes, tests and configures it, and outlives it."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from websockets.sync.client import ClientConnection

from chladni.host.device.virtual_port import VirtualPort
from chladni.host.emulation.emulator import Emulator
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.sim.board.board import Board
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from studio.conftest import OpenPage, Studio, serving_here
from studio.pages import RULES, press
from studio.wire import PRESS, opened, told_of


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
