"""Every method against what is known of it: certificates, closed forms, the naive algorithm."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from skimage.metrics import structural_similarity

from chladni.drives.methods import METHODS, Found, Options
from chladni.drives.methods.anneal import anneal, phasors, read_trace
from chladni.drives.methods.least_squares import damped
from chladni.drives.problem.problem import Problem, solved_board
from chladni.drives.scoring.scorecard import null_models, score_on
from chladni.drives.solve import solve, solve_problem
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError
from chladni.sim.image import metrics
from chladni.sim.image.energy import normalised

TARGET = (10.0, 25.0)
QUICK = Options(steps=200)


@pytest.fixture(scope="module")
def problem(prototype: Board) -> Problem:
    return solved_board(prototype).problem(TARGET)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_beats_silence_and_keeps_the_limits(problem: Problem, method: str) -> None:
    solution = solve_problem(problem, method, QUICK)
    card = score_on(problem, solution.field, null_models(problem))
    assert card.ssim > card.nulls.silent
    assert card.contrast_db <= card.contrast_limit_db + 1e-9
    assert np.abs(solution.drive).max() == pytest.approx(problem.board.drive.max_gain)
    assert solution.evaluations >= 1


@pytest.mark.parametrize("method", [name for name in METHODS if name != "phasor"])
def test_no_method_beats_the_default(problem: Problem, method: str) -> None:
    best = solve_problem(problem, "phasor", Options()).ssim
    assert solve_problem(problem, method, QUICK).ssim <= best + 1e-6


def test_the_eigenvalue_bounds_every_drive(problem: Problem) -> None:
    """The certificate: no random drive, and no other objective, has more contrast."""
    limit, drive = problem.contrast
    rng = np.random.default_rng(4)
    tried = rng.normal(size=(300, 5)) + 1j * rng.normal(size=(300, 5))
    near = drive + 0.02 * np.abs(drive).max() * tried
    for c in [*tried, *near]:
        field = np.tensordot(c, problem.transfer, axes=1)
        assert metrics.contrast_db(field, problem.disc) <= limit + 1e-9
    reached = solve_problem(problem, "contrast", Options())
    assert metrics.contrast_db(reached.field, problem.disc) == pytest.approx(limit, abs=1e-9)
    assert solve_problem(problem, "phasor", Options("contrast")).drive == pytest.approx(
        reached.drive
    )


def test_damped_least_squares_solves_the_normal_equations() -> None:
    """Against (GᴴG + μ)c = Gᴴw, written out."""
    rng = np.random.default_rng(2)
    fields = rng.normal(size=(40, 4)) + 1j * rng.normal(size=(40, 4))
    wanted = rng.normal(size=40) * np.complex128(1.0)
    drive, condition = damped(fields, wanted)
    singular = np.linalg.svd(fields, compute_uv=False)
    ridge = (1e-4 * singular[0]) ** 2
    left = (fields.conj().T @ fields + ridge * np.eye(4)) @ drive
    assert left == pytest.approx(fields.conj().T @ wanted)
    assert condition == pytest.approx(singular[0] / singular[-1])
    silent, worst = damped(np.zeros((9, 2), dtype=complex), wanted[:9])
    assert not silent.any()
    assert worst == np.inf


def test_time_reversal_moves_the_finger_most_for_its_power(problem: Problem) -> None:
    """Cauchy–Schwarz: of all drives of the same Σ|c|², none moves the disc's mean more."""
    drive = solve_problem(problem, "time-reversal", Options()).drive
    mean = problem.transfer[:, problem.disc].mean(axis=1)
    best = abs(drive @ mean) / np.linalg.norm(drive)
    rng = np.random.default_rng(1)
    for c in rng.normal(size=(200, 5)) + 1j * rng.normal(size=(200, 5)):
        assert abs(c @ mean) / np.linalg.norm(c) <= best + 1e-18


def test_gerchberg_saxton_lowers_the_error_of_amplitudes(problem: Problem) -> None:
    """Its own measure, ‖|W| − |wanted|‖, never rises from turn to turn (error reduction)."""
    fields = problem.transfer[:, ::4, ::4].reshape(5, -1).T
    wanted = np.abs(problem.wanted[::4, ::4].ravel())
    errors = []
    for steps in (1, 2, 5, 20, 60):
        drive = METHODS["gerchberg-saxton"](problem, Options(steps=steps)).drive
        errors.append(np.linalg.norm(np.abs(fields @ drive) - wanted))
    assert all(b <= a * (1 + 1e-6) for a, b in pairwise(errors))


def test_balanced_trades_ssim_for_contrast(prototype: Board) -> None:
    solved = solved_board(prototype)
    for target in [(10.0, 0.0), (5.0, 35.0), (-20.0, 10.0)]:
        own = solved.problem(target)
        nulls = null_models(own)
        ssim, balanced = (
            score_on(own, solve_problem(own, "phasor", Options(name)).field, nulls)
            for name in ("ssim", "balanced")
        )
        assert balanced.ssim <= ssim.ssim + 1e-6
        assert balanced.contrast_db >= ssim.contrast_db - 1e-3


# The paper's annealing


def naive_chain(problem: Problem, steps: int, seed: int) -> tuple[list[float], NDArray[np.float64]]:
    """Algorithm 1 as the authors ran it, written out over all 1800 gains, with the same draws."""
    rng = np.random.default_rng(seed)
    turns = np.exp(2j * np.pi * np.arange(360) / 360)

    def ssim(gains: NDArray[np.float64]) -> float:
        composite = np.zeros(problem.wanted.shape, dtype=complex)
        for actuator, field in zip(gains, problem.transfer, strict=True):
            for gain, turn in zip(actuator, turns, strict=True):
                composite += gain * turn * field
        image = normalised(np.abs(composite) / np.sqrt(2.0))
        return float(structural_similarity(image, problem.image, data_range=1.0))  # type: ignore[no-untyped-call]

    gains = rng.integers(-10, 11, size=(5, 360)).astype(float)
    trace, temperature = [ssim(gains)], 1000.0
    for _ in range(steps):
        place = int(rng.integers(1800))
        value = float(rng.integers(-10, 11))
        luck = rng.random()
        trial = gains.copy()
        trial.flat[place] = value
        score = ssim(trial)
        if score > trace[-1] or luck < (1.0 - score) * temperature / 1000.0:
            gains = trial
            trace.append(score)
        else:
            trace.append(trace[-1])
        temperature *= 0.999
    return trace, gains


@pytest.mark.slow
def test_annealing_is_the_authors_chain_step_for_step(problem: Problem, tmp_path: Path) -> None:
    """The 1800 gains' sum and the five phasors differ by rounding, and so do the scores."""
    trace, gains = naive_chain(problem, 12, 5)
    anneal(problem, Options(seed=5, steps=12, trace=tmp_path / "t.npz"))
    chain, _ = read_trace(tmp_path / "t.npz")
    assert chain.ssim == pytest.approx(trace, abs=1e-6)
    assert np.array_equal(chain.state, gains)


def test_eighteen_hundred_gains_are_five_phasors(problem: Problem) -> None:
    rng = np.random.default_rng(8)
    gains = rng.integers(-10, 11, size=(5, 360)).astype(float)
    fields = problem.transfer[:, ::16, ::16]
    images = np.exp(2j * np.pi * np.arange(360) / 360)[:, None, None] * fields[:, None]
    summed = np.abs((gains[:, :, None, None] * images).sum(axis=(0, 1)))
    direct = np.abs(np.tensordot(phasors(gains), fields, axes=1))
    assert summed == pytest.approx(direct, rel=1e-9, abs=1e-12 * direct.max())


@pytest.mark.parametrize("method", ["anneal", "phasor-anneal"])
def test_annealing_resumes_to_the_same_end(problem: Problem, tmp_path: Path, method: str) -> None:
    whole, parts = tmp_path / "whole.npz", tmp_path / "parts.npz"
    straight = METHODS[method](problem, Options(steps=90, trace=whole))
    for steps in (40, 90):
        found = METHODS[method](problem, Options(steps=steps, trace=parts))
    assert np.array_equal(found.drive, straight.drive)
    assert read_trace(parts)[0].ssim == read_trace(whole)[0].ssim
    ssim = read_trace(whole)[0].ssim
    assert len(ssim) == 91
    assert max(ssim) > ssim[0]


def test_an_interrupted_annealing_goes_on(
    problem: Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["chladni.drives.methods.anneal"], "KEEP_EVERY", 20)
    trace = tmp_path / "t.npz"

    def stop(done: int, _: int) -> None:
        if done == 40:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        anneal(problem, Options(steps=100, trace=trace, progress=stop))
    assert read_trace(trace)[0].step == 40
    again = anneal(problem, Options(steps=100, trace=trace))
    assert np.array_equal(again.drive, anneal(problem, Options(steps=100)).drive)
    assert [path.name for path in tmp_path.iterdir()] == ["t.npz"]


def test_a_trace_of_something_else_is_refused(problem: Problem, tmp_path: Path) -> None:
    trace = tmp_path / "t.npz"
    anneal(problem, Options(steps=3, trace=trace))
    before = trace.read_bytes()
    with pytest.raises(InputError, match="seed 1"):
        anneal(problem, Options(seed=1, steps=3, trace=trace))
    with pytest.raises(InputError, match="phasor-anneal"):
        METHODS["phasor-anneal"](problem, Options(steps=3, trace=trace))
    assert trace.read_bytes() == before
    for junk in (b"", b"PK\x03\x04 no archive", before[: len(before) // 2]):
        trace.write_bytes(junk)
        with pytest.raises(InputError, match="a trace of this solve"):
            anneal(problem, Options(steps=3, trace=trace))
        assert trace.read_bytes() == junk


def test_annealing_keeps_its_best(problem: Problem, tmp_path: Path) -> None:
    trace = tmp_path / "t.npz"
    found = anneal(problem, Options(steps=300, trace=trace))
    chain, _ = read_trace(trace)
    assert solve_problem_ssim(problem, found) == pytest.approx(max(chain.ssim), abs=1e-6)
    assert np.abs(chain.state).max() <= 10
    assert np.array_equal(chain.state, np.round(chain.state))


def solve_problem_ssim(problem: Problem, found: Found) -> float:
    field = np.tensordot(found.drive, problem.transfer, axes=1)
    return metrics.ssim(np.abs(field), np.abs(problem.wanted))


def test_the_same_seed_gives_the_same_annealing(prototype: Board) -> None:
    first, second, other = (
        solve(prototype, TARGET, method="anneal", seed=seed, steps=30).drive for seed in (3, 3, 4)
    )
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)
