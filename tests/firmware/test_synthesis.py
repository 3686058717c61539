"""What the synthesis puts on the pins: purity, waves other than sines, and ramps between drives."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.host.emulation import _emulator
from chladni.host.emulation.demodulate import PURITY_PERIODS, Play, sfdr_db, sndr_db
from chladni.host.emulation.emulator import Recording, TouchEvent, emulate
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.tables.table import Limits
from made_up import device_of, make_table, powered
from thermal import means_of

LONG = Limits(4000, 100_000, 60_000_000)
SAMPLE_HZ = 78_125 / 4


def play(drive: list[complex], milliseconds: float, **settings: Any) -> Recording:
    """A touch on a board of one region, at full level."""
    table = replace(make_table(np.array([drive])), limits=LONG)
    touches = [TouchEvent(0.0, (0.0, 0.0))]
    settings = {"level": 1.0} | settings
    return emulate(device_of(table), table, touches, milliseconds, **settings)


def settled(recording: Recording, begin_ms: float = 40.0) -> NDArray[np.float64]:
    """Duties once a sample, in steps, mean removed."""
    begin = int(begin_ms * 1e-3 * recording.carrier_hz) // 4 * 4
    duties = recording.duty_steps[begin::4].astype(float)
    return np.asarray(duties - duties.mean(axis=0))


def amplitude_at(signal: NDArray[np.float64], frequency_hz: float) -> complex:
    """Amplitude and phase of a cosine over whole periods."""
    count = signal.size
    t = np.arange(count) / SAMPLE_HZ
    window = np.blackman(count)
    return complex(
        2.0 * np.vdot(np.exp(2j * np.pi * frequency_hz * t), signal * window) / window.sum()
    )


@pytest.mark.slow
@pytest.mark.parametrize("frequency_hz", [20.0, 160.0, 1000.0])
def test_purity_at_full_amplitude_and_24_db_below(frequency_hz: float) -> None:
    """SFDR of 100 and 85 dB and SNDR of 90 and 70 dB, as hardware.md defines them."""
    table = make_table(np.array([[10.0, 0.63, 10.0j]]), frequency_hz=frequency_hz)
    table = replace(table, limits=LONG)
    milliseconds = PURITY_PERIODS / 78_125 * 1e3 + 80.0
    recording = emulate(
        device_of(table), table, [TouchEvent(0.0, (0.0, 0.0))], milliseconds, level=1.0
    )
    steady = Play(int(0.05 * recording.carrier_hz), recording.duty_steps.shape[0])
    for measure, loud_db, quiet_db in ((sfdr_db, 100.0, 85.0), (sndr_db, 90.0, 70.0)):
        full, quiet, turned = measure(recording, steady, frequency_hz)
        assert full is not None
        assert quiet is not None
        assert turned is not None
        assert min(full, turned) > loud_db
        assert quiet > quiet_db


FIRST_HARMONIC = {"triangle": 8.0 / np.pi**2, "square": 4.0 / np.pi, "ramp": 2.0 / np.pi}


@pytest.mark.parametrize("waveform", list(FIRST_HARMONIC))
def test_other_waves_have_their_fourier_series(waveform: str) -> None:
    """Harmonics of the textbook's series, whose first has the drive's phase."""
    recording = play([10.0, 5.0 * np.exp(0.7j)], 1_200.0, waveform=WAVEFORMS.index(waveform))
    signal = settled(recording)
    full = _emulator.half_span_steps(10)
    first = [amplitude_at(signal[:, k], 160.0) for k in range(2)]
    assert abs(first[0]) == pytest.approx(FIRST_HARMONIC[waveform] * full, rel=0.01)
    assert abs(first[1]) == pytest.approx(FIRST_HARMONIC[waveform] * full / 2.0, rel=0.01)
    assert np.angle(first[1] / first[0]) == pytest.approx(0.7, abs=0.01)
    for harmonic in range(2, 8):
        ratio = abs(amplitude_at(signal[:, 0], 160.0 * harmonic)) / abs(first[0])
        odd = harmonic % 2 == 1
        expected = {
            "triangle": 1.0 / harmonic**2 if odd else 0.0,
            "square": 1.0 / harmonic if odd else 0.0,
            "ramp": 1.0 / harmonic,
        }[waveform]
        # Edges spread over two samples take away 1.3 % at 1120 Hz (a triangular smoothing).
        assert ratio == pytest.approx(expected, abs=0.004, rel=0.02)


@pytest.mark.parametrize("waveform", ["square", "ramp"])
def test_spread_edges_keep_images_out_of_the_band(waveform: str) -> None:
    """What folds back into 20–1000 Hz is 20 dB below what plain edges leave there."""
    # A frequency whose harmonics do not fold back onto each other.
    frequency = 437.0
    table = replace(make_table(np.array([[10.0]]), frequency_hz=frequency), limits=LONG)
    recording = emulate(
        device_of(table),
        table,
        [TouchEvent(0.0, (0.0, 0.0))],
        3_500.0,
        level=1.0,
        waveform=WAVEFORMS.index(waveform),
    )
    signal = settled(recording)[: 2**16, 0]
    phase = np.arange(signal.size) * frequency / SAMPLE_HZ
    plain = np.sign(np.cos(2.0 * np.pi * phase)) if waveform == "square" else 2.0 * (phase % 1.0)
    plain = _emulator.half_span_steps(10) * (plain - plain.mean())

    def worst_db(wave: NDArray[np.float64]) -> float:
        power = np.abs(np.fft.rfft(wave * np.blackman(wave.size))) ** 2
        hertz = np.fft.rfftfreq(wave.size, 1.0 / SAMPLE_HZ)
        harmonic = np.abs(hertz / frequency - np.rint(hertz / frequency)) * frequency < 3.0
        band = (hertz > 20.0) & (hertz < 1000.0) & ~harmonic
        return float(10.0 * np.log10(power[band].max() / power.max()))

    assert worst_db(signal) < worst_db(plain) - 20.0


@pytest.mark.parametrize("waveform", WAVEFORMS)
def test_a_drive_that_turns_half_round_does_so_without_a_jump(waveform: str) -> None:
    """From 10 to −10 under a moving finger: envelope, bias and phase in straight lines."""
    table = make_table(np.array([[10.0], [-10.0]]), 2, 1)
    events = [TouchEvent(0.0, (-30.0, 0.0)), TouchEvent(100.0, (30.0, 0.0))]
    recording = emulate(
        device_of(table), table, events, 200.0, waveform=WAVEFORMS.index(waveform), level=0.8
    )
    duties = recording.duty_steps[::4, 0].astype(int)
    jump = int(np.abs(np.diff(duties)).max())
    span = 0.8 * 509
    # Per sample: the wave itself, and amplitude, bias and phase on their way (78 samples a ramp).
    slope = {"sine": 2.0 * np.pi, "triangle": 4.0, "ramp": 2.0}.get(waveform, 0.0)
    moved = span * (slope * (160.0 / SAMPLE_HZ + 0.5 / 78) + 3.0 / 78)
    # The others' edges take two samples: from −3/4 to 3/4 of the way at once, half-way between.
    edge = {"square": 1.5 * span, "ramp": 1.5 * span}.get(waveform, 0.0)
    assert jump <= moved + edge + 8
    assert duties.max() < 1024


def test_a_ceiling_of_duty_is_kept_and_the_pattern_with_it() -> None:
    """The whole drive is made quieter, so that its field only loses loudness."""
    recording = play([10.0, 5.0, 2.0], 400.0, max_duty_q15=round(0.5 * 32768))
    assert recording.duty_steps.max() <= 512
    signal = settled(recording)
    sizes = [abs(amplitude_at(signal[:, k], 160.0)) for k in range(3)]
    assert sizes[0] > 240.0
    assert np.array(sizes) / sizes[0] == pytest.approx([1.0, 0.5, 0.2], rel=0.01)


def test_the_supply_limit_is_kept_and_counted() -> None:
    """Five channels of 333 mA at full: waves of a half about a half take 3/8 of that, 0.62 A."""
    table = replace(make_table(np.array([[10.0, 10.0, 10.0, 10.0, 10.0]])), limits=LONG)
    for limit_ma in (1000, 400):
        emulator = powered(table, level=1.0, supply_ma=limit_ma)
        emulator.touch(TouchEvent(0.0, (0.0, 0.0)))
        recording = emulator.run(600.0)
        # A coil's current times its duty, as a mean over every 64 ms.
        window_ma = means_of(333.0 * (recording.duty**2).sum(axis=1), recording.carrier_hz)
        assert window_ma.max() <= limit_ma
        assert window_ma.max() > min(limit_ma, 620) * 0.9
        last = window_ma[-5_000:]  # by which the device's windows may be off
        assert 0.99 * last.min() < emulator.core.supply_ma < 1.01 * last.max()
        assert emulator.core.limited_drives == (1 if limit_ma < 620 else 0)
        assert emulator.core.state == "playing"


def test_no_pulse_is_shorter_than_what_switches() -> None:
    """500 ns are 40 steps at 10 bits; a silent channel still gets none."""
    recording = play([3.0, 0.5, 0.0], 300.0, min_on_ns=500)
    duties = recording.duty_steps[3128:]
    assert duties[:, :2].min() >= 40
    assert not duties[:, 2].any()
