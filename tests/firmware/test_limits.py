"""Each way in which a limit of heat or supply current was once passed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.sim.board.electronics import NOT_WIRED
from chladni.sim.coil.waveforms import WAVEFORMS
from firmware.judged_device import PINS, JudgedDevice, hot_board


@pytest.fixture
def bench() -> JudgedDevice:
    return JudgedDevice()


def test_a_lowered_limit_forgets_no_heat(bench: JudgedDevice) -> None:
    """Lowered, then raised again: 159 K before, of 60."""
    bench.configure(supply_ma=20_000)
    for _ in range(5):
        bench.heat(600.0)
        bench.configure(limit_rise_dk=100)
        bench.run(2.0)
        bench.configure(limit_rise_dk=600)
    assert bench.judge.most_k > 20.0
    bench.assert_kept()


def test_what_was_assumed_under_a_lower_limit_is_assumed_again() -> None:
    """A loss of power under 10 K: a coil may still be at 60, which counts once that is allowed."""
    bench = JudgedDevice(hot_board(limit_rise_dk=100), is_rested=False)
    bench.run(1_000.0)
    bench.configure(limit_rise_dk=600)
    for _ in range(24):
        bench.touch()
        bench.run(400.0)
        bench.touch(is_down=False)
        bench.run(30.0)
    assert bench.judge.on_s > 0.1
    bench.assert_kept()


def test_a_coil_keeps_its_heat_whichever_channel_it_is(bench: JudgedDevice) -> None:
    """Two pins swapped: 100 K of 60 before."""
    bench.configure(supply_ma=20_000)
    for number in range(4):
        bench.heat(600.0, pin=PINS[0])
        swapped = (PINS[1], PINS[0]) if number % 2 == 0 else PINS[:2]
        bench.configure(pwm_pins=(*swapped, *PINS[2:], *(NOT_WIRED,) * 11))
    assert bench.judge.most_k > 20.0
    bench.assert_kept()


def test_a_coil_keeps_its_heat_while_it_is_no_channel(bench: JudgedDevice) -> None:
    """Five channels, four and five again: 139 K of 60 before."""
    bench.configure(supply_ma=20_000)
    nothing = (NOT_WIRED,) * 11
    for _ in range(4):
        bench.heat(600.0, pin=PINS[4])
        for count in (4, 5):
            rest = (0,) * (16 - count)
            bench.configure(
                channels=count,
                pwm_pins=(*PINS[:count], *nothing, *(NOT_WIRED,) * (5 - count)),
                full_rise_dk=(10_000,) * count + rest,
                full_current_ma=(333,) * count + rest,
            )
    assert bench.judge.most_k > 20.0
    bench.assert_kept()


def test_trains_of_clicks_in_a_stream_are_counted(bench: JudgedDevice) -> None:
    """Bursts of 140 full frames: 108 K of 60, where 54 were shown."""
    bench.configure(supply_ma=20_000)
    for _ in range(100):
        if not bench.core.stream_begin():
            bench.run(100.0)
            continue
        bench.run(2.0)
        bench.push(1.0, 140)
        bench.run(16.0)
        bench.core.stream_end()
        bench.run(6.0)
    assert bench.judge.most_k > 20.0
    bench.assert_kept()


def test_what_still_plays_is_counted_while_a_command_waits() -> None:
    """A release of a second, and a new touch at once: 79 K of 60 before."""
    square = WAVEFORMS.index("square")
    bench = JudgedDevice(
        hot_board(release_ms=1000, supply_ma=20_000, heating_ds=400, waveform=square)
    )
    for _ in range(30):
        bench.core.command("touch 0 0")
        bench.run(60.0)
        bench.core.command("lift")
        bench.run(10.0)
        bench.live([0.0] * 5, 160.0, "sine")
        bench.run(800.0)
    assert bench.judge.most_k > 20.0
    bench.assert_kept()


def test_what_played_while_the_main_loop_hung_is_counted(bench: JudgedDevice) -> None:
    """110 ms of every 122: 79 K, where 8 were shown."""
    bench.configure(supply_ma=20_000)
    for _ in range(60):
        bench.touch()
        bench.run(12.0)
        bench.core.hang_main_loop(True)
        bench.run(110.0)
        bench.core.hang_main_loop(False)
        bench.touch(is_down=False)
        bench.run(1.0)
    assert bench.judge.most_k > 20.0
    bench.assert_kept()


@pytest.mark.parametrize("frequency_hz", [1.0, 8.0, 30.0, 160.0])
@pytest.mark.parametrize("waveform", WAVEFORMS)
def test_the_supply_is_kept_in_every_window(frequency_hz: float, waveform: str) -> None:
    """Long means let 1 Hz draw 1,895 mA of 1,000 for half a second."""
    bench = JudgedDevice(
        hot_board(limit_rise_dk=3000, full_rise_dk=(10,) * 5 + (0,) * 11, supply_ma=400)
    )
    for _ in range(60):
        bench.live([1.0] * 5, frequency_hz, waveform)
        bench.run(25.0)
    bench.assert_kept()
    # And used: rounding, the ramps and half a period's reserve are what it lacks.
    assert bench.judge.most_ma > 400.0 * (0.85 if frequency_hz > 100.0 else 0.58)
    assert "supply current" not in [cause for cause, _, _ in bench.core.faults]


def test_a_burst_is_refused_before_it_is_played() -> None:
    """102 ms at full where the ring's mean promised 68; now none of a frame that is too much."""
    bench = JudgedDevice(hot_board(limit_rise_dk=3000, full_rise_dk=(10,) * 5 + (0,) * 11))
    bench.core.stream_begin()
    bench.run(5.0)
    bench.push(0.3, 200)
    bench.run(30.0)
    bench.push(1.0, 300)
    bench.run(100.0)
    bench.assert_kept()
    assert "supply current" in [cause for cause, _, _ in bench.core.faults]


def test_a_duty_that_is_not_taken_is_counted_as_the_one_that_stands(bench: JudgedDevice) -> None:
    bench.configure(supply_ma=20_000)
    bench.touch()
    bench.run(50.0)
    for _ in range(20):
        bench.core.drop_next_duties(0b11111)
        bench.run(0.2)
    shown, judged = bench.core.coil_rise_k, [bench.judge.rise_k[pin] for pin in PINS]
    bench.run(70.0)
    assert max(judged) > 1.0
    counted = bench.core.coil_rise_k
    assert all(one <= other + 0.3 for one, other in zip(judged, counted, strict=True))
    assert max(shown) < 2.0 * max(judged)


def late(bench: JudgedDevice, milliseconds: float, late_us: float) -> Iterator[NDArray[np.int16]]:
    """Duties, while each sample comes so late."""
    for _ in range(round(milliseconds * 1e3 / late_us)):
        bench.core.delay_next_sample(late_us)
        yield bench.emulator.run(late_us / 1e3).duty_steps


@pytest.mark.parametrize(("release_ms", "most_ms"), [(4, 12.0), (200, 220.0)])
def test_fades_end_on_time_when_samples_are_late(release_ms: int, most_ms: float) -> None:
    """4.5 ms late each: a ramp of 4 ms lasted 352 ms, one of 200 was still on after 4 s."""
    bench = JudgedDevice(hot_board(release_ms=release_ms))
    bench.core.command("touch 0 0")
    bench.run(100.0)
    bench.core.command("lift")
    bench.run(1.5)
    duties = np.concatenate(list(late(bench, 400.0, 4_500.0)))
    on_ms = np.flatnonzero(duties.any(axis=1))[-1] / 78.125 if duties.any() else 0.0
    assert on_ms <= most_ms
