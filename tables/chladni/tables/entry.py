"""One stored region of a table: its drive, and what that is meant to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.tables import _kernel
from chladni.tables.scene import Problem, Scene

COARSE_STEP, FINE_STEP = 4, 2
"""What is only compared, and not reported, is so on every fourth or second image point each way."""


@dataclass(frozen=True)
class Wanted:
    """What a place wants: its normalised image, its fingertip's disc, and its field.

    Fields are a unit load's, on every `COARSE_STEP`-th and every `FINE_STEP`-th image point.
    """

    image: NDArray[np.float32]
    disc: NDArray[np.bool_]
    fields: tuple[NDArray[np.complex64], NDArray[np.complex64]]

    @classmethod
    def of(cls, problem: Problem) -> Self:
        """What is kept of a problem once it is solved."""
        levels = [problem.scene.space.nearest_level(step) for step in (COARSE_STEP, FINE_STEP)]
        coarse, fine = (
            problem.wanted[np.ix_(level.index_x, level.index_y)].astype(np.complex64)
            for level in levels
        )
        return cls(problem.image.astype(np.float32), problem.disc, (coarse, fine))


@dataclass(frozen=True)
class Entry:
    """A drive in units of the largest gain, and what its place wants.

    `best` is the SSIM of the best drive there, which that of a neighbour's branch falls short of.
    """

    drive: NDArray[np.complex128]
    wanted: Wanted
    best: float

    def ssim(self, scene: Scene, step: int = 1) -> _kernel.Objective:
        """SSIM on every `step`-th image point each way, or as nearly as there is a level for."""
        level = scene.space.nearest_level(step)
        return scene.space.objective(level, self.wanted.image.astype(np.float64))
