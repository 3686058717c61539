"""The coil actuator: the paper's four statements, and limits with closed forms."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Coil
from chladni.sim.coil.actuator import (
    acceleration_per_volt,
    correlation,
    force_per_volt,
    motion,
    wave_response,
)
from chladni.sim.coil.waveforms import WAVEFORMS, Waveform, harmonics, synthesise
from chladni.sim.fields.transfer import transfer_fields
from chladni.sim.image.energy import compose

SWEEP = np.linspace(100.0, 400.0, 301)


@pytest.fixture
def coil(prototype: Board) -> Coil:
    assert prototype.coil is not None
    return prototype.coil


@pytest.mark.parametrize(
    ("waveform", "shape"),
    [
        ("sine", lambda t: np.sqrt(2.0) * np.sin(2 * np.pi * t)),
        ("square", lambda t: np.where(t < 0.5, 1.0, -1.0)),
        ("triangle", lambda t: np.sqrt(3.0) * (1 - 4 * np.abs((t - 0.25 + 0.5) % 1 - 0.5))),
        ("ramp", lambda t: np.sqrt(3.0) * ((2 * t + 1) % 2 - 1)),
    ],
)
def test_series_sum_to_their_waves(waveform: Waveform, shape: object) -> None:
    """Away from jumps, where a series rings, 999 harmonics are within a percent."""
    assert callable(shape)
    t = np.arange(1000) / 1000.0
    summed = synthesise(harmonics(waveform, 999), 2000)[::2]
    smooth = np.minimum(np.abs(t - 0.5), np.minimum(t, 1.0 - t)) > 0.03
    assert np.abs(summed - shape(t))[smooth].max() < 0.02
    assert np.sum(np.abs(harmonics(waveform, 20000)) ** 2) / 2.0 == pytest.approx(1.0, abs=1e-3)


def test_every_wave_peaks_at_the_resonance(coil: Coil) -> None:
    """Statement 1: at 160 Hz, within the pull of damping and inductance (a few tenths)."""
    for waveform in WAVEFORMS:
        response = wave_response(coil, waveform, SWEEP)
        assert SWEEP[response.fundamental.argmax()] == pytest.approx(160.0, abs=2.0)


def test_near_resonance_every_wave_becomes_a_sine(coil: Coil) -> None:
    """Statement 2: least distorted there, and far less than the drive itself."""
    for waveform in ("triangle", "square", "ramp"):
        drive = np.abs(harmonics(waveform, 199))
        own = np.sqrt(np.sum(drive[1:] ** 2)) / drive[0]
        response = wave_response(coil, waveform, SWEEP)
        at = int(np.argmin(np.abs(SWEEP - 160.0)))
        assert response.distortion[at] < 0.15 * own
        assert abs(SWEEP[response.distortion.argmin()] - 160.0) < 5.0


def test_sine_is_strongest_in_the_fundamental(coil: Coil) -> None:
    """Statement 3, for waves of one RMS voltage; ratios are those of the Fourier series."""
    sine = wave_response(coil, "sine", SWEEP).fundamental
    for waveform, ratio in (("triangle", 0.9928), ("square", 0.9003), ("ramp", 0.7797)):
        other = wave_response(coil, waveform, SWEEP).fundamental  # type: ignore[arg-type]
        assert other / sine == pytest.approx(np.full(SWEEP.size, ratio), abs=1e-4)


def test_far_above_resonance_the_acceleration_follows_the_drive(coil: Coil) -> None:
    """Statement 4: correlation rises above resonance; acceleration over force tends to 1/m."""
    for waveform in ("triangle", "square", "ramp"):
        response = wave_response(coil, waveform, SWEEP)
        at = int(np.argmin(np.abs(SWEEP - 160.0)))
        assert response.correlation[-1] > 0.97
        assert response.correlation[-1] > response.correlation[at]
    high = np.array([5000.0])
    ratio = acceleration_per_volt(coil, high) / force_per_volt(coil, high)
    assert coil.latch is not None
    assert ratio[0] == pytest.approx(1.0 / coil.latch.moving_mass, rel=5e-3)


def test_blocked_force_is_the_coils_alone(coil: Coil) -> None:
    """BL/(R + iωL); without a force factor nothing is induced and both agree."""
    blocked = force_per_volt(coil, SWEEP, blocked=True)
    omega = 2.0 * np.pi * SWEEP
    assert blocked == pytest.approx(
        coil.force_factor / (coil.resistance + 1j * omega * coil.inductance)
    )
    weak = dataclasses.replace(coil, force_factor=1e-4)
    assert force_per_volt(weak, SWEEP) == pytest.approx(
        force_per_volt(weak, SWEEP, blocked=True), rel=1e-4
    )


def test_motion_is_what_the_harmonics_say(coil: Coil) -> None:
    """RMS of one period in time against the sum over harmonics (Parseval)."""
    series = motion(coil, "square", 250.0, 4096)
    response = wave_response(coil, "square", np.array([250.0]))
    assert np.sqrt(np.mean(series**2)) == pytest.approx(response.rms[0], rel=1e-9)


def test_correlation_knows_shapes_and_forgets_delays() -> None:
    square, ramp = harmonics("square", 99), harmonics("ramp", 99)
    late = square * np.exp(-1j * 0.7 * np.arange(1, 100))
    assert correlation(square, late) == pytest.approx(1.0, abs=1e-3)
    assert correlation(square, ramp) < 0.9


def test_coil_and_plate_combine(prototype: Board, coil: Coil) -> None:
    """Volts to metres: the blocked force times the plate's field, linear in the voltage."""
    fields = transfer_fields(prototype).values
    force = force_per_volt(coil, np.array([160.0]), blocked=True)[0]
    volts = np.array([1.0, 0.0, 0.5j, 0.0, 0.0])
    moved = compose(fields, volts * force)
    assert moved == pytest.approx(force * compose(fields, volts))
    assert 1e-9 < np.abs(moved).max() < 1e-3
