"""Envelopes and what follows a lift-up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.host.emulation.emulator import TouchEvent, emulate
from chladni.tables.table import Limits
from made_up import device_of, make_table

FLAT = replace(make_table(np.array([[10.0]])), limits=Limits(4_000, 60_000, 5_000_000))


def levels(touches: list[TouchEvent], milliseconds: float, **settings: int) -> NDArray[np.float64]:
    """Loudness, a share of full amplitude, in every wave of 6.25 ms."""
    recording = emulate(device_of(FLAT), FLAT, touches, milliseconds, level=0.8, **settings)
    duties = recording.duty_steps[:, 0].astype(float)
    wave = round(recording.carrier_hz / 160.0)
    waves = duties[: duties.size // wave * wave].reshape(-1, wave)
    return np.asarray(np.ptp(waves, axis=1) / 2.0 / 509.0)


def at(level: NDArray[np.float64], milliseconds: float) -> float:
    return float(level[int(milliseconds / 6.25)])


def test_attack_decay_sustain_release() -> None:
    touches = [TouchEvent(10.0, (0.0, 0.0)), TouchEvent(500.0, None)]
    level = levels(touches, 800.0, attack_ms=100, decay_ms=200, sustain_q15=16384, release_ms=150)
    # Up in a straight line, down to a half, held, and away; a wave, a report and a step of slack.
    assert at(level, 60.0) == pytest.approx(0.4, abs=0.08)
    assert level.max() == pytest.approx(0.8, abs=0.02)
    assert at(level, 215.0) == pytest.approx(0.6, abs=0.05)
    assert at(level, 450.0) == pytest.approx(0.4, abs=0.01)
    assert at(level, 585.0) == pytest.approx(0.2, abs=0.04)
    assert at(level, 690.0) == 0.0


def test_without_settings_the_tables_ramp_is_all_there_is() -> None:
    level = levels([TouchEvent(10.0, (0.0, 0.0)), TouchEvent(200.0, None)], 300.0)
    assert at(level, 100.0) == pytest.approx(0.8, abs=0.01)
    assert at(level, 190.0) == pytest.approx(0.8, abs=0.01)
    assert at(level, 230.0) == 0.0


def test_a_pulse_follows_the_lift_up() -> None:
    touches = [TouchEvent(10.0, (0.0, 0.0)), TouchEvent(200.0, None)]
    level = levels(touches, 500.0, lift_pulse_ms=100, lift_level_q15=9830)
    assert at(level, 180.0) == pytest.approx(0.8, abs=0.01)
    assert at(level, 260.0) == pytest.approx(0.3, abs=0.01)
    assert at(level, 340.0) == 0.0


def test_a_drive_may_follow_the_finger_or_stay() -> None:
    table = replace(
        make_table(np.array([[10.0], [5.0]]), 2, 1), limits=Limits(4_000, 60_000, 5_000_000)
    )
    touches = [TouchEvent(10.0, (-30.0, 0.0)), TouchEvent(100.0, (30.0, 0.0))]
    for on_move, expected in ((0, 0.4), (1, 0.8)):
        recording = emulate(device_of(table), table, touches, 200.0, on_move=on_move)
        tail = recording.duty_steps[-2000:, 0].astype(float)
        assert np.ptp(tail) / 2.0 / 509.0 == pytest.approx(expected, abs=0.01)
