"""Limits at the ends of what may be configured, and against a host that means harm."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.sim.board.electronics import NOT_WIRED
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.tables.table import Limits
from firmware.judged_device import PINS, JudgedDevice, hot_board, loud_table

COOL = {"limit_rise_dk": 3000, "full_rise_dk": (10,) * 5 + (0,) * 11}
"""Coils that hardly warm up: the supply alone limits."""


MORE_PINS = (5, 12, 15, 17, 18, 19, 23, 25, 26, 27, 32)


def of_channels(count: int) -> dict[str, object]:
    rest = (0,) * (16 - count)
    return {
        "channels": count,
        "pwm_pins": (*PINS, *MORE_PINS)[:count] + (NOT_WIRED,) * (16 - count),
        "full_rise_dk": (10_000,) * count + rest,
        "full_current_ma": (333,) * count + rest,
    }


def test_a_coil_whose_full_rise_is_beyond_2000_k_keeps_its_limit() -> None:
    """6553 K at full duty within 150 s: 154 K of 60, when such a rise counted as 2000."""
    config = hot_board(full_rise_dk=(65_535,) * 5 + (0,) * 11, heating_ds=1500, supply_ma=20_000)
    bench = JudgedDevice(config)
    bench.core.stream_begin()
    bench.run(5.0)
    bench.push(1.0, 300)
    for _ in range(300):
        bench.run(10.0)
        if bench.core.state != "streaming":
            break
        bench.push(1.0, 100)
    assert bench.judge.most_k > 20.0
    bench.assert_kept()


def test_a_gpio_that_is_first_used_under_a_lower_limit_is_not_that_cool() -> None:
    """85 K of 60: it may have been as hot as the limit that held when the power came."""
    first = hot_board(supply_ma=20_000, heating_ds=300, **of_channels(4))
    bench = JudgedDevice(first, is_rested=False)
    bench.run(20.0)
    bench.configure(limit_rise_dk=100, **of_channels(5))
    bench.run(2.0)
    bench.configure(limit_rise_dk=600)
    bench.run(9_000.0)
    for _ in range(100):
        bench.live([0.0, 0.0, 0.0, 0.0, 1.0], 160.0, "square")
        bench.run(20.0)
    bench.assert_kept()


def test_the_end_of_a_stream_holds_no_frame_for_a_release() -> None:
    """865 mA of 500: the last frame was held while outputs went off within a second."""
    table = loud_table(Limits(40_000, 100_000, 10_000_000))
    bench = JudgedDevice(hot_board(release_ms=1000, **COOL), table)
    bench.core.stream_begin()
    bench.run(5.0)
    bench.push(0.0, 500)
    bench.run(45.0)
    while bench.core.stream_filled > 20:
        bench.run(0.5)
    bench.push(1.0, 10)
    while bench.core.stream_filled > 5:
        bench.run(0.5)
    bench.core.stream_end()
    bench.run(200.0)
    bench.assert_kept()


def test_what_came_in_a_long_turn_counts_as_come_at_its_end() -> None:
    """781 mA of 500: a burst at the end of a hang was spread over all of it. 0.41 ms a frame."""
    table = loud_table(Limits(500, 400_000, 10_000_000))
    bench = JudgedDevice(hot_board(pwm_bits=12, **COOL), table)
    frame_ms = 0.4096
    bench.core.stream_begin()
    bench.run(5.0)
    zeros, loud, again = bench.push(0.0, 428), 0, 0
    while loud < 54 and bench.push(0.9, 1):
        loud += 1
    bench.run(1.1)
    bench.core.hang_main_loop(True)
    bench.run((zeros + loud) * frame_ms - 3.0)
    bench.core.hang_main_loop(False)
    bench.run(1.1)
    while bench.core.state == "streaming" and again * frame_ms <= 14.0 and bench.push(0.9, 1):
        again += 1
    bench.run(100.0)
    assert loud > 0
    bench.assert_kept()


def off_after_ms(bench: JudgedDevice, milliseconds: float) -> float:
    duties = bench.emulator.run(milliseconds).duty_steps.any(axis=1)
    return float(np.flatnonzero(duties)[-1]) / 78.125 if duties.any() else 0.0


def test_an_end_does_not_wait_for_a_touch_that_waits() -> None:
    """A touch of another wave waits for a release to end, and what ends all outputs waited too."""
    bench = JudgedDevice(hot_board(release_ms=1000))
    bench.core.command("touch 0 0")
    bench.run(100.0)
    bench.host(True).set_waveform("square")
    bench.core.command("lift")
    bench.run(2.0)
    bench.core.command("touch 0 0")
    bench.run(5.0)
    bench.core.update_begin()
    assert off_after_ms(bench, 1_500.0) < 10.0


@pytest.mark.parametrize("end", ["host", "panel", "late"])
def test_an_end_that_no_one_asked_for_takes_no_release(end: str) -> None:
    """A second of release besides: 1,788 ms for a host that fell silent."""
    bench = JudgedDevice(hot_board(release_ms=1000))
    if end == "host":
        bench.host(True).touch(0.0, 0.0)
        promised_ms = 850.0
    else:
        bench.touch()
        promised_ms = 130.0
        bench.run(60.0)
    if end == "panel":
        bench.core.panel_faults.is_silent = True
        bench.core.panel_faults.is_absent = True
    if end == "late":
        bench.touch(is_down=False)
        bench.run(30.0)
        bench.core.delay_next_sample(2_000.0)
        promised_ms = 10.0
    assert off_after_ms(bench, 2_500.0) < promised_ms


@pytest.mark.parametrize(("frequency_hz", "waveform"), [(60.0, "sine"), (40.0, "ramp")])
@pytest.mark.parametrize("ramp_ms", [0.5, 40.0])
@pytest.mark.parametrize("late_us", [0.0, 400.0])
def test_a_host_that_turns_with_the_wave_gains_nothing(
    frequency_hz: float, waveform: str, ramp_ms: float, late_us: float
) -> None:
    """It stays at the crest until the meter ends it: 10 % and more, when outputs faded then."""
    limits = Limits(round(1e3 * ramp_ms), 100_000, 10_000_000)
    bench = JudgedDevice(hot_board(**COOL), loud_table(limits))
    begun_us = bench.core.now_us
    for turn in range(400):
        passed_s = (bench.core.now_us - begun_us) * 1e-6
        angle = -2.0 * np.pi * frequency_hz * passed_s if turn > 150 else 0.0
        gain = round(32767 * np.cos(angle)), round(32767 * np.sin(angle))
        bench.core.play_live([gain] * 5, round(1e3 * frequency_hz), WAVEFORMS.index(waveform))
        bench.core.delay_next_sample(late_us)
        bench.run(1.0)
    assert bench.judge.most_ma > 320.0
    bench.assert_kept()


@pytest.mark.parametrize("waveform", ["sine", "triangle"])
@pytest.mark.parametrize("frequency_hz", [33.0, 160.0, 500.0])
def test_a_sample_interrupt_that_dies_at_a_crest_holds_no_duty_for_long(
    frequency_hz: float, waveform: str
) -> None:
    """Up to 5 ms at a crest were 16 % more."""
    for moment in range(12):
        bench = JudgedDevice(hot_board(**COOL))
        for _ in range(4):
            bench.live([1.0] * 5, frequency_hz, waveform)
            bench.run(25.0)
        bench.run(1e3 / frequency_hz * moment / 12.0)
        bench.core.kill_interrupt(True)
        bench.run(30.0)
        assert bench.judge.most_ma > 320.0
        bench.assert_kept()


@pytest.mark.parametrize("frequency_hz", [160.0, 1000.0])
def test_samples_that_are_late_hold_no_crest(frequency_hz: float) -> None:
    """Each by just under what is a fault, so that all that is played is a crest."""
    bench = JudgedDevice(hot_board(**COOL))
    for _ in range(100):
        bench.live([1.0] * 5, frequency_hz, "sine")
        bench.run(0.2)
        for _ in range(3):
            bench.core.delay_next_sample(430.0)
            bench.run(0.5)
    assert bench.judge.most_ma > 320.0
    bench.assert_kept()


@pytest.mark.parametrize(("supply_ma", "full", "zeros"), [(600, 20, 160), (3000, 5, 10)])
def test_bursts_of_sixteen_coils_whose_samples_are_late_stay_within_the_window(
    supply_ma: int, full: int, zeros: int
) -> None:
    """Each frame of a burst stands nine times as long: 666 mA of 600."""
    settings = {**of_channels(16), "full_rise_dk": (10,) * 16, "supply_ma": supply_ma}
    bench = JudgedDevice(hot_board(limit_rise_dk=3000, **settings))
    bench.core.stream_begin()
    bench.run(5.0)
    pushed, has_ended = 0, False
    for half_ms in range(300):
        while not has_ended and pushed < 100 + 5 * half_ms:
            is_full = pushed >= 400 and (pushed - 400) % (full + zeros) < full
            has_ended = bench.push(float(is_full), 1) == 0
            pushed += 1
        if bench.judge.is_on:
            bench.core.delay_next_sample(430.0)
        bench.run(0.5)
    assert bench.judge.most_ma > 0.7 * supply_ma
    bench.assert_kept()
