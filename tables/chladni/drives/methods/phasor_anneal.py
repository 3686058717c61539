"""The same annealing over five phasors instead of 1800 gains: what the redundancy costs.

A step redraws one actuator's gain and phase, uniformly; schedule and length are the paper's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.anneal import run
from chladni.drives.methods.base import Found, Options
from chladni.drives.problem.problem import Problem

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def phasor_anneal(problem: Problem, options: Options) -> Found:
    """The paper's chain with one complex number per actuator as its state."""
    count = len(problem.board.actuators)

    def draw(rng: np.random.Generator, state: FloatArray) -> tuple[tuple[int, ...], FloatArray]:
        return (int(rng.integers(len(state))),), rng.random(2)

    return run(problem, options, "phasor-anneal", lambda rng: rng.random((count, 2)), draw, drive)


def drive(state: FloatArray) -> ComplexArray:
    """Gains of 0…1 and phases in turns as complex numbers; state (actuators, 2)."""
    return np.asarray(state[:, 0] * np.exp(2j * np.pi * state[:, 1]))
