"""A bridge's duties as the sample interrupt rounds them: their ceiling, and what a turn leaves."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.host.emulation._emulator import Synthesis
from chladni.host.emulation.demodulate import PURITY_PERIODS, Play, edge_sfdr_db, sfdr_db
from chladni.host.emulation.emulator import Recording

CARRIER_HZ = 78_125.0
LOST_STEPS = 3
"""40 ns in steps of 12.5."""


@pytest.mark.parametrize(("max_duty_q15", "most"), [(0, 0), (96, 0), (320, 9), (3200, 99)])
def test_a_ceiling_of_duty_holds_though_what_is_lost_is_given_back(
    max_duty_q15: int, most: int
) -> None:
    """In steps of 32 and one below: three are lost, so a ceiling of three lets no pulse through."""
    alone = Synthesis(
        full_current_ma=[100], has_bridges=True, lost_steps=LOST_STEPS, max_duty_q15=max_duty_q15
    )
    alone.play([(32767, 0)], 32767, 4000, True)
    duties = np.asarray(alone.run(4000))
    assert (duties.min(), duties.max()) == (-most, most)


@pytest.mark.parametrize("level_db", [-12.0, -24.0])
def test_a_turn_leaves_no_trace_in_the_rounding(level_db: float) -> None:
    """A step's half that changed its sign with the current would leave -82 dB (-24 dB)."""
    alone = Synthesis(full_current_ma=[100], has_bridges=True, lost_steps=LOST_STEPS)
    alone.play([(round(32767 * 10.0 ** (level_db / 20.0)), 0)], 32767, 4000, True)
    duties = np.asarray(alone.run(67_000), float)[-65_536:, 0]
    duties -= LOST_STEPS * np.sign(duties)
    spectrum = np.abs(np.fft.rfft(duties * np.blackman(len(duties))))
    hertz = np.arange(len(spectrum)) * 80e6 / 4096 / len(duties)
    wave, third = (spectrum[np.abs(hertz - at) < 1.5].max() for at in (160.0, 480.0))
    assert 20.0 * np.log10(third / wave) < -100.0
    noise = (hertz > 20.0) & (hertz < 1000.0) & (np.abs(hertz - 160.0) > 3.0)
    beside = np.sum(spectrum[noise] ** 2) / np.sum(spectrum[np.abs(hertz - 160.0) < 3.0] ** 2)
    assert -10.0 * np.log10(beside) > 70.0


@pytest.mark.parametrize("is_new_touch", [True, False])
@pytest.mark.parametrize("lost_steps", [0, LOST_STEPS, 8])
def test_a_channel_without_a_gain_has_no_pulse(is_new_touch: bool, lost_steps: int) -> None:
    """Whichever way its bridge was left, not even one as long as what is lost of a pulse.

    What plays beside it, and what it plays itself in a new touch, begins alike each time.
    """
    begun = set()
    for samples in range(200, 322, 3):  # a wave has 122
        alone = Synthesis(full_current_ma=[100] * 3, has_bridges=True, lost_steps=lost_steps)
        alone.play([(20_000, 9000), (32_767, 0), (-9000, 3)], 32_767, 4000, True)
        alone.run(samples)
        if is_new_touch:
            alone.release(4000)
            alone.run(300)
        alone.play([(30_000, 0), (0, 0), (0, -30_000)], 32_767, 4000, is_new_touch)
        ramp, rest = alone.run(100), alone.run(6000)
        assert np.abs(rest[:, 1]).max() == 0, samples
        assert rest.max(axis=0)[0] > 900
        begun.add(ramp.tobytes())
        if is_new_touch:
            assert np.abs(ramp[:, 1]).max() == 0, samples
    assert len(begun) == 1 or not is_new_touch


@pytest.mark.parametrize("level_db", [0.0, -20.0])
def test_purity_of_a_bridge_is_that_of_its_pulses(level_db: float) -> None:
    """Summed up pulse by pulse: by symmetry a bridge has no second harmonic, but a third."""
    alone = Synthesis(full_current_ma=[100], has_bridges=True, lost_steps=LOST_STEPS)
    alone.play([(round(32767 * 10.0 ** (level_db / 20.0)), 0)], 32767, 4000, True)
    periods = PURITY_PERIODS + 4000
    steps = np.repeat(np.asarray(alone.run(periods // 4)), 4, axis=0)
    recording = Recording(steps.astype(np.int16), CARRIER_HZ, 10)
    play = Play(4000, len(steps))
    found = sfdr_db(recording, play, 160.0, lost_steps=LOST_STEPS)
    assert found[0] is not None
    assert found[0] > 88.0
    (edges,) = edge_sfdr_db(recording, play, 160.0, lost_steps=LOST_STEPS)
    duty = (steps[-PURITY_PERIODS:, 0] - LOST_STEPS * np.sign(steps[-PURITY_PERIODS:, 0])) / 1024.0
    begins = np.arange(PURITY_PERIODS)
    window = np.hanning(PURITY_PERIODS)
    sizes = {}
    for harmonic in (1, 2, 3):
        turn = 2.0 * np.pi * 160.0 * harmonic / CARRIER_HZ
        pulses = np.sign(duty) * (1.0 - np.exp(-1j * turn * np.abs(duty))) / (1j * turn)
        sizes[harmonic] = abs(np.sum(window * pulses * np.exp(-1j * turn * begins)))
    assert 20.0 * np.log10(sizes[2] / sizes[1]) < -90.0
    assert edges == pytest.approx(20.0 * np.log10(sizes[1] / sizes[3]), abs=0.1)
