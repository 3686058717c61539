"""Modes of one parity class under its supports, and the response they give at any frequency."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.loading import ClassLoad

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

REDUNDANT = 1e-13
"""Combinations of functions whose energy is below this share of the largest are one function
counted twice (rim functions look like polynomials from afar); they are left out."""
CONDITION_FLOOR = 1e-9
"""A support condition this much smaller than the largest holds by parity alone."""


class ClassModes:
    """Modes of (stiffness, mass) over the `subset` of functions that obeys `supports`.

    Parameters
    ----------
    stiffness, mass
        Shape (size, size).
    supports
        Shape (conditions, size).
    subset
        Indices of the functions that take part.
    """

    def __init__(
        self, stiffness: FloatArray, mass: FloatArray, supports: FloatArray,
        subset: NDArray[np.intp],
    ) -> None:  # fmt: skip
        self._subset = subset
        square = np.ix_(subset, subset)
        self._stiffness, self._mass = stiffness[square], mass[square]
        # Energy at a typical frequency makes the scale: every function counts as one.
        self._shift = float(np.median(np.diag(self._stiffness) / np.diag(self._mass))) * 1e-6
        self._scale = 1.0 / np.sqrt(np.diag(self._stiffness) + self._shift * np.diag(self._mass))
        self._supports = supports[:, subset] * self._scale
        norms = np.linalg.norm(self._supports, axis=1)
        self._kept = norms > CONDITION_FLOOR * norms.max(initial=0.0)
        self._row_scale = 1.0 / norms[self._kept]
        self._conditions = self._supports[self._kept] * self._row_scale[:, None]

    @cached_property
    def _split(self) -> tuple[FloatArray, FloatArray]:
        """(null space, pseudo-inverse) of the support conditions, in scaled coefficients."""
        size = self._subset.size
        if not self._conditions.size:
            return np.eye(size), np.zeros((size, 0))
        left, singular, right = np.linalg.svd(self._conditions)
        rank = int(np.sum(singular > CONDITION_FLOOR * singular[0]))
        inverse = (right[:rank].T / singular[:rank]) @ left[:, :rank].T
        return right[rank:].T, inverse

    @cached_property
    def _modes(self) -> tuple[FloatArray, FloatArray]:
        """(ω², coefficients of mass-normalised modes), lowest first."""
        null = self._split[0] * self._scale[:, None]
        stiffness = null.T @ self._stiffness @ null
        mass = null.T @ self._mass @ null
        energy, vectors = np.linalg.eigh(stiffness + self._shift * mass)
        keep = energy > REDUNDANT * energy[-1]
        whiten = vectors[:, keep] / np.sqrt(energy[keep])
        # Mass over shifted energy is largest for the lowest modes, so they come out best.
        ratio, turn = np.linalg.eigh(whiten.T @ mass @ whiten)
        good = ratio[::-1] > REDUNDANT * ratio[-1]
        ratio, turn = ratio[::-1][good], turn[:, ::-1][:, good]
        modes = null @ (whiten @ (turn / np.sqrt(ratio)))
        return 1.0 / ratio - self._shift, modes

    @property
    def omega_squared(self) -> FloatArray:
        """ω² of every mode, ascending, (rad/s)²."""
        return self._modes[0]

    @property
    def modes(self) -> FloatArray:
        """Mass-normalised modes as coefficients of the subset, shape (subset, modes)."""
        return self._modes[1]

    def respond(self, load: ClassLoad, omega: float, loss_factor: float) -> ComplexArray:
        """Coefficients of the class (size, loads) at one frequency."""
        factor = 1.0 + 1j * loss_factor
        force = load.force + omega**2 / factor * load.inertia
        particular = -self._inverse_supports(load.supports) / factor
        own = force[self._subset]
        if particular.any():
            own = own - (factor * self._stiffness - omega**2 * self._mass) @ particular
        squares, modes = self._modes
        gain = 1.0 / (squares * factor - omega**2)
        solution = particular + modes @ (gain[:, None] * (modes.T @ own))
        result = np.zeros((load.force.shape[0], own.shape[1]), dtype=np.complex128)
        result[self._subset] = solution
        return result

    def _inverse_supports(self, moments: FloatArray) -> FloatArray:
        """Least coefficients with the given support moments (conditions, loads)."""
        scaled = moments[self._kept] * self._row_scale[:, None]
        return np.asarray(self._scale[:, None] * (self._split[1] @ scaled))
