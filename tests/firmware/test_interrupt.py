"""A sample interrupt that dies, stalls or fires twice: no duty stays where it was."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.tables.table import Limits, Table
from firmware.judged_device import BRIDGES
from made_up import device_of, make_table

LIMITS = Limits(4_000, 60_000, 20_000_000)
CUT_MS = 1.0 + 4.0 + 1.0 + 0.1
"""A turn of the main loop until the last sample is seen, four milliseconds without one, a turn
until that is seen, and a carrier period."""


@pytest.fixture
def table() -> Table:
    return replace(make_table(np.array([[10.0, -5.0j, 1.0 + 1.0j, 4.0, 2.0]])), limits=LIMITS)


def playing(table: Table, late_ms: float = 0.0, **drivers: Any) -> Emulator:
    emulator = Emulator(device_of(table, **drivers), table)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    assert emulator.run(60.0 + late_ms).duty_steps[-1].any()
    return emulator


def on_for_ms(emulator: Emulator, milliseconds: float) -> float:
    recording = emulator.run(milliseconds)
    on = np.flatnonzero(recording.duty_steps.any(axis=1))
    return float(on[-1] + 1) / recording.carrier_hz * 1e3 if on.size else 0.0


def causes(emulator: Emulator) -> list[str]:
    return [cause for cause, _, _ in emulator.core.faults]


@pytest.mark.parametrize("drivers", [{}, BRIDGES], ids=["switches", "bridges"])
def test_a_dead_interrupt_leaves_no_duty_standing(table: Table, drivers: dict[str, Any]) -> None:
    """Wherever in a wave, in a turn of the main loop and between reports of the panel it dies."""
    for moment in range(48):
        emulator = playing(table, 0.31 * moment, **drivers)
        emulator.core.kill_interrupt(True)
        assert 0.0 < on_for_ms(emulator, 60.0) < CUT_MS, moment
        assert causes(emulator) == ["interrupt stopped"]


def test_a_device_whose_interrupt_died_says_so(table: Table) -> None:
    emulator = playing(table)
    emulator.core.kill_interrupt(True)
    emulator.run(2000.0)
    assert emulator.core.state == "fault"
    assert "interrupt stopped" in causes(emulator)
    # The link answers still, and says why.
    emulator.core.command("faults")
    emulator.run(5.0)
    assert any("interrupt stopped" in line for line in emulator.core.printed)


def test_an_interrupt_that_comes_back_finds_its_gates_cut(table: Table) -> None:
    """Stalled for two seconds, then alive: off until the next start, which plays again."""
    emulator = playing(table)
    emulator.core.delay_next_sample(2e6)
    assert on_for_ms(emulator, 3000.0) < CUT_MS
    assert emulator.core.state == "fault"
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, None))
    emulator.run(50.0)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, (0.0, 0.0)))
    assert not emulator.run(100.0).duty_steps.any()
    emulator.core.restart("software")
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, None))
    emulator.run(50.0)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, (0.0, 0.0)))
    assert emulator.run(60.0).duty_steps[-1].any()


@pytest.mark.parametrize("milliseconds", [0.2, 0.4, 3.0])
def test_a_short_stall_is_no_death(table: Table, milliseconds: float) -> None:
    """Beyond 0.5 ms outputs fade, as they did; the gates stay with the timer."""
    emulator = playing(table)
    emulator.core.delay_next_sample(milliseconds * 1e3)
    emulator.run(40.0)
    assert "interrupt stopped" not in causes(emulator)
    assert ("interrupt late" in causes(emulator)) == (milliseconds > 0.5)


def test_an_idle_device_says_that_its_interrupt_is_dead(table: Table) -> None:
    emulator = Emulator(device_of(table), table)
    emulator.run(20.0)
    emulator.core.kill_interrupt(True)
    emulator.run(20.0)
    assert emulator.core.state == "fault"
    assert causes(emulator).count("interrupt stopped") == 1


def test_an_interrupt_that_fires_twice_makes_one_sample(table: Table) -> None:
    """Duties written twice in a carrier period are a fault of the emulator. The wave goes on."""
    plain, repeated = playing(table), playing(table)
    expected, found = [], []
    for _ in range(30):
        repeated.core.repeat_next_sample()
        expected.append(plain.run(1.0).duty_steps)
        found.append(repeated.run(1.0).duty_steps)
    assert np.array_equal(np.concatenate(found), np.concatenate(expected))
    assert causes(repeated) == causes(plain)


def test_after_a_brown_out_a_finger_plays_nothing_until_a_host_has(table: Table) -> None:
    emulator = Emulator(device_of(table), table)
    emulator.core.restart("brown-out")
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 10.0, (0.0, 0.0)))
    assert not emulator.run(100.0).duty_steps.any()
    assert emulator.core.state == "fault"
    assert "brown-out" in causes(emulator)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, None))
    emulator.run(50.0)
    with Device(EmulatorWire(emulator)) as device:
        device.touch(0.0, 0.0)
        assert emulator.run(60.0).duty_steps[-1].any()
        device.lift()
    emulator.run(50.0)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, (0.0, 0.0)))
    assert emulator.run(60.0).duty_steps[-1].any()


def test_a_hung_main_loop_and_a_dead_interrupt_end_in_a_reset(table: Table) -> None:
    """Both at once: the task watchdog, whose panic cuts the outputs."""
    emulator = playing(table)
    emulator.core.kill_interrupt(True)
    emulator.core.hang_main_loop(True)
    recording = emulator.run(6000.0)
    assert not recording.duty_steps[-1].any()
    on = np.flatnonzero(recording.duty_steps.any(axis=1))
    assert (on[-1] + 1) / recording.carrier_hz < 5.01
