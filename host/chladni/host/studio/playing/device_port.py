"""A real device at a serial port: what a page can have it do, and what came of it in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from serial.tools import list_ports

from chladni.host.device.checks.info_rows import info_rows
from chladni.host.device.checks.self_test import SELF_TEST_S, try_channel
from chladni.host.device.configure import change_settings
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import USB_VENDORS, SerialWire
from chladni.host.protocol.board_config import board_settings, check_chip
from chladni.host.protocol.settings import SHOWN, parse_setting
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError, MissingError
from chladni.tables.table import Table

Progress = Callable[[int, int], None]
UNSHOWN = ("board_id",)


def ports(known: Sequence[str]) -> list[str]:
    """Ports that a page may choose: those the studio was given, and USB bridges of boards."""
    found = [port.device for port in list_ports.comports() if port.vid in USB_VENDORS]
    return list(dict.fromkeys([*known, *found]))


class DevicePort:
    """One page's real device. Its methods take the time of a serial line: call them in a thread.

    Raises
    ------
    InputError
        A page may not choose this port.
    WireError, LinkError
        It cannot be opened, or no device answers. Each method raises them, too.
    """

    def __init__(self, port: str, known: Sequence[str]) -> None:
        if port not in ports(known):
            expected = "one of: " + (", ".join(ports(known)) or "none")
            raise InputError("port", port, expected, hint="name one by --device")
        self.port = port
        self._device = Device(SerialWire(port))

    def close(self) -> None:
        """Let go of the port."""
        self._device.close()

    def about(self) -> dict[str, Any]:
        """What the device says of itself and its settings, as rows of texts."""
        device = self._device
        version = device.version.fields
        link = {"link": f"{version['major']}.{version['minor']}"}
        info = link | device.info() | {"faults": device.faults()}
        config = device.config()
        return {
            "port": self.port,
            "rows": [[name, str(value)] for name, value in info_rows(info).items()],
            "settings": [
                [own.name, own.text(config[raw], config["channels"])]
                for raw, own in SHOWN.items()
                if raw not in UNSHOWN
            ],
        }

    def hold(self, place_mm: tuple[float, float]) -> None:
        """Put a finger at a place, or move it there."""
        self._device.touch(*place_mm)

    def lift(self) -> None:
        """Take it away."""
        self._device.lift()

    def flash(self, table: Table, progress: Progress) -> str:
        """Write a table; what came of it, in a sentence."""
        done = self._device.flash(table, progress)
        done.check_verified()
        return (
            f"{done.bytes:,} bytes in slot {done.slot} after {done.seconds:.1f} s; the table plays"
        )

    def self_test(self, progress: Progress) -> str:
        """Bring each coil in turn up to half amplitude; what they draw, in a sentence."""
        config = self._device.config()
        count = config["channels"]
        rows = []
        for channel in range(count):
            progress(channel, count)
            rows.append(try_channel(self._device, channel, config, SELF_TEST_S))
        failed = [
            f"channel {row['channel']} draws {row['supply_ma']} mA, not {row['expected_ma']}"
            for row in rows
            if not row["ok"]
        ]
        return "; ".join(failed) or f"all {count} coils draw what they should"

    def set(self, text: str) -> str:
        """Change one setting, NAME=VALUE, and restart."""
        return _in_words(change_settings(self._device, parse_setting(text)))

    def configure(self, board: Board) -> str:
        """Set all that a board file knows, limits and pins included, and restart."""
        if not board.electronics.pwm_pins:
            text = f"board {board.name!r} says no pins to drive"
            raise MissingError("electronics.pwm_pins", text)
        check_chip(self._device.info()["chip"], board)
        return _in_words(change_settings(self._device, board_settings(board)))


def _in_words(changed: Sequence[dict[str, Any]]) -> str:
    rows = [f"{row['name']}: {row['from']} → {row['to']}" for row in changed]
    return "; ".join(rows) or "nothing to change"
