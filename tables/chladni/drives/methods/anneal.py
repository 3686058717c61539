"""Simulated annealing as the paper's authors ran it: 1800 integer gains, one redrawn at a time.

Every actuator has 360 gains of −10…10, one per degree of phase. A step redraws one gain and keeps
it if the image is more like the target, or if a uniform number is below (1 − SSIM)·T/1000; T starts
at 1000 and falls by a thousandth per step. (The paper's Algorithm 1, corrected: docs/physics.md.)

An actuator's 360 gains add up to one complex number, its phasor, and a step changes one phasor: the
chain is the authors' own, gain for gain, and 10 000 steps take seconds.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.problem import Problem
from chladni.sim.board.board import document_digest
from chladni.sim.errors import ArgumentError
from chladni.sim.files import read_arrays, write_arrays

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PHASES = 360
LARGEST_GAIN = 10
STEPS = 10_000
FIRST_TEMPERATURE, COOLING = 1000.0, 0.999
KEEP_EVERY = 1000
"""Steps between two savings of the trace."""
MOST_STEPS = 10_000_000
"""With a trace, which keeps eight bytes of each."""
TRACE_BYTES = 8 * MOST_STEPS + 1_000_000
"""Of a trace, packed or unpacked; a state of 64 actuators has 184,320."""
MOST_WORDS = 400
"""Characters of the text that names what a trace is of."""


@dataclass
class Chain:
    """The state of an annealing, and its trace.

    Attributes
    ----------
    state
        What the steps redraw; its meaning is the proposal's.
    ssim
        Of the present state after every step, and of the start; shape (steps + 1,).
    best
        The best drive so far and its SSIM.
    """

    state: FloatArray
    ssim: list[float]
    best: tuple[float, ComplexArray]
    rng: np.random.Generator

    @property
    def step(self) -> int:
        """Steps done."""
        return len(self.ssim) - 1


Draw = Callable[[np.random.Generator, FloatArray], tuple[tuple[int, ...], Any]]
"""A proposal: which entry of the state, and its new value."""


def anneal(problem: Problem, options: Options) -> Found:
    """The paper's chain over 1800 integer gains."""
    count = len(problem.board.actuators)

    def start(rng: np.random.Generator) -> FloatArray:
        return first_gains(rng, count)

    return run(problem, options, "anneal", start, redraw_gain, phasors)


def first_gains(rng: np.random.Generator, count: int) -> FloatArray:
    """Random integer gains of so many actuators, shape (count, 360)."""
    gains = rng.integers(-LARGEST_GAIN, LARGEST_GAIN + 1, size=(count, PHASES))
    return gains.astype(np.float64)


def redraw_gain(rng: np.random.Generator, gains: FloatArray) -> tuple[tuple[int, ...], float]:
    """One of the gains, and another value for it."""
    place = int(rng.integers(gains.size))
    gain = float(rng.integers(-LARGEST_GAIN, LARGEST_GAIN + 1))
    return (place // PHASES, place % PHASES), gain


def phasors(gains: FloatArray) -> ComplexArray:
    """Σ gains · exp(iφ) per actuator; gains (actuators, 360)."""
    angle = np.arange(gains.shape[1]) * (2.0 * np.pi / gains.shape[1])
    return np.asarray(gains @ np.exp(1j * angle))


def run(
    problem: Problem,
    options: Options,
    name: str,
    start: Callable[[np.random.Generator], FloatArray],
    draw: Draw,
    drive_of: Callable[[FloatArray], ComplexArray],
) -> Found:
    """An annealing by the authors' schedule, resumed from `options.trace` if that is there.

    Parameters
    ----------
    start, draw
        A first state, and one redrawn entry of it.
    drive_of
        The drive a state stands for.
    """
    steps = options.steps or STEPS
    key = {
        "method": name,
        "board": document_digest(problem.board),
        "target_mm": list(problem.target_mm),
        "seed": options.seed,
        "chladni": version("chladni"),
    }
    space = problem.solved.space
    objective = space.objective(space.levels[-1], problem.image)

    def ssim(drive: ComplexArray) -> float:
        return space.value(objective, drive)

    if options.trace and steps > MOST_STEPS:
        raise ArgumentError("steps", steps, f"at most {MOST_STEPS:,} with a trace")
    rng = np.random.default_rng(options.seed)
    state = start(rng)
    chain = _resume(options.trace, key, state.shape) if options.trace else None
    if chain is None:
        first = ssim(drive_of(state))
        chain = Chain(state, [first], (first, drive_of(state)), rng)
    try:
        while chain.step < steps:
            advance(chain, draw, drive_of, ssim)
            if chain.step % KEEP_EVERY == 0:
                if options.trace:
                    save_trace(options.trace, chain, key)
                if options.progress:
                    options.progress(chain.step, steps)
    finally:
        # Also when interrupted: the same command goes on from here.
        if options.trace:
            save_trace(options.trace, chain, key)
    return Found(chain.best[1], chain.step + 1, {"final_ssim": chain.ssim[-1]})


def advance(
    chain: Chain,
    draw: Draw,
    drive_of: Callable[[FloatArray], ComplexArray],
    ssim: Callable[[ComplexArray], float],
) -> None:
    """One step of a chain by the authors' schedule: redraw an entry, and keep it or not."""
    place, value = draw(chain.rng, chain.state)
    luck = float(chain.rng.random())
    before = np.copy(chain.state[place])
    chain.state[place] = value
    drive = drive_of(chain.state)
    score = ssim(drive)
    temperature = FIRST_TEMPERATURE * COOLING**chain.step
    if score > chain.ssim[-1] or luck < (1.0 - score) * temperature / FIRST_TEMPERATURE:
        chain.ssim.append(score)
        if score > chain.best[0]:
            chain.best = (score, drive)
    else:
        chain.state[place] = before
        chain.ssim.append(chain.ssim[-1])


def save_trace(path: Path, chain: Chain, key: dict[str, Any]) -> None:
    """Write the whole state of a chain (.npz), or leave the file as it was."""
    state = json.dumps({"key": key, "rng": chain.rng.bit_generator.state})
    write_arrays(
        path,
        follow=False,
        ssim=np.array(chain.ssim),
        state=chain.state,
        best_ssim=np.array(chain.best[0]),
        best_drive=chain.best[1],
        about=np.array(state),
    )


def read_trace(path: Path) -> tuple[Chain, dict[str, Any]]:
    """A saved chain and what it is of.

    An .npz carries a checksum of every array; what is in them is checked besides.

    Raises
    ------
    InputError
        The file is no trace, or a link to one.
    """
    try:
        data = read_arrays(path, "trace", TRACE_BYTES, "a trace", follow=False)
        about = json.loads(str(data["about"]))
        rng = np.random.default_rng()
        rng.bit_generator.state = about["rng"]
        if about["rng"]["state"]["inc"] % 2 == 0:
            raise ValueError("a generator that repeats itself")
        best = (float(data["best_ssim"]), data["best_drive"])
        chain = Chain(data["state"], data["ssim"].tolist(), best, rng)
        key = about["key"]
        if not (isinstance(key, dict) and _is_chain(data) and len(_words(key)) < MOST_WORDS):
            raise ValueError("no chain")
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
        raise ArgumentError("trace", str(path), "a new file, or a trace of this solve") from error
    return chain, key


def _is_chain(data: dict[str, NDArray[Any]]) -> bool:
    """Whether arrays are what `save_trace` writes: their kinds, their shapes, numbers in range."""
    kinds = {
        "ssim": ("f8", 1),
        "state": ("f8", 2),
        "best_ssim": ("f8", 0),
        "best_drive": ("c16", 1),
    }
    return (
        all(data[n].dtype == kind and data[n].ndim == rank for n, (kind, rank) in kinds.items())
        and all(bool(np.isfinite(data[name]).all()) for name in kinds)
        and data["ssim"].size > 0
        and len(data["state"]) == len(data["best_drive"])
        and bool((np.abs(data["state"]) <= LARGEST_GAIN).all())
    )


def _resume(path: Path, key: dict[str, Any], shape: tuple[int, ...]) -> Chain | None:
    if not os.path.lexists(path):
        return None
    chain, saved = read_trace(path)
    if saved != key:
        raise ArgumentError(
            "trace",
            str(path),
            f"a trace of {_words(key)}",
            hint=f"it is one of {_words(saved)}",
        )
    if chain.state.shape != shape:
        raise ArgumentError(
            "trace", f"a state of shape {chain.state.shape}", f"{shape}", file=str(path)
        )
    return chain


def _words(key: dict[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in key.items())
