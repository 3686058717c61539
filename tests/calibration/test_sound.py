"""Foam by ear: the sweep that coils play, what is heard of it, and recordings that are none."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from calibration.small_board import small_board
from chladni.calibration import fit_sound, heard_levels, hidden_plate, sweep_duties
from chladni.calibration.hearing import sound
from chladni.calibration.recorder import RATE_HZ, record_hidden
from chladni.calibration.sweep import (
    FROM_HZ,
    LEVEL,
    PAUSE,
    SECONDS,
    TO_HZ,
    sweep_frequencies,
    sweep_wave,
)
from chladni.drives.scoring.tolerances import with_foam
from chladni.sim.board.board import Board
from chladni.sim.board.writing import board_file
from chladni.sim.errors import InputError
from conftest import CommandLine

SEEDS = (2, 3)


@pytest.fixture(scope="module")
def board() -> Board:
    return small_board()


def test_every_coil_sweeps_in_turn_from_low_to_high(board: Board) -> None:
    rate = 9765.625
    times = np.arange(round(6 * (SECONDS + PAUSE) * rate)) / rate
    duties = sweep_duties(board, times)
    assert duties.shape == (times.size, 6)
    assert duties.min() >= 0.0
    assert duties.max() == pytest.approx(LEVEL, abs=1e-3)
    assert ((duties > 0.0).sum(axis=1) <= 1).all()
    own = duties[:, 2]
    on = np.flatnonzero(own > 0.0) / rate
    assert on[0] == pytest.approx(2 * (SECONDS + PAUSE), abs=0.01)
    assert on[-1] == pytest.approx(2 * (SECONDS + PAUSE) + SECONDS, abs=0.01)
    # Zero crossings of the sine: half a period apart, at the ends of the sweep.
    wave = sweep_wave(50_000.0)
    crossings = np.flatnonzero(np.diff(np.sign(wave[1:-1]))) / 50_000.0
    assert 0.5 / np.diff(crossings[:3]).mean() == pytest.approx(FROM_HZ, rel=0.03)
    assert 0.5 / np.diff(crossings[-8:]).mean() == pytest.approx(TO_HZ, rel=0.03)


def test_levels_are_those_of_a_filter(board: Board) -> None:
    """Of a recording that went through one whose gain is known, wherever the sweeps begin."""
    wave = sweep_wave(RATE_HZ)
    slot = wave.size + round(PAUSE * RATE_HZ)
    samples = np.zeros(round(0.43 * RATE_HZ) + 3 * slot)
    for coil in range(3):
        begin = round(0.43 * RATE_HZ) + coil * slot
        spectrum = np.fft.rfft(wave, 2 * slot)
        hertz = np.fft.rfftfreq(2 * slot, 1.0 / RATE_HZ)
        through = np.fft.irfft(spectrum * (coil + 1) / (1.0 + 1j * hertz / 300.0))[:slot]
        samples[begin : begin + slot] += through
    samples += 1e-4 * np.random.default_rng(1).standard_normal(samples.size)
    levels = heard_levels(samples, RATE_HZ, 3)
    hz = sweep_frequencies()
    for coil in range(3):
        gain = (coil + 1) / np.sqrt(1.0 + (hz / 300.0) ** 2)
        assert levels[coil] == pytest.approx(20.0 * np.log10(gain), abs=0.3)


def test_a_stiffer_foundation_rings_higher(board: Board) -> None:
    """Even foam under a free plate without magnets: as one mass on a spring, by √k."""
    hz = np.geomspace(40.0, 2000.0, 60)
    peaks = [
        float(hz[np.argmax(np.abs(sound(with_foam(board, factor), hz)).sum(axis=0) / hz**1.0)])
        for factor in (1.0, 4.0)
    ]
    assert peaks[1] / peaks[0] == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize("seed", SEEDS)
def test_foam_is_found_by_ear(board: Board, seed: int) -> None:
    hidden = hidden_plate(board, seed)
    samples, rate = record_hidden(hidden)
    heard = fit_sound(board, heard_levels(samples, rate, 6))
    foam = hidden.board.foundation
    assert foam is not None
    true = foam.measured_ratio * np.exp(np.mean(np.log([own.ratio for own in foam.patches])))
    assert heard.parameter.name == "foam"
    assert heard.parameter.told
    # The drawn foam is off by up to a factor of four.
    assert heard.parameter.value == pytest.approx(true, rel=0.3)
    assert heard.board.foundation is not None
    assert heard.board.foundation.measured_ratio == pytest.approx(heard.parameter.value)


def test_recordings_of_no_sweep_are_refused(board: Board) -> None:
    samples, rate = record_hidden(hidden_plate(board, 1))
    noise = np.random.default_rng(2).standard_normal(samples.size)
    for given, said in (
        (np.zeros(samples.size), "silence"),
        (samples[: samples.size // 2], "sweeps of all coils"),
        (noise, "no sweeps"),
        (np.clip(20.0 * samples, -1.0, 1.0), "clipped"),
        (samples + 30.0 * noise * samples.std(), "sweeps"),
    ):
        with pytest.raises(InputError, match=said):
            heard_levels(given, rate, 6)
    with pytest.raises(InputError, match="samples a second"):
        heard_levels(samples, 1000.0, 6)
    # Twice the coils are not there.
    with pytest.raises(InputError, match="sweeps of all coils"):
        heard_levels(samples, rate, 12)


def test_a_board_that_nothing_holds_has_no_such_sound(board: Board) -> None:
    free = dataclasses.replace(board, foundation=None)
    with pytest.raises(InputError, match="on foam or on screws"):
        fit_sound(free, np.zeros((6, sweep_frequencies().size)))


def test_a_recording_is_calibrated_with(board: Board, chladni: CommandLine, tmp_path: Path) -> None:
    drawn, wav, output = tmp_path / "small.toml", tmp_path / "s.wav", tmp_path / "o.toml"
    drawn.write_bytes(board_file(board))
    samples, rate = record_hidden(hidden_plate(board, 2))
    both = np.stack((samples, np.zeros(samples.size)), axis=1)
    wavfile.write(wav, int(rate), (32000 * both).astype(np.int16))
    done = chladni(
        "calibrate", "--board", drawn, "--recording", wav, "-o", output, "--sets", "6", "--json"
    )
    assert done.code == 0, done.err
    (foam,) = done.json["parameters"]
    assert foam["low"] < 3.74 < foam["high"]
    assert done.json["by"] == "a recording, s.wav"
    assert (
        done.json["after"]["fingers_2_db"]["median"] > done.json["before"]["fingers_2_db"]["median"]
    )
    output.unlink()
    bad = tmp_path / "bad.wav"
    bad.write_bytes(wav.read_bytes()[:30])
    here = ("calibrate", "--board", drawn, "-o", output)
    for arguments, said in (
        (("--recording", bad), "a WAV file"),
        (("--recording", drawn), "a WAV file"),
        (("--recording", wav, "--hidden", "1"), "--hidden"),
        (("--recording", wav, "--emulator"), "--emulator"),
        (("--recording", tmp_path / "none.wav"), "none.wav"),
    ):
        refused = chladni(*map(str, (*here, *arguments)))
        assert refused.code == 2, (arguments, refused.err)
        assert said in refused.err
    assert not output.exists()
