"""Several fingers' sines at once: what each plays, limits of the sum, and how they end."""

from __future__ import annotations

import cmath
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.host.emulation._emulator import Synthesis, full_span_steps, half_span_steps
from thermal import means_of

SAMPLE_HZ = 78_125 / 4
FULL_MA = 333
MOST_VOICES = 5
Voice = tuple[list[tuple[int, int]], int, bool, int]


def voice(
    gains: Sequence[complex], hz: float = 160.0, level: float = 1.0, *, starts: bool = True
) -> Voice:
    """Gains of 1 are full scale."""
    pairs = [(round(32767 * gain.real), round(32767 * gain.imag)) for gain in map(complex, gains)]
    return pairs, round(32767 * level), starts, round(1e3 * hz)


def silent(channels: int = 2) -> Voice:
    return [(0, 0)] * channels, 0, False, 0


def synthesis(channels: int = 2, **settings: object) -> Synthesis:
    return Synthesis(full_current_ma=[FULL_MA] * channels, **settings)  # type: ignore[arg-type]


def amplitude_at(duties: NDArray[np.float64], hz: float) -> NDArray[np.complex128]:
    """Of each channel: a cosine's amplitude in steps and its phase, from the first sample on."""
    wave = np.exp(-2j * np.pi * hz * np.arange(len(duties)) / SAMPLE_HZ)
    window = np.blackman(len(duties))[:, None]
    return np.asarray(2.0 * (wave[:, None] * window * duties).sum(axis=0) / window.sum())


def test_one_voice_is_what_a_drive_plays() -> None:
    gains = [0.6 - 0.2j, -0.3j]
    pairs = voice(gains)[0]
    alone, among = synthesis(), synthesis()
    alone.play(pairs, 20_000, 4_000, True)
    among.play_voices([(pairs, 20_000, True, 160_000)], 4_000, True)
    assert np.array_equal(alone.run(2_000), among.run(2_000))


@pytest.mark.parametrize("has_bridges", [False, True])
def test_each_voice_has_its_gains_frequency_and_level(has_bridges: bool) -> None:
    """Gain, level and wave are each rounded down to 15 bits: a tenth of a step at most."""
    own = synthesis(has_bridges=has_bridges)
    wanted: list[tuple[list[complex], float, float]] = [
        ([0.3, 0.1j], 160.0, 1.0),
        ([-0.2, 0.15], 201.0, 0.5),
        ([0.1j, -0.2j], 77.0, 0.8),
        ([0.0, 0.1], 310.0, 1.0),
        ([0.05, -0.05j], 45.0, 0.9),
    ]
    own.play_voices([voice(*one) for one in wanted], 4_000, True)
    own.run(100)
    duties = own.run(40_000).astype(float)
    span = full_span_steps(10, 0) if has_bridges else half_span_steps(10)
    duties -= duties.mean(axis=0)
    for gains, hz, level in wanted:
        found = amplitude_at(duties, hz)
        turned = found * cmath.exp(-2j * np.pi * hz * 100 / SAMPLE_HZ)
        assert turned == pytest.approx(span * level * np.array(gains), abs=0.1 * span / 509)


def test_the_bias_serves_the_sum_and_no_silent_channel() -> None:
    """The trough of two voices in step still switches: 40 steps and what the shaper takes."""
    own = synthesis(3, min_on_steps=40)
    own.play_voices([voice([0.3, 0.0, 0.0]), voice([0.1, 0.0, 0.3])], 4_000, True)
    duties = own.run(3_000)
    assert not duties[:, 1].any()
    assert 40 <= duties[200:, [0, 2]].min() <= 45


def random_voices(
    rng: np.random.Generator, channels: int, among: Sequence[float] = (1.0, 8.0, 33.0, 160.0, 161.0)
) -> list[Voice]:
    """Loud ones, most of them in the same phase, at frequencies that beat; some are silent."""
    rows = []
    for _ in range(MOST_VOICES):
        if rng.random() < 0.3:
            rows.append(silent(channels))
            continue
        turn = np.exp(2j * np.pi * rng.random() * (rng.random() < 0.5))
        gains = rng.choice([0.3, 1.0, 1.0], channels) * turn * 0.999
        rows.append(voice(gains, rng.choice(among), rng.choice([0.2, 1.0]), starts=True))
    return rows


@pytest.mark.parametrize("has_bridges", [False, True])
def test_no_sum_of_voices_passes_the_ceiling_of_duty(has_bridges: bool) -> None:
    """And none is cut off: the loudest sum stays a step below it, so that no wave is bent."""
    rng = np.random.default_rng(1)
    own = synthesis(max_duty_q15=16384, has_bridges=has_bridges)
    own.play_voices([voice([0.99, 0.99]) for _ in range(MOST_VOICES)], 4_000, True)
    own.run(100)
    assert 505 <= own.run(1_000).max() < 512
    for _ in range(300):
        own.play_voices(random_voices(rng, 2), int(rng.choice([500, 4_000, 20_000])), False)
        assert np.abs(own.run(int(rng.integers(1, 300))).astype(int)).max() < 512


def test_limits_lower_all_voices_alike() -> None:
    own = synthesis(has_bridges=True)
    own.play_voices(
        [voice([1.0, 0.5], 160.0), voice([0.9, -0.3j], 90.0, 0.5), voice([0.0, 0.9], 230.0)],
        4_000,
        True,
    )
    own.run(100)
    duties = own.run(40_000).astype(float)
    first, second, third = (np.abs(amplitude_at(duties, hz)) for hz in (160.0, 90.0, 230.0))
    # The second channel's are to be 0.5 + 0.15 + 0.9, the largest sum: that is the span.
    assert first[1] + second[1] + third[1] == pytest.approx(full_span_steps(10, 0), rel=0.003)
    assert second[0] / first[0] == pytest.approx(0.45, rel=0.003)
    assert first[1] / first[0] == pytest.approx(0.5, rel=0.003)
    assert third[1] / first[0] == pytest.approx(0.9, rel=0.003)
    assert own.limited == 1


def windows_ma(duties: NDArray[np.int16]) -> NDArray[np.float64]:
    """What the supply delivers, over each 64 ms."""
    return means_of(FULL_MA * ((duties / 1024.0) ** 2).sum(axis=1), SAMPLE_HZ)


@pytest.mark.parametrize("has_bridges", [False, True])
def test_the_supply_is_kept_whatever_voices_beat(has_bridges: bool) -> None:
    rng = np.random.default_rng(2)
    limit_ma = 300
    own = synthesis(4, supply_ma=limit_ma, has_bridges=has_bridges)
    own.play_voices([silent(4)], 4_000, True)
    duties = []
    for _ in range(150):
        own.play_voices(random_voices(rng, 4), int(rng.choice([500, 4_000, 20_000])), False)
        duties.append(own.run(int(rng.choice([40, 400, 3_000]))))
    assert windows_ma(np.concatenate(duties)).max() <= limit_ma
    assert own.limited > 50


@pytest.mark.parametrize("has_bridges", [False, True])
def test_what_the_supply_allows_is_used(has_bridges: bool) -> None:
    """Two voices a hertz apart, when they are in step: rounding and a period's reserve are left."""
    own = synthesis(4, supply_ma=300, has_bridges=has_bridges)
    own.play_voices([voice([0.5] * 4, hz) for hz in (160.0, 161.0)], 4_000, True)
    assert 0.85 * 300 < windows_ma(own.run(30_000)).max() <= 300


def test_voices_come_and_go_in_straight_lines() -> None:
    """At bad moments, in ramps within ramps: between two samples no more than ramp and wave do."""
    rng = np.random.default_rng(3)
    own = synthesis()
    own.play_voices([silent()], 4_000, True)
    duties = []
    for _ in range(200):
        own.play_voices(random_voices(rng, 2, among=(100.0, 160.0)), 4_000, False)
        duties.append(own.run(int(rng.integers(1, 200))))
    jump = np.abs(np.diff(np.concatenate(duties).astype(int), axis=0)).max()
    # Of 509 steps: the fastest wave, and gains and bias once across their range in 78 samples, from
    # one end to the other at most.
    assert jump <= 509 * (2.0 * np.pi * 160.0 / SAMPLE_HZ + 3.0 / 78) + 8


@pytest.mark.parametrize("place", [0, 1])
def test_a_voice_that_goes_on_keeps_frequency_and_phase(place: int) -> None:
    """While another arrives and leaves, as if nothing had been."""
    alone, among = synthesis(has_bridges=True), synthesis(has_bridges=True)
    first = voice([0.3, 0.2j], 123.0)
    goes_on = (*first[:2], False, 999_000)
    other = voice([0.1, 0.4], 310.0)
    for one in (alone, among):
        one.play_voices([first, silent()] if place == 0 else [silent(), first], 4_000, True)
        one.run(500)
    among.play_voices([goes_on, other] if place == 0 else [other, goes_on], 4_000, False)
    alone.run(1_000), among.run(1_000)
    among.play_voices([goes_on, silent()] if place == 0 else [silent(), goes_on], 4_000, False)
    alone.run(100), among.run(100)
    rest = alone.run(2_000).astype(int) - among.run(2_000)
    assert np.abs(rest).max() <= 3  # what the shaper adds


@pytest.mark.parametrize("how", ["release", "stop"])
def test_all_voices_end_together_and_leave_nothing(how: str) -> None:
    own = synthesis()
    own.play_voices([voice([0.5, 0.2], 160.0 + k) for k in range(MOST_VOICES)], 4_000, True)
    own.run(500)
    if how == "release":
        own.release(4_000)  # 78 samples
        fading = own.run(178).astype(int)
        assert fading[:70].any()
        assert not fading[80:].any()
        # In a straight line with bias and waves: at most a tenth of the range when a tenth is left.
        assert fading[71:].max() <= 0.1 * 1023 + 3
        assert np.abs(np.diff(fading, axis=0)).max() <= 509 * (0.055 + 3.0 / 78) + 8
    else:
        own.stop()
        assert not own.run(100).any()
    assert own.is_quiet
    new = synthesis()
    for one in (own, new):
        one.play(voice([0.4, 0.1j])[0], 30_000, 4_000, True)
    assert np.array_equal(own.run(1_000), new.run(1_000))


def test_samples_that_were_missed_move_no_voice_against_another() -> None:
    rows = [voice([0.2, 0.1], 160.0), voice([0.3, 0.2], 201.0)]
    whole, gap = synthesis(has_bridges=True), synthesis(has_bridges=True)
    for one in (whole, gap):
        one.play_voices(rows, 4_000, True)
        one.run(500)
    whole.run(5)
    rest = whole.run(1_000).astype(int) - gap.run(1_000, missed=5)
    assert np.abs(rest).max() <= 3


def test_a_late_interrupt_ends_all_voices() -> None:
    own = synthesis()
    own.play_voices([voice([0.5, 0.2], 160.0 + k) for k in range(3)], 4_000, True)
    own.run(500)
    own.run(1, missed=12)  # 0.6 ms
    assert not own.run(200)[100:].any()


def test_a_wave_that_is_no_sine_is_the_first_voice_s_alone() -> None:
    own, alone = synthesis(), synthesis()
    for one in (own, alone):
        one.set_waveform(2)
    own.play_voices([voice([0.5, 0.2]), voice([0.1, 0.4], 90.0)], 4_000, True)
    alone.play(voice([0.5, 0.2])[0], 32_767, 4_000, True)
    assert np.array_equal(own.run(1_000), alone.run(1_000))
