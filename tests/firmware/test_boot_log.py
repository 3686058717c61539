"""Starts that do not last: a row leaves outputs off, and after a crash no network starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.host.protocol.network import NetworkSettings
from chladni.tables.table import Limits, Table
from made_up import device_of, make_table

IN_A_ROW = 4
"""Short starts before the one that stays quiet."""


@pytest.fixture
def emulator() -> Emulator:
    limits = Limits(4_000, 60_000, 20_000_000)
    table: Table = replace(make_table(np.array([[10.0, 1.0, 2.0, 3.0, 4.0]])), limits=limits)
    return Emulator(device_of(table), table)


def plays(emulator: Emulator) -> bool:
    """Whether a finger that lifts and comes back is felt."""
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, None))
    emulator.run(80.0)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, (0.0, 0.0)))
    return bool(emulator.run(60.0).duty_steps[-1].any())


def causes(emulator: Emulator) -> list[str]:
    return [cause for cause, _, _ in emulator.core.faults]


def test_a_row_of_short_starts_leaves_outputs_off_until_a_host_plays(emulator: Emulator) -> None:
    for _ in range(IN_A_ROW - 1):
        emulator.core.restart("power on")
        assert plays(emulator)
    emulator.core.restart("power on")
    assert not plays(emulator)
    assert "short starts in a row" in causes(emulator)
    with Device(EmulatorWire(emulator)) as device:
        device.touch(0.0, 0.0)
        assert emulator.run(60.0).duty_steps[-1].any()
        device.lift()
    assert plays(emulator)


def test_a_start_that_lasts_ends_the_row(emulator: Emulator) -> None:
    for _ in range(3):
        for _ in range(IN_A_ROW - 2):
            emulator.core.restart("power on")
        emulator.core.restart("power on")
        emulator.run(10_200.0)
    assert plays(emulator)
    assert causes(emulator) == []
    marks = emulator.core.flash_bytes("boots").rstrip(b"\xff")
    assert set(marks) == {0x0F, 0x00}
    assert len(marks) == 1 + 3 * (IN_A_ROW - 1)


def test_a_restart_that_was_asked_for_is_no_part_of_a_row(emulator: Emulator) -> None:
    with Device(EmulatorWire(emulator)) as device:
        for _ in range(2 * IN_A_ROW):
            device.restart()
            emulator.run(500.0)
    assert "short starts in a row" not in causes(emulator)
    assert plays(emulator)


@pytest.mark.parametrize("cause", ["panic", "watchdog"])
def test_crashes_count_as_starts_that_did_not_last(emulator: Emulator, cause: str) -> None:
    for _ in range(IN_A_ROW - 1):
        emulator.core.restart(cause)
        assert plays(emulator)
    emulator.core.restart(cause)
    assert not plays(emulator)
    with Device(EmulatorWire(emulator)) as device:
        assert "short starts in a row" in device.info()["standing"]


@pytest.mark.parametrize(
    ("cause", "is_on"),
    [
        ("power on", True),
        ("software", True),
        ("other", True),
        ("panic", False),
        ("watchdog", False),
        ("brown-out", False),
    ],
)
def test_after_a_crash_the_network_stays_off_and_the_wire_says_so(cause: str, is_on: bool) -> None:
    table = make_table(np.array([[10.0, 1.0, 2.0, 3.0, 4.0]]))
    settings = NetworkSettings("net", "12345678", bytes(range(32)), 5555)
    emulator = Emulator(device_of(table), table, network=settings)
    emulator.core.restart(cause)
    with Device(EmulatorWire(emulator)) as device:
        assert (emulator.core.network_port == 5555) is is_on
        assert ("network held back" in device.info()["standing"]) is not is_on
    # A start that someone asked for tries it again.
    with Device(EmulatorWire(emulator)) as device:
        device.restart()
        emulator.run(500.0)
        assert "network held back" not in device.info()["standing"]
    assert emulator.core.network_port == 5555


def test_a_row_of_power_losses_leaves_the_radio_off(emulator: Emulator) -> None:
    table = make_table(np.array([[10.0, 1.0, 2.0, 3.0, 4.0]]))
    settings = NetworkSettings("net", "12345678", bytes(range(32)), 5555)
    emulator = Emulator(device_of(table), table, network=settings)
    for _ in range(IN_A_ROW):
        emulator.core.restart("power on")
    assert emulator.core.network_port == 0


def test_crashes_of_starts_that_lasted_are_a_row_of_their_own(emulator: Emulator) -> None:
    """Each lasts longer than a start that counts as short, as under a finger that crashes it."""
    for crashes in range(1, IN_A_ROW + 1):
        emulator.run(11_000.0)
        emulator.core.restart("panic")
        assert ("short starts in a row" in causes(emulator)) == (crashes == IN_A_ROW)
    assert not plays(emulator)
    with Device(EmulatorWire(emulator)) as device:
        device.restart()
        emulator.run(500.0)
        assert "short starts in a row" not in device.info()["standing"]
    assert plays(emulator)


def test_crashes_are_forgotten_after_a_good_while(emulator: Emulator) -> None:
    for _ in range(IN_A_ROW - 1):
        emulator.core.restart("panic")
        emulator.run(11_000.0)
    emulator.run(600_000.0)
    emulator.core.restart("panic")
    assert "short starts in a row" not in causes(emulator)
    assert plays(emulator)


def test_a_full_sector_is_begun_again(emulator: Emulator) -> None:
    emulator.core.erase_sector(0, "boots")
    emulator.core.program(0, b"\x00" * 4096, "boots")
    emulator.core.restart("power on")
    assert emulator.core.flash_bytes("boots").rstrip(b"\xff") == b"\x0f"
    assert plays(emulator)


@pytest.mark.parametrize("torn", [0x7F, 0x1F, 0xEF])
def test_a_torn_mark_counts_as_a_start_that_did_not_last(emulator: Emulator, torn: int) -> None:
    emulator.core.erase_sector(0, "boots")
    emulator.core.program(0, bytes([0x0F, torn, 0x0F, torn]), "boots")
    emulator.core.restart("power on")
    assert not plays(emulator)
    assert "short starts in a row" in causes(emulator)
