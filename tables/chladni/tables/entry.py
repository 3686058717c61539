"""One stored region of a table: its drive, and what that is meant to do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.tables import _kernel
from chladni.tables.scene import Scene


@dataclass(frozen=True)
class Entry:
    """A drive in units of the largest gain, and its target: normalised image and fingertip disc.

    `best` is the SSIM of the best drive there, which that of a neighbour's branch falls short of.
    """

    drive: NDArray[np.complex128]
    image: NDArray[np.float32]
    disc: NDArray[np.bool_]
    best: float

    def ssim(self, scene: Scene, step: int = 1) -> _kernel.Objective:
        """SSIM on every `step`-th image point each way, or as nearly as there is a level for."""
        level = scene.space.nearest_level(step)
        return scene.space.objective(level, self.image.astype(np.float64))
