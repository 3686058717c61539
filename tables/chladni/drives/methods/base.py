"""What every method takes and gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import Problem

ComplexArray = NDArray[np.complex128]

Progress = Callable[[int, int], None]
"""Called with (done, all)."""
SEED = 20240160


@dataclass(frozen=True)
class Options:
    """How a method is asked to work.

    Attributes
    ----------
    objective
        Key of `objectives.OBJECTIVES`, which has its solver; a method has one aim and ignores it.
    seed
        Of everything random; the same seed gives the same drive.
    steps
        In place of the method's own number of steps.
    finest
        `phasor` ends on the image of every `finest`-th point each way; 1 is the whole image.
    trace
        File in which annealing keeps its trace, and from which it goes on.
    progress
        Called now and then by methods that take seconds.
    """

    objective: str = "ssim"
    seed: int = SEED
    steps: int | None = None
    finest: int = 1
    trace: Path | None = None
    progress: Progress | None = None


@dataclass(frozen=True)
class Found:
    """A drive of any scale, what it cost, and numbers the method knows about it."""

    drive: ComplexArray
    evaluations: int = 1
    details: dict[str, float] = field(default_factory=dict)


Method = Callable[[Problem, Options], Found]
