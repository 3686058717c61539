"""Many frequencies of the same loads on the same grid: images made once, weighted for each.

A field is read from the basis' values at every point of the grid, some tens of megabytes. What
depends on frequency is little: a few low modes and the first terms of a power series for all the
others. Their images are kept, and a further frequency is a weighted sum of those.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.sim.mirrored_grid import Oddness
from chladni.sim.ritz.grid import GridTable
from chladni.sim.ritz.modal import Spectrum
from chladni.sim.ritz.symmetry import ParityBasis

FloatArray = NDArray[np.float64]


class Sweep:
    """The fields of a load case at any frequency that its spectra reach.

    Parameters
    ----------
    bases, spectra
        Of every parity class.
    grid
        Where the fields are wanted.
    """

    def __init__(self, bases: list[ParityBasis], spectra: list[Spectrum], grid: GridTable) -> None:
        self._grid = grid
        self._classes = []
        for basis, spectrum in zip(bases, spectra, strict=True):
            # A load on a mirror's line has no share in half of the classes.
            used = np.flatnonzero(spectrum.columns.any(axis=0))
            images = grid.share(basis, spectrum.columns[:, used])
            self._classes.append((basis.oddness, spectrum, used, images))

    def is_of(self, spectra: list[Spectrum], grid: GridTable) -> bool:
        """Whether it was made of these very ones."""
        own = [spectrum for _, spectrum, _, _ in self._classes]
        return self._grid is grid and all(a is b for a, b in zip(own, spectra, strict=True))

    def shares(self, omega: float, loss_factor: float) -> dict[Oddness, FloatArray]:
        """Shape (parts, loads, *part_shape) per class; parts are real and, with loss, imaginary."""
        result = {}
        for oddness, spectrum, used, images in self._classes:
            weights = spectrum.weights(omega, loss_factor)[used].T
            both = np.stack((weights.real, weights.imag) if loss_factor else (weights.real,))
            rows = both.reshape(-1, used.size) @ images.reshape(used.size, -1)
            result[oddness] = rows.reshape(*both.shape[:2], *images.shape[1:])
        return result
