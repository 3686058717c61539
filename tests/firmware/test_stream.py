"""A host that drives the outputs: raw duties at carrier/8, or a drive that it repeats."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.host.emulation import _emulator
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.tables.table import Limits, Table
from made_up import device_of, make_table

FRAME_HZ = 78_125 / 8
PREFILL = _emulator.STREAM_TARGET - 24.0
"""Frames ahead at the end of a packet's 5 ms, so that the ring holds its target on average."""
LIMITS = Limits(4_000, 100_000, 2_000_000)


@pytest.fixture
def table() -> Table:
    return replace(make_table(np.array([[10.0, 5.0]])), limits=LIMITS)


def wave(begin: int, count: int) -> NDArray[np.uint16]:
    """160 Hz on channel 0, a fifth higher on channel 1, as 16-bit duties."""
    t = np.arange(begin, begin + count)[:, None] / FRAME_HZ
    phase = 2.0 * np.pi * t * np.array([160.0, 240.0])
    return np.asarray(32768.0 + 20000.0 * np.sin(phase)).astype(np.uint16)


def streaming(
    emulator: Emulator,
    seconds: float,
    *,
    rate: float = 1.0,
    chunk_ms: int = 5,
    jitter: int = 0,
    drifts: list[int] | None = None,
) -> NDArray[np.uint16]:
    """Push frames in packets, `rate` times as fast as the device's clock; returns the duties."""
    rng = np.random.default_rng(3)
    sent, record = 0, []
    for step in range(round(seconds * 1e3 / chunk_ms)):
        due = (step + 1) * chunk_ms * 1e-3 * FRAME_HZ * rate + PREFILL
        late = int(rng.integers(0, jitter + 1)) if jitter else 0
        count = max(int(due) - late - sent, 0)
        taken = emulator.core.stream_push(wave(sent, count)) if count else 0
        sent += taken
        record.append(emulator.run(chunk_ms).duty_steps)
        if drifts is not None:
            drifts.append(emulator.core.stream_drift)
    return np.concatenate(record)


def causes(emulator: Emulator) -> list[str]:
    return [cause for cause, _, _ in emulator.core.faults]


def begun(table: Table) -> Emulator:
    emulator = Emulator(device_of(table), table)
    emulator.run(5.0)
    assert emulator.core.stream_begin()
    emulator.run(10.0)
    return emulator


def test_a_raw_stream_comes_out_as_it_went_in(table: Table) -> None:
    emulator = begun(table)
    duties = streaming(emulator, 1.5)
    assert emulator.core.state == "streaming"
    assert causes(emulator) == []
    tail = duties[-65536::4].astype(float)
    t = np.arange(tail.shape[0]) / (78_125 / 4)
    window = np.blackman(tail.shape[0])
    for channel, frequency in ((0, 160.0), (1, 240.0)):
        # The ring's drift correction may bend the frequency by a few ppm: search around it.
        near = frequency * (1.0 + np.linspace(-2e-3, 2e-3, 81))
        tones = np.exp(-2j * np.pi * near[:, None] * t)
        found = np.abs(tones @ ((tail[:, channel] - tail[:, channel].mean()) * window))
        amplitude = 2.0 * found.max() / window.sum()
        assert amplitude == pytest.approx(20000.0 / 64.0, rel=2e-3)
        assert near[np.argmax(found)] == pytest.approx(frequency, rel=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("ppm", [-200, -50, 0, 50, 200])
def test_a_clock_that_differs_is_followed_without_a_lost_frame(table: Table, ppm: int) -> None:
    emulator = begun(table)
    drifts: list[int] = []
    streaming(emulator, 20.0, rate=1.0 + ppm * 1e-6, jitter=30, drifts=drifts)
    assert causes(emulator) == []
    # 2^31 is one half, a frame for every other sample; the last five seconds.
    found = np.array(drifts[-1000:]) / 2**31 * 1e6
    assert found.mean() == pytest.approx(ppm, abs=20.0)
    assert np.ptp(found) < 500.0
    assert abs(emulator.core.stream_filled - _emulator.STREAM_TARGET) < 60


def test_an_underrun_fades_out_is_counted_and_mended(table: Table) -> None:
    emulator = begun(table)
    streaming(emulator, 0.3)
    silence = emulator.run(60.0).duty_steps
    assert not silence[-1].any()
    jumps = np.abs(np.diff(silence[::4, 0].astype(int))).max()
    assert jumps < 60  # a fade, not a step of 500
    assert causes(emulator) == ["stream underrun"]
    assert emulator.core.state == "streaming"
    assert streaming(emulator, 0.3)[-1].any()


def test_a_host_that_vanishes_is_let_go(table: Table) -> None:
    emulator = begun(table)
    streaming(emulator, 0.3)
    recording = emulator.run(300.0).duty_steps
    on_ms = (np.flatnonzero(recording.any(axis=1))[-1] + 1) / 78_125.0 * 1e3
    assert on_ms <= 512 / FRAME_HZ * 1e3 + 4.0 + 1.0  # a full ring and a ramp
    assert causes(emulator) == ["stream underrun", "host silent"]
    assert emulator.core.state == "idle"
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, (0.0, 0.0)))
    assert emulator.run(60.0).duty_steps[-1].any()


def test_a_stream_takes_over_from_a_finger_and_gives_back(table: Table) -> None:
    emulator = Emulator(device_of(table), table)
    emulator.touch(TouchEvent(5.0, (0.0, 0.0)))
    emulator.run(60.0)
    assert emulator.core.stream_begin()
    emulator.run(10.0)
    assert emulator.core.state == "streaming"
    assert streaming(emulator, 0.2)[-1].any()
    emulator.core.stream_end()
    # The finger is still there.
    emulator.run(60.0)
    assert emulator.core.state == "playing"


def test_a_live_drive_plays_until_it_is_no_longer_repeated(table: Table) -> None:
    """The paper's live mode: frequency, waveform, duty ratios and phases from the host."""
    emulator = Emulator(device_of(table), None, must_play=False)
    emulator.run(5.0)
    assert emulator.core.state == "fault"  # no table, and none needed
    gains = [(16000, 0), (0, 8000)]
    for _ in range(30):
        emulator.core.play_live(gains, 200_000, 0)
        recording = emulator.run(50.0)
    tail = recording.duty_steps[::4].astype(float)
    spectrum = np.abs(
        np.fft.rfft((tail - tail.mean(axis=0)) * np.hanning(len(tail))[:, None], axis=0)
    )
    peak = np.argmax(spectrum[:, 0]) * (78_125 / 4) / len(tail)
    assert peak == pytest.approx(200.0, abs=12.0)
    assert np.ptp(tail[:, 0]) / np.ptp(tail[:, 1]) == pytest.approx(2.0, rel=0.05)
    recording = emulator.run(200.0)
    on_ms = np.flatnonzero(recording.duty_steps.any(axis=1))[-1] / 78_125.0 * 1e3
    assert on_ms <= 50.0 + 5.0 + 1.0
    assert "host silent" in causes(emulator)
    assert emulator.core.state == "fault"


def test_a_live_drive_that_was_refused_leaves_no_fault_behind(table: Table) -> None:
    """A finger that plays is faded out first: the host is told to ask again, and may not."""
    emulator = Emulator(device_of(table), table)
    emulator.touch(TouchEvent(5.0, (0.0, 0.0)))
    emulator.run(60.0)
    assert not emulator.core.play_live([(16000, 0), (0, 8000)], 200_000, 0)
    emulator.run(300.0)
    assert causes(emulator) == []
    assert emulator.core.state == "playing"


def test_a_stream_beyond_the_supply_is_ended(table: Table) -> None:
    emulator = begun(table)
    emulator = Emulator(device_of(table), table, supply_ma=200)
    emulator.run(5.0)
    assert emulator.core.stream_begin()
    emulator.run(10.0)
    streaming(emulator, 0.5)
    assert "supply current" in causes(emulator)
    assert emulator.core.stream_push(wave(0, 1)) == 0


def test_frames_count_alike_however_they_come(table: Table) -> None:
    """A burst of full frames and one of silence a moment later: the burst is what heats."""
    emulator = Emulator(device_of(table), table, supply_ma=200)
    emulator.run(5.0)
    assert emulator.core.stream_begin()
    emulator.run(10.0)
    full, nothing = np.full((163, 2), 65_000, np.uint16), np.zeros((1, 2), np.uint16)
    for _ in range(40):
        emulator.core.stream_push(full)
        emulator.run(1.1)
        emulator.core.stream_push(nothing)
        emulator.run(15.5)
    assert causes(emulator).count("supply current") == 1


def test_a_finger_gets_the_tables_wave_after_a_live_drive_ended_in_a_fault(table: Table) -> None:
    emulator = Emulator(device_of(table), table)
    for _ in range(10):
        emulator.core.play_live([(16000, 0), (0, 8000)], 50_000, 2)
        emulator.run(20.0)
    emulator.core.delay_next_sample(3_000.0)
    emulator.run(200.0)
    assert "interrupt late" in causes(emulator)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, (0.0, 0.0)))
    recording = emulator.run(400.0)
    tail = recording.duty_steps[-4 * 4883 :: 4, 0].astype(float)
    spectrum = np.abs(np.fft.rfft((tail - tail.mean()) * np.hanning(len(tail))))
    assert np.argmax(spectrum) * (78_125 / 4) / len(tail) == pytest.approx(160.0, abs=4.0)


def test_frames_are_refused_unless_streaming(table: Table) -> None:
    emulator = Emulator(device_of(table), table)
    emulator.run(5.0)
    assert emulator.core.stream_push(wave(0, 10)) == 0
    with pytest.raises(ValueError, match="column per channel"):
        emulator.core.stream_push(np.zeros((4, 3), np.uint16))
