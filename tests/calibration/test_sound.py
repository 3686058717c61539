"""Foam, forces and faults by ear: what is heard of coils' sweeps, and recordings that are none."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
from numpy.typing import NDArray
from scipy.io import wavfile

from calibration.small_board import small_board
from chladni.calibration import fit_sound, heard_coils, hidden_plate, recorder, sweep_duties
from chladni.calibration.hearing import sound, turns_of
from chladni.calibration.recorder import AIR, RATE_HZ, record_hidden
from chladni.calibration.sweep import (
    DAMPING,
    FROM_HZ,
    LEVEL,
    PAUSE,
    SECONDS,
    TO_HZ,
    HeardCoils,
    sweep_frequencies,
    sweep_wave,
)
from chladni.drives.scoring.tolerances import with_foam
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Spring
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


def test_what_is_heard_is_what_a_filter_lets_through(board: Board) -> None:
    """Whose gain is known, wherever the sweeps begin; all coils are late alike.

    The third has a resonance that rings for a second, and is heard to die away sooner.
    """
    wave = sweep_wave(RATE_HZ)
    slot = wave.size + round(PAUSE * RATE_HZ)
    samples = np.zeros(round(0.43 * RATE_HZ) + 3 * slot)

    def gains(hertz: NDArray[Any]) -> NDArray[Any]:
        low = 1.0 / (1.0 + hertz / 300.0)
        rings = 1.0 / (1.0 + hertz / 420.0 * (1e-3 + hertz / 420.0))
        return np.stack((low, 2.0 * low, rings))

    spectrum: NDArray[Any] = np.fft.rfft(wave, 2 * slot)
    through = np.fft.irfft(spectrum * gains(1j * np.fft.rfftfreq(2 * slot, 1.0 / RATE_HZ)))
    for coil in range(3):
        begin = round(0.43 * RATE_HZ) + coil * slot
        samples[begin : begin + slot] += through[coil, :slot]
    samples += 1e-4 * np.random.default_rng(1).standard_normal(samples.size)
    values = heard_coils(samples, RATE_HZ, 3).values
    gain = gains(sweep_frequencies() * (1j + DAMPING))
    assert np.abs(values[0] / gain[0]) == pytest.approx(1.0, rel=0.03)
    for coil in (1, 2):
        own, most = values[coil] / values[0] * gain[0], np.abs(gain[coil]).max()
        assert own == pytest.approx(gain[coil], abs=0.02 * most)


def test_damped_sound_is_that_of_what_dies_away_sooner(board: Board) -> None:
    """A rational function through what is heard without damping tells it off the axis."""
    hz = np.geomspace(60.0, 900.0, 90)
    axis = sound(board, hz)
    few = hz[20:70:10]
    damped = sound(board, few, damping=DAMPING)
    for own, true in zip(axis, damped, strict=True):
        beside = scipy.interpolate.AAA(1j * hz, own, rtol=1e-6)(few * (1j + DAMPING))
        assert beside == pytest.approx(true, rel=0.01)


def test_a_plate_that_rings_long_is_recorded_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """`paper` has no losses: splines through what is solved made another plate of it.

    Coils beside one another. What still rings of one coil's sweep in the next one's turn is up to a
    tenth. Splines leave 0.16.
    """
    monkeypatch.setattr(recorder, "NOISE_DB", 80.0)
    paper = load_board("paper")
    hidden = hidden_plate(paper, 3)
    count = len(paper.actuators)
    heard = heard_coils(*record_hidden(hidden), count).values
    true = hidden.forces[:, None] * sound(hidden.board, sweep_frequencies(), damping=DAMPING + AIR)
    # A microphone's response is the same for all coils, and clocks that differ turn phases alone.
    shares = [np.abs(own) / np.linalg.norm(own, axis=0) for own in (heard, true)]
    assert shares[0] == pytest.approx(shares[1], abs=0.12)


def test_a_stiffer_foundation_rings_higher(board: Board) -> None:
    """Even foam under a free plate without magnets: as one mass on a spring, by √k."""
    hz = np.geomspace(40.0, 2000.0, 60)
    peaks = [
        float(hz[np.argmax(np.abs(sound(with_foam(board, factor), hz)).sum(axis=0) / hz**1.0)])
        for factor in (1.0, 4.0)
    ]
    assert peaks[1] / peaks[0] == pytest.approx(2.0, rel=0.15)


@pytest.mark.parametrize("seed", SEEDS)
def test_foam_forces_and_faults_are_found_by_ear(board: Board, seed: int) -> None:
    """Two clocks are up to 40e-6 apart, which turns the sixth coil by 500 degrees at 2 kHz."""
    hidden = hidden_plate(board, seed)
    strengths = hidden.strengths.copy()
    strengths[[1, 2, 4]] *= (-1.0, 0.5, 0.0)
    plate = dataclasses.replace(hidden, strengths=strengths)
    samples, rate = record_hidden(plate)
    heard = fit_sound(board, heard_coils(samples, rate, 6))
    foam = hidden.board.foundation
    assert foam is not None
    true = foam.measured_ratio * np.exp(np.mean(np.log([own.ratio for own in foam.patches])))
    found = next(own for own in heard.parameters if own.name == "foam")
    assert found.told
    # The drawn foam is off by up to a factor of four.
    assert found.value == pytest.approx(true, rel=0.3)
    assert found.low < true < found.high
    assert heard.board.foundation is not None
    assert heard.board.foundation.measured_ratio == pytest.approx(found.value)
    assert heard.board.foundation.patches == ()
    assert heard.wiring.signs.tolist() == np.sign(strengths).tolist()
    lives = strengths != 0.0
    own = np.array([own.strength for own in heard.board.actuators])
    ratios = np.abs(own[lives] / strengths[lives])
    # How loud a microphone is no one knows: forces are told beside each other.
    assert ratios / np.median(ratios) == pytest.approx(1.0, abs=0.35)


@pytest.mark.parametrize("end", [0, 5])
def test_a_dead_coil_at_an_end_is_no_other(board: Board, end: int) -> None:
    """No recording says when the first coil's turn was: plate 10 of `prototype`, its first coil
    dead, was told as one whose last coil is, and nothing came back."""
    hidden = hidden_plate(board, 1)
    strengths = hidden.strengths.copy()
    strengths[end] = 0.0
    samples, rate = record_hidden(dataclasses.replace(hidden, strengths=strengths))
    heard = fit_sound(board, heard_coils(samples, rate, 6))
    assert heard.wiring.signs.tolist() == np.sign(strengths).tolist()


def test_where_an_end_is_silent_its_turn_may_be_the_other_ends() -> None:
    """And nowhere else: a coil in the middle that is silent has its turn between others."""
    values = np.diag([1.0, 2.0, 3.0, 4.0]).astype(np.complex128)
    for silent, turned in ((0, -1), (3, 1), (1, None)):
        own = values * (np.arange(4) != silent)[:, None]
        one, *others = turns_of(HeardCoils(own, np.zeros(4), 1.0))
        assert np.array_equal(one.values, own)
        assert len(others) == (turned is not None)
        if turned is not None:
            assert np.array_equal(others[0].values, np.roll(own, turned, axis=0))
            assert not others[0].values[0 if silent else -1].any()


def test_clocks_that_differ_are_told_from_another_plate() -> None:
    """Plate 2 of `prototype` is heard with clocks 38e-6 apart. With another difference the true
    plate would leave 0.4 unexplained, and one with a sheet 6 % too thick as much."""
    prototype = load_board("prototype")
    hidden = hidden_plate(prototype, 2)
    found = fit_sound(prototype, heard_coils(*record_hidden(hidden), len(prototype.actuators)))
    assert found.left < 0.15
    truth = hidden.board.plate.thickness / prototype.plate.thickness
    assert found.board.plate.thickness / prototype.plate.thickness == pytest.approx(truth, abs=0.03)


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
            heard_coils(given, rate, 6)
    with pytest.raises(InputError, match="samples a second"):
        heard_coils(samples, 1000.0, 6)
    # Twice the coils are not there.
    with pytest.raises(InputError, match="sweeps of all coils"):
        heard_coils(samples, rate, 12)


def test_what_is_clipped_a_little_is_refused_and_what_is_quiet_is_not(board: Board) -> None:
    """By 0.9 dB at both ends or at one, with 16 bits; and all of it in 60 steps."""
    samples, rate = record_hidden(hidden_plate(board, SEEDS[0]))
    loudest = np.abs(samples).max()
    for steps in (30, 16_000):
        heard_coils(np.round(steps * samples / loudest), rate, 6)
    most = 10.0 ** (-0.9 / 20.0) * loudest
    for lowest in (-most, -loudest):
        clipped = np.round(32_000.0 * np.clip(samples, lowest, most))
        with pytest.raises(InputError, match="clipped"):
            heard_coils(clipped, rate, 6)


@pytest.mark.parametrize("on_feet", [True, False])
def test_boards_on_feet_and_on_nothing_are_found_by_ear(board: Board, *, on_feet: bool) -> None:
    """Of their sound through a room that is the same for all coils."""
    places = [(x, y) for x in (-26e-3, 26e-3) for y in (-28e-3, 28e-3)]
    feet = tuple(Spring(at, 8e3, loss_factor=0.1) for at in places) if on_feet else ()
    drawn = dataclasses.replace(board, foundation=None, springs=feet)
    hidden = hidden_plate(drawn, 4)
    room = np.exp(0.2j * np.arange(sweep_frequencies().size))
    values = hidden.strengths[:, None] * sound(hidden.board, sweep_frequencies()) * room
    noise = np.full(room.size, 1e-6 * np.mean(np.abs(values) ** 2))
    found = fit_sound(drawn, HeardCoils(values, noise, SECONDS))
    assert found.wiring.signs.tolist() == np.sign(hidden.strengths).tolist()
    forces = np.array([own.strength for own in found.board.actuators])
    # By ear coils are told beside each other: all of them together are believed to be as drawn.
    ratios = forces / hidden.strengths
    assert ratios / np.median(ratios) == pytest.approx(1.0, abs=0.1)
    true = {
        key: own for key, own in hidden.ratios(drawn).items() if key.startswith(("feet", "foot"))
    }
    told = {own.name: own for own in found.parameters if own.name in true}
    assert len(told) == (5 if on_feet else 0)
    for key, foot in told.items():
        assert foot.told
        assert foot.low < true[key] < foot.high
        # Four plates on these feet, recorded, had all feet within 9 %.
        assert foot.value == pytest.approx(true[key], rel=0.12)
    if on_feet:
        assert max(true.values()) / min(true.values()) > 1.2
        loose = _with_loose_foot(hidden.board, 0.07)
        values = hidden.strengths[:, None] * sound(loose, sweep_frequencies()) * room
        with pytest.raises(InputError, match="Does each foot touch"):
            fit_sound(drawn, HeardCoils(values, noise, SECONDS))


def _with_loose_foot(board: Board, share: float) -> Board:
    first, *others = board.springs
    loose = dataclasses.replace(first, stiffness=share * first.stiffness)
    return dataclasses.replace(board, springs=(loose, *others))


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
    (foam,) = [own for own in done.json["parameters"] if own["name"] == "foam"]
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
