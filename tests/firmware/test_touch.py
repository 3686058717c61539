"""Touch panels: what their registers say becomes places on the board, whatever they do wrong."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from chladni.host.emulation import _emulator
from chladni.host.emulation.demodulate import first_change
from chladni.host.emulation.emulator import Emulator, Hardware, TouchEvent, reported_um
from chladni.host.protocol.config import DeviceConfig, pack_config
from chladni.tables.table import Limits, Table
from made_up import device_of, make_table, some_pins, starts_of

Model = Literal["ft6x36", "gt911"]
MODELS: tuple[Model, ...] = ("ft6x36", "gt911")
REPORT_MS = 10.0
LIMITS = Limits(4000, 100_000, 5_000_000)


@pytest.fixture
def table() -> Table:
    """Left half of the board loud on channel 0, right half on channel 1."""
    table = make_table(
        np.array([[10.0, 0.0], [0.0, 10.0]]),
        2,
        1,
        labels=np.array([0, 1], np.uint8),
        crossings=[(0, 0), (0, 0)],
    )
    return replace(table, limits=LIMITS)


def board(
    table: Table, model: Model, hardware: dict[str, Any] | None = None, **changes: Any
) -> Emulator:
    known: dict[str, Any] = {"panel": model, **(hardware or {})}
    return Emulator(device_of(table), table, hardware=Hardware(**known), **changes)


def loud(emulator: Emulator, milliseconds: float) -> list[bool]:
    """Which channels play at the end of a run."""
    recording = emulator.run(milliseconds)
    return [bool(duties.any()) for duties in recording.duty_steps[-2000:].T]


@pytest.mark.parametrize("line", [34, 255])
@pytest.mark.parametrize("model", MODELS)
def test_a_finger_plays_its_place_until_it_lifts(table: Table, model: Model, line: int) -> None:
    emulator = board(table, model, interrupt_pin=line)
    emulator.touch(TouchEvent(20.0, (-20.0, 10.0)))
    emulator.touch(TouchEvent(100.0, (20.0, 10.0)))
    emulator.touch(TouchEvent(200.0, None))
    assert loud(emulator, 90.0) == [True, False]
    assert loud(emulator, 100.0) == [False, True]
    assert loud(emulator, 60.0) == [False, False]
    assert emulator.core.faults == []
    assert emulator.core.panel_health == "panel fine"


@pytest.mark.parametrize("wanted", [0, 1, 2, 3])
def test_panels_are_found_at_either_address_or_not_wanted(table: Table, wanted: int) -> None:
    second = board(table, "gt911", {"has_second_address": True}, panel=wanted)
    second.run(20.0)
    expected = "no panel configured" if wanted == 0 else "panel missing"
    assert second.core.panel_health == ("panel fine" if wanted in (1, 3) else expected)


@given(
    st.integers(16, 4096),
    st.integers(16, 4096),
    st.integers(1_000, 500_000),
    st.integers(1_000, 500_000),
    st.integers(0, 3),
    st.booleans(),
    st.integers(-50_000, 50_000),
    st.integers(-50_000, 50_000),
    st.randoms(use_true_random=False),
)
@example(2286, 2286, 1000, 1000, 0, False, 0, 0, Random(0))
@settings(max_examples=200, deadline=None)
def test_pixels_lie_where_the_mounting_puts_them(
    columns: int,
    rows: int,
    width: int,
    length: int,
    turns: int,
    mirrored: bool,
    x0: int,
    y0: int,
    random: Any,
) -> None:
    """Against complex numbers: a quarter turn is a factor of i, a mirror a change of sign."""
    config = DeviceConfig(
        pwm_pins=some_pins(),
        panel=1,
        panel_columns=columns,
        panel_rows=rows,
        panel_width_um=width,
        panel_length_um=length,
        panel_turns=turns,
        panel_mirrored=int(mirrored),
        panel_x_um=x0,
        panel_y_um=y0,
    )
    # Corners are where an error of the scale shows most.
    for x, y in ((random.randrange(columns), random.randrange(rows)), (0, 0), (columns - 1, 0)):
        place = complex(
            ((x + 0.5) / columns - 0.5) * width * (-1.0 if mirrored else 1.0),
            ((y + 0.5) / rows - 0.5) * length,
        )
        expected = place * 1j**turns + complex(x0, y0)
        # A rounded scale in 1/256 µm per half pixel errs by columns/512 µm, every rounding by 1.
        tolerance = max(columns, rows) / 256.0 + 2.0
        found = complex(*_emulator.panel_place(pack_config(config), x, y))
        assert abs(found - expected) <= tolerance
        # And back: the centre of a pixel is that pixel's.
        back = complex(*reported_um(config, (found.real / 1e3, found.imag / 1e3)))
        assert abs(back - found) <= max(width / columns, length / rows) + 2.0 * tolerance


@pytest.mark.parametrize("model", MODELS)
def test_the_first_finger_owns_the_touch_and_the_next_takes_over(
    table: Table, model: Model
) -> None:
    emulator = board(table, model)
    emulator.touch(TouchEvent(20.0, (-20.0, 0.0), finger=1))
    emulator.touch(TouchEvent(60.0, (20.0, 0.0), finger=2))
    assert loud(emulator, 110.0) == [True, False]
    emulator.touch(TouchEvent(120.0, None, finger=1))
    assert loud(emulator, 70.0) == [False, True]
    emulator.touch(TouchEvent(190.0, None, finger=2))
    assert loud(emulator, 60.0) == [False, False]


@pytest.mark.parametrize("model", MODELS)
def test_a_lift_up_that_is_never_reported_ends_by_timeout(table: Table, model: Model) -> None:
    """FT6x36: its registers go on showing the finger, and are not believed unasked."""
    emulator = board(table, model)
    emulator.touch(TouchEvent(20.0, (-20.0, 0.0)))
    assert loud(emulator, 100.0) == [True, False]
    emulator.core.panel_faults.loses_next_lift = True
    emulator.touch(TouchEvent(101.0, None))
    assert loud(emulator, 200.0) == [False, False]
    assert emulator.core.state == "idle"
    assert [cause for cause, _, _ in emulator.core.faults] == ["touch timeout"]
    emulator.touch(TouchEvent(301.0, (20.0, 0.0)))
    assert loud(emulator, 60.0) == [False, True]


@pytest.mark.parametrize("model", MODELS)
def test_lost_calls_are_made_up_for_while_touched(table: Table, model: Model) -> None:
    """A GT911's flag is news enough; an FT6x36 without its calls is timed out, never stuck."""
    emulator = board(table, model)
    emulator.touch(TouchEvent(20.0, (-20.0, 0.0)))
    emulator.run(60.0)
    emulator.core.panel_faults.loses_calls = True
    assert loud(emulator, 300.0) == [model == "gt911", False]
    emulator.touch(TouchEvent(361.0, None))
    assert loud(emulator, 100.0) == [False, False]


def test_the_ft6x36_is_kept_out_of_its_slow_mode_and_pulses_its_line(table: Table) -> None:
    emulator = board(table, "ft6x36")
    assert emulator.core.panel_register(0x86) == 1
    emulator.run(20.0)
    assert emulator.core.panel_register(0x86) == 0
    assert emulator.core.panel_register(0xA4) == 1


@pytest.mark.parametrize("model", MODELS)
def test_a_reset_panel_is_started_anew(table: Table, model: Model) -> None:
    """It forgets its settings, and answers nothing for a moment."""
    emulator = board(table, model)
    emulator.run(30.0)
    emulator.core.panel_faults.is_wedged = True
    emulator.touch(TouchEvent(31.0, (-20.0, 0.0)))
    assert loud(emulator, 100.0) == [False, False]
    emulator.core.panel_power_cycle()
    emulator.core.panel_faults.is_wedged = False
    assert loud(emulator, 400.0) == [True, False]
    if model == "ft6x36":
        assert emulator.core.panel_register(0x86) == 0


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("pulses", [1, 9, 30])
def test_a_stuck_bus_is_clocked_free(table: Table, model: Model, pulses: int) -> None:
    emulator = board(table, model)
    emulator.touch(TouchEvent(20.0, (-20.0, 0.0)))
    emulator.run(50.0)
    emulator.core.panel_faults.pulses_until_free = pulses
    assert loud(emulator, 900.0) == [True, False]
    assert emulator.core.panel_health == "panel fine"


def test_a_bounce_shorter_than_the_hold_is_no_lift_up(table: Table) -> None:
    for hold_ms, expected in ((0, 2), (40, 1)):
        emulator = board(table, "gt911", lift_hold_ms=hold_ms)
        for at, place in ((20.0, (-20.0, 0.0)), (80.0, None), (100.0, (-20.0, 0.0)), (180.0, None)):
            emulator.touch(TouchEvent(at, place))
        recording = emulator.run(300.0)
        assert len(starts_of(recording)) == expected
        assert not recording.duty_steps[-1].any()


def test_a_touch_may_need_several_reports(table: Table) -> None:
    emulator = board(table, "gt911", press_reports=3)
    emulator.touch(TouchEvent(20.0, (-20.0, 0.0)))
    recording = emulator.run(100.0)
    changed = first_change(recording, 0)
    assert changed is not None
    assert 40.0 <= changed / recording.carrier_hz * 1e3 <= 43.0


@pytest.mark.slow
@pytest.mark.parametrize("jitter_us", [0.0, 20.0])
@pytest.mark.parametrize("model", MODELS)
def test_from_the_panels_call_to_the_first_duty(
    table: Table, model: Model, jitter_us: float
) -> None:
    """0.2 ms beyond the bus and the injected latencies, p99 over 1,000 touches."""
    wake_us, interrupt_us = 20.0, 5.0
    hardware = {"wake_us": wake_us, "interrupt_us": interrupt_us, "jitter_us": jitter_us}
    emulator = board(table, model, hardware)
    rng = np.random.default_rng(8)
    at = 20.0
    for _ in range(1000):
        at += rng.uniform(60.0, 70.0)
        emulator.touch(TouchEvent(at, (rng.uniform(-30.0, 30.0), rng.uniform(-70.0, 70.0))))
        emulator.touch(TouchEvent(at + 25.0, None))
    recording = emulator.run(at + 60.0)
    calls = np.array(emulator.core.calls)
    waits = [
        float(start - calls[calls < start].max()) / recording.carrier_hz
        for start in starts_of(recording)
    ]
    assert len(waits) == 1000
    # Address, register and what is read: 9 bits each at 400 kHz, and start, restart and stop.
    read = {"ft6x36": [(1, 5)], "gt911": [(2, 9), (3, 0)]}[model]
    bits = sum(9 * (1 + w + (1 + r if r else 0)) + (4 if r else 2) for w, r in read)
    injected = bits / 400e3 + (wake_us + interrupt_us + jitter_us) * 1e-6
    assert np.percentile(waits, 99) - injected <= 0.2e-3


@pytest.mark.parametrize("model", MODELS)
def test_end_to_end_stays_below_25_ms(table: Table, model: Model) -> None:
    """From the finger to the first duty, the panel's own period included."""
    emulator = board(table, model)
    for k in range(20):
        emulator.touch(TouchEvent(50.0 + 100.7 * k, (-20.0, 0.0)))
        emulator.touch(TouchEvent(90.0 + 100.7 * k, None))
    recording = emulator.run(2_200.0)
    waits = starts_of(recording) / recording.carrier_hz * 1e3 - (50.0 + 100.7 * np.arange(20))
    assert waits.max() < REPORT_MS + 1.5 < 25.0
