"""Every fault: outputs go off in time, the cause can be read, and the next touch works."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chladni.host.emulation.emulator import Emulator, Hardware, TouchEvent
from chladni.host.protocol.config import DeviceConfig, pack_config
from chladni.tables.format import pack
from chladni.tables.table import Limits, Table
from firmware.judged_device import BRIDGES
from made_up import device_of, make_table
from thermal import Coils

RAMP_MS, TIMEOUT_MS, REPORT_MS = 4.0, 60.0, 10.0
LIMITS = Limits(4_000, 60_000, 20_000_000)


DRIVERS: dict[str, Any] = {}
"""Settings of the device under test: each fault ends both kinds of drive."""


@pytest.fixture(autouse=True, params=[{}, BRIDGES], ids=["switches", "bridges"])
def _drivers(request: pytest.FixtureRequest) -> Iterator[None]:
    DRIVERS.update(request.param)
    yield
    DRIVERS.clear()


OF_SWITCHES = pytest.mark.parametrize("_drivers", [{}], indirect=True)
"""Reckoned with a bias; what bridges draw and heat is judged in test_limits_walk.py."""


def device_with(table: Table) -> DeviceConfig:
    return device_of(table, **DRIVERS)


@pytest.fixture
def table() -> Table:
    return replace(make_table(np.array([[10.0, -5.0j, 1.0 + 1.0j, 4.0, 2.0]])), limits=LIMITS)


def playing(table: Table, **options: Any) -> Emulator:
    """A device with a finger on it since 20 ms, 60 ms after power-on."""
    emulator = Emulator(device_with(table), table, **options)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    recording = emulator.run(60.0)
    assert recording.duty_steps[-1].any()
    return emulator


def silent_after_ms(emulator: Emulator, milliseconds: float) -> float:
    """How long outputs stay on in the next milliseconds."""
    recording = emulator.run(milliseconds)
    on = np.flatnonzero(recording.duty_steps.any(axis=1))
    return float(on[-1] + 1) / recording.carrier_hz * 1e3 if on.size else 0.0


def causes(emulator: Emulator) -> list[str]:
    return [cause for cause, _, _ in emulator.core.faults]


def check_next_touch(emulator: Emulator) -> None:
    """Lift, touch again: it plays."""
    now_ms = emulator.core.now_us / 1e3
    emulator.touch(TouchEvent(now_ms + 1.0, None))
    emulator.run(100.0)
    assert emulator.core.state == "idle"
    emulator.touch(TouchEvent(now_ms + 110.0, (0.0, 0.0)))
    assert emulator.run(60.0).duty_steps[-1].any()
    assert emulator.core.state == "playing"


def test_the_panel_is_absent_and_then_fitted(table: Table) -> None:
    emulator = Emulator(device_with(table), table)
    emulator.core.panel_faults.is_absent = True
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    assert silent_after_ms(emulator, 500.0) == 0.0
    assert causes(emulator) == ["panel missing"]
    assert emulator.core.panel_health == "panel missing"
    emulator.core.panel_faults.is_absent = False
    emulator.run(300.0)
    check_next_touch(emulator)


def test_the_panel_wedges_under_a_finger(table: Table) -> None:
    emulator = playing(table)
    emulator.core.panel_faults.is_wedged = True
    assert silent_after_ms(emulator, 400.0) <= TIMEOUT_MS + RAMP_MS + 1.0
    assert {"panel fails", "touch timeout"} <= set(causes(emulator))
    emulator.core.panel_faults.is_wedged = False
    emulator.run(300.0)
    check_next_touch(emulator)


def test_the_panel_reports_places_off_its_pixels(table: Table) -> None:
    emulator = playing(table)
    emulator.core.panel_faults.is_off_range = True
    assert silent_after_ms(emulator, 400.0) <= REPORT_MS + RAMP_MS + 3.0
    assert causes(emulator) == ["panel out of range"]
    emulator.core.panel_faults.is_off_range = False
    check_next_touch(emulator)


def test_there_is_no_table_and_then_one(table: Table) -> None:
    emulator = Emulator(device_with(table), None, must_play=False)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    assert silent_after_ms(emulator, 100.0) == 0.0
    assert (emulator.core.state, causes(emulator)) == ("fault", ["no table"])
    assert emulator.core.update_begin()
    assert emulator.core.state == "updating"
    emulator.core.program(0, pack(table))
    emulator.core.update_end()
    assert emulator.core.state == "idle"
    check_next_touch(emulator)


def test_the_table_is_corrupt_or_for_other_channels(table: Table) -> None:
    bad = bytearray(pack(table))
    bad[90] ^= 1
    for data, channels, why in (
        (bytes(bad), 5, "damaged"),
        (pack(table), 3, "another number of actuators"),
    ):
        device = device_of(channels=channels)
        emulator = Emulator(device, data, must_play=False)
        emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
        assert silent_after_ms(emulator, 100.0) == 0.0
        assert (emulator.core.state, causes(emulator)) == ("fault", ["table refused"])
        assert why in emulator.core.table_status


def test_an_interrupt_comes_two_milliseconds_late(table: Table) -> None:
    """Shorter delays cost samples, are counted, and keep the wave's time."""
    emulator = playing(table)
    emulator.core.delay_next_sample(400.0)
    assert emulator.run(50.0).duty_steps[-1].any()
    assert 6 <= emulator.core.missed_samples <= 8
    emulator.core.delay_next_sample(2_000.0)
    assert silent_after_ms(emulator, 100.0) <= 2.0 + RAMP_MS + 1.0
    assert causes(emulator) == ["interrupt late"]
    assert emulator.core.state == "fault"
    check_next_touch(emulator)


@OF_SWITCHES
def test_missed_samples_do_not_slow_the_wave(table: Table) -> None:
    late, exact = playing(table), playing(table)
    late.core.delay_next_sample(400.0)
    first, second = (emulator.run(100.0).duty_steps[-4000:] for emulator in (late, exact))
    # The same phase but for the shaper's noise.
    assert np.abs(first.astype(int) - second).max() <= 5


def test_flash_is_only_written_once_outputs_are_off(table: Table) -> None:
    emulator = playing(table)
    assert not emulator.core.update_begin()
    assert emulator.core.state == "updating"
    assert silent_after_ms(emulator, 50.0) <= RAMP_MS + 1.5
    assert emulator.core.update_begin()
    emulator.core.update_end()
    assert emulator.core.state == "idle"
    check_next_touch(emulator)


def test_an_erase_takes_its_time_and_outputs_go_off_by_their_deadline(table: Table) -> None:
    """A configuration saved while a finger plays stalls the main loop, not the interrupt."""
    emulator = playing(table, hardware=Hardware(erase_us=300_000.0))
    before = emulator.core.now_us
    assert emulator.core.save_config(pack_config(device_with(table))) == "ok"
    assert emulator.core.now_us - before >= 300_000
    recording = emulator.core.take_duties()
    on_ms = np.flatnonzero(recording.any(axis=1))[-1] / 78_125.0 * 1e3
    assert TIMEOUT_MS - REPORT_MS - 1.0 <= on_ms <= TIMEOUT_MS + RAMP_MS + 1.0
    emulator.run(30.0)
    assert causes(emulator) == ["touch timeout"]
    check_next_touch(emulator)


@pytest.mark.parametrize("cause", ["watchdog", "panic"])
def test_a_reset_in_mid_play(table: Table, cause: str) -> None:
    """Pins are low from the reset on; the next start knows why, and how warm the coils were."""
    device = device_with(table).with_values(full_rise_dk=(1000,) * 5 + (0,) * 11)
    emulator = Emulator(device, table)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    emulator.run(300.0)
    before = max(emulator.core.coil_rise_k)
    assert before > 0.0
    emulator.core.restart(cause)
    assert silent_after_ms(emulator, 1.0) == 0.0
    assert causes(emulator) == ["reset"]
    assert max(emulator.core.coil_rise_k) > before
    check_next_touch(emulator)


def test_the_watchdog_ends_a_main_loop_that_hangs(table: Table) -> None:
    emulator = playing(table, hardware=Hardware(watchdog_us=1e6))
    emulator.core.hang_main_loop(True)
    assert silent_after_ms(emulator, 500.0) <= TIMEOUT_MS + RAMP_MS + 1.0
    assert causes(emulator) == []  # no main loop runs to take note
    emulator.run(1_000.0)
    assert causes(emulator) == ["reset"]
    check_next_touch(emulator)


@OF_SWITCHES
def test_a_coil_that_gets_too_hot_ends_the_touch_until_it_has_cooled(table: Table) -> None:
    """Against the exact exponential: mean square 0.375 of a duty of 1, near full amplitude."""
    heating_s, full_k, limit_k = 2.0, 100.0, 20.0
    device = device_with(table).with_values(
        full_rise_dk=(round(full_k * 10),) * 5 + (0,) * 11,
        limit_rise_dk=round(limit_k * 10),
        heating_ds=round(heating_s * 10),
    )
    emulator = Emulator(device, table, level=1.0)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    on_s = silent_after_ms(emulator, 5_000.0) / 1e3
    duty = 0.5
    square = duty**2 + duty**2 / 2.0
    # It ends early enough that a main loop which hangs just then takes no coil beyond the limit.
    reaction_s = (TIMEOUT_MS + RAMP_MS + 1.0 + 2 * 64.0) / 1e3
    hot_k = limit_k - full_k * reaction_s / heating_s
    expected = -heating_s * np.log(1.0 - hot_k / (full_k * square))
    # A window of 64 ms, a ramp, the report; and straight steps of 1/31 heat a little faster.
    assert on_s == pytest.approx(expected, rel=0.04, abs=0.1)
    assert [c for c in causes(emulator) if c == "coil hot"] == ["coil hot"]
    assert emulator.core.state == "fault"
    assert emulator.core.coil_rise_k[0] < limit_k
    emulator.run(5_000.0)
    check_next_touch(emulator)


def test_a_long_decay_is_counted_as_heat(table: Table) -> None:
    """Ten seconds, the longest there is: while it goes down a coil gets less and less."""
    device = device_with(table).with_values(
        full_rise_dk=(1000,) * 5 + (0,) * 11,
        limit_rise_dk=3000,
        heating_ds=20,
        decay_ms=10_000,
        sustain_q15=0,
    )
    emulator = Emulator(device, table, level=1.0)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    coils = Coils(device)
    coils.take(recording := emulator.run(3_000.0))
    assert recording.duty_steps[-1].any()
    # Steps of a window are straight: 64 ms of 2 s too much at most.
    assert coils.rise_k[0] < emulator.core.coil_rise_k[0] < coils.rise_k[0] * 1.04 + 0.2
    assert not emulator.run(8_000.0).duty_steps[-800:, 0].max() > 4


@OF_SWITCHES
def test_a_ceiling_that_leaves_no_room_is_silence(table: Table) -> None:
    """5 % of duty are 51 steps, and the shortest pulse takes 50 of them."""
    device = device_with(table).with_values(max_duty_q15=1638, min_on_ns=625)
    emulator = Emulator(device, table, level=1.0)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    assert not emulator.run(200.0).duty_steps.any()
    assert emulator.core.limited_drives == 1


def test_more_faults_than_are_kept_leave_the_newest(table: Table) -> None:
    emulator = playing(table)
    for _ in range(20):
        emulator.core.panel_faults.is_silent = True
        emulator.run(100.0)
        emulator.core.panel_faults.is_silent = False
        emulator.run(60.0)
    kept = emulator.core.faults
    assert len(kept) == 16
    assert [at for _, _, at in kept] == sorted(at for _, _, at in kept)
    assert kept[-1][2] > 3_000
    emulator.core.command("faults")
    assert emulator.core.printed[-1].endswith(f"touch timeout ({kept[-1][1]})")
    assert emulator.core.printed[-1].startswith(f"{kept[-1][2] / 1e3:.3f} s")
