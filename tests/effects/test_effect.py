"""What effects come to as samples, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from chladni.effects import Bank, Click, Clip, Curve, Effect, Noise, Tone, shipped_effects
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.bank.pack import pack_bank
from chladni.effects.effect import MOST_POINTS
from chladni.effects.flatten import flattened, flattened_effect
from chladni.effects.low_pass import TAIL_S, low_passed
from chladni.sim.errors import InputError

RAMP = Curve((0.0, 0.5), (0.0, 1.0))


def times_of(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.arange(len(samples)) / SIGNAL_HZ


def test_a_tone_is_a_sine_whose_phase_is_the_integral_of_its_frequency() -> None:
    """A sweep of 60 + 100 t Hz: the sine of 2π (60 t + 50 t²)."""
    tone = Tone(0.0, 0.5, Curve.constant(1.0), Curve((0.0, 0.5), (60.0, 110.0)))
    wave = Effect("sweep", (tone,)).wave(SIGNAL_HZ, 0.49)
    t = times_of(wave)
    assert wave == pytest.approx(np.sin(2.0 * np.pi * (60.0 * t + 50.0 * t**2)), abs=1e-6)


def test_a_tone_that_begins_late_begins_at_its_own_zero() -> None:
    tone = Tone(0.1, 0.2, Curve.constant(0.5), Curve.constant(100.0))
    wave = Effect("late", (tone,)).wave(SIGNAL_HZ, 0.3)
    t = times_of(wave)
    first = np.flatnonzero(t >= 0.1)[0]
    is_on = (t >= 0.1) & (t < 0.2)
    assert wave[is_on] == pytest.approx(
        0.5 * np.sin(200.0 * np.pi * (t - t[first]))[is_on], abs=1e-9
    )
    assert np.all(wave[~is_on] == 0.0)


def test_an_envelope_is_what_it_says_at_200_points() -> None:
    tone = Tone(0.0, 0.5, RAMP, Curve.constant(150.0))
    samples = Effect("ramp", (tone,)).samples(SIGNAL_HZ)
    envelope = np.abs(signal.hilbert(samples))
    delay_s = 2.05e-3  # of the low-pass at 150 Hz
    for at in np.linspace(0.1, 0.45, 200):
        found = np.interp(at + delay_s, times_of(samples), envelope)
        assert abs(20.0 * np.log10(found / float(RAMP.at(np.array([at]))[0]))) < 0.25


def test_a_click_is_one_and_a_half_waves_under_a_hann_window() -> None:
    wave = Effect("click", (Click(0.01, 0.8, 160.0),)).wave(SIGNAL_HZ, 0.03)
    t = times_of(wave) - 0.01
    inside = (t >= 0.0) & (t <= 1.5 / 160.0)
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * t * 160.0 / 1.5)
    wanted = np.where(inside, 0.8 * window * np.sin(2.0 * np.pi * 160.0 * t), 0.0)
    assert wave == pytest.approx(wanted, abs=1e-9)


def test_the_low_pass_is_a_butterworth_s() -> None:
    """Four poles: |H|² = 1 / (1 + (f/250)⁸), frequencies bent as the bilinear transform does."""
    t = np.arange(20_000) / SIGNAL_HZ

    def bent(hz: float) -> float:
        return float(np.tan(np.pi * hz / SIGNAL_HZ))

    for hz in (60.0, 160.0, 250.0, 400.0):
        tone = np.sin(2.0 * np.pi * hz * t)
        gain = np.std(low_passed(tone, SIGNAL_HZ)[10_000:]) / np.std(tone[10_000:])
        assert gain == pytest.approx((1.0 + (bent(hz) / bent(250.0)) ** 8) ** -0.5, rel=2e-3)
    impulse = low_passed(np.eye(1, 200)[0], SIGNAL_HZ)
    assert np.abs(impulse[round(TAIL_S * SIGNAL_HZ) :]).max() < 1e-3 * np.abs(impulse).max()


def test_parts_add_up_and_are_made_quieter_together_where_they_are_too_much() -> None:
    low = Tone(0.0, 0.3, Curve.constant(0.9), Curve.constant(80.0))
    high = Tone(0.0, 0.3, Curve.constant(0.9), Curve.constant(130.0))
    both = Effect("both", (low, high)).samples(SIGNAL_HZ)
    one, other = (Effect("one", (part,)).samples(SIGNAL_HZ) for part in (low, high))
    assert np.abs(both).max() == pytest.approx(1.0)
    total = one + other
    assert both == pytest.approx(total / np.abs(total).max(), abs=1e-9)


def test_a_recording_is_played_at_its_own_rate() -> None:
    rate = 1000.0
    samples = np.sin(2.0 * np.pi * 50.0 * np.arange(400) / rate)
    wave = Effect("clip", (Clip(0.1, samples, rate),)).wave(SIGNAL_HZ, 0.5)
    t = times_of(wave)
    inside = (t > 0.1) & (t < 0.49)
    # Straight lines between samples 1 ms apart: (π 50/1000)²/2 below a crest.
    assert wave[inside] == pytest.approx(np.sin(2.0 * np.pi * 50.0 * (t[inside] - 0.1)), abs=0.013)
    assert np.all(wave[t < 0.1] == 0.0)


def test_noise_is_the_same_each_time_and_as_loud_as_it_says() -> None:
    noise = Effect("noise", (Noise(0.0, 2.0, Curve.constant(0.6)),))
    wave = noise.wave(SIGNAL_HZ, 1.9)
    assert np.array_equal(wave, noise.wave(SIGNAL_HZ, 1.9))
    assert np.std(wave) == pytest.approx(0.6 / np.sqrt(3.0), rel=0.03)
    assert np.abs(wave).max() <= 0.6


def test_shipped_effects_play_within_their_range() -> None:
    for effect in shipped_effects().values():
        samples = effect.samples(SIGNAL_HZ)
        assert 0.3 < np.abs(samples).max() <= 1.0, effect.name
        assert abs(samples[-1]) < 0.02, effect.name


def test_a_flattened_tone_is_as_loud_at_every_frequency() -> None:
    """Through a place that gives 6 dB more from 100 Hz to 250 Hz."""
    hz = np.linspace(20.0, 600.0, 60)
    level = 10.0 ** (np.clip((hz - 100.0) / 150.0, 0.0, 1.0) * 6.0 / 20.0)
    t = np.arange(20_000) / SIGNAL_HZ
    heard = []
    for tone in (60.0, 120.0, 160.0, 220.0):
        out = flattened(0.3 * np.sin(2.0 * np.pi * tone * t), SIGNAL_HZ, hz, level, 160.0)
        heard.append(np.std(out[10_000:]) * np.interp(tone, hz, level))
    assert 20.0 * np.log10(np.array(heard) / heard[2]) == pytest.approx(0.0, abs=0.3)


@pytest.mark.parametrize(
    ("times", "values"),
    [((), ()), ((0.0, 1.0), (1.0,)), ((1.0, 0.5), (0.0, 1.0)), ((0.0,) * (MOST_POINTS + 1),) * 2],
)
def test_curves_that_are_none_are_refused(
    times: tuple[float, ...], values: tuple[float, ...]
) -> None:
    with pytest.raises(InputError, match="points"):
        Curve(times, values)


def test_an_effect_of_an_hour_is_refused() -> None:
    with pytest.raises(InputError, match="600 s at most"):
        Effect("long", (Click(3600.0, 1.0, 160.0),)).samples(SIGNAL_HZ)


def test_a_flattened_effect_is_as_loud_at_every_frequency() -> None:
    """A place that has more the higher it goes: what a tone's moment has there is one level."""
    hz = np.linspace(2.0, 400.0, 40)
    level = 1.0 + (hz / 150.0) ** 2
    sweep = shipped_effects()["sweep"]
    flat, left_out = flattened_effect(sweep, SIGNAL_HZ, hz, level, 160.0)
    assert left_out == []
    (tone,) = flat.parts
    (own,) = sweep.parts
    assert isinstance(tone, Tone)
    assert isinstance(own, Tone)
    times = np.linspace(0.06, 0.94, 200)
    played = tone.amplitude.at(times) * np.interp(tone.frequency_hz.at(times), hz, level)
    wanted = own.amplitude.at(times) * np.interp(160.0, hz, level)
    # Straight lines 10 Hz apart, of a level that bends.
    np.testing.assert_allclose(played, wanted, rtol=0.004)
    kept = pack_bank(Bank("b", {"sweep": flat}))
    assert len(kept) < 220


def test_flattening_leaves_noise_and_makes_clips_of_clicks() -> None:
    hz = np.array([10.0, 400.0])
    both = Effect("both", (*shipped_effects()["click"].parts, *shipped_effects()["texture"].parts))
    flat, left_out = flattened_effect(both, SIGNAL_HZ, hz, np.array([1.0, 1.0]), 160.0)
    click, noise = flat.parts
    assert isinstance(click, Clip)
    assert noise == both.parts[1]
    assert left_out == ["noise at 0 s, which stays as it is"]
    # Of a place that is flat it is what it was.
    own = both.parts[0].wave(np.arange(len(click.samples)) / SIGNAL_HZ)
    np.testing.assert_allclose(click.samples, own, atol=2e-3)


def test_points_of_a_curve_with_steps_are_its_own() -> None:
    steps = Curve((0.0, 0.05, 0.05, 0.1), (1.0, 1.0, 0.2, 0.2))
    tone = Tone(0.0, 0.1, steps, Curve.constant(100.0))
    assert tone.points_of(steps) == [(0.0, 1.0), (0.05, 1.0), (0.05, 0.2), (0.1, 0.2)]
    assert tone.points_of(steps, [0.02, 0.05]) == [
        (0.0, 1.0),
        (0.02, 1.0),
        (0.05, 1.0),
        (0.05, 0.2),
        (0.1, 0.2),
    ]
