"""A bridge's duties as the sample interrupt rounds them: their ceiling, and what a turn leaves."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.host.emulation._emulator import Synthesis

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
