"""Modes of one parity class under its supports, and the response they give at any frequency."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from chladni.sim.ritz.constraints import Constraints
from chladni.sim.ritz.forms.features import DampedForms
from chladni.sim.ritz.forms.loads import ClassLoad
from chladni.sim.ritz.forms.supports import SupportConditions
from chladni.sim.ritz.symmetric_factors import SymmetricFactors

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
AnyArray = NDArray[Any]
"""Real or complex."""

REDUNDANT = 1e-13
"""Combinations of functions whose energy is below this share of the largest are one function
counted twice (rim functions look like polynomials from afar); they are left out."""
INVERSE_STEPS = 4
"""Enough for a mode near the drive, which dwarfs all others."""
SOLVED_BEFORE_MODES = 3
"""Modes cost as much as about five solutions without them."""


@dataclass(frozen=True)
class _LeftOut:
    """Directions of unknowns that a coarser basis has not, and what takes them out of a solution.

    `at` is the (omega, loss factor) it holds for; both others have shape (unknowns, left out).
    """

    at: tuple[float, float]
    directions: FloatArray
    block: ComplexArray


class ClassModes:
    """Modes of (stiffness, mass) over the `subset` of functions that obeys the conditions `taken`.

    Parameters
    ----------
    stiffness, mass
        Shape (size, size).
    supports
        Conditions on all functions.
    subset, taken
        Indices of the functions and of the support conditions that take part.
    polynomials
        How many of all functions are polynomials; they come first.
    damped
        The part of `stiffness` that has loss factors of its own.
    """

    def __init__(
        self,
        stiffness: FloatArray,
        mass: FloatArray,
        supports: SupportConditions,
        subset: NDArray[np.intp],
        taken: NDArray[np.intp],
        *,
        polynomials: int,
        damped: DampedForms | None = None,
    ) -> None:
        self._subset = subset
        self._solved = 0
        # Many loads come at one frequency: its factors are kept.
        self._factored: tuple[tuple[float, float], SymmetricFactors] | None = None
        self._left_out: _LeftOut | None = None
        self._size = stiffness.shape[0]
        self._forms = stiffness, mass
        self._damped = damped
        # Energy at a typical frequency makes the scale: every function counts as one.
        stiff, heavy = np.diag(stiffness)[subset], np.diag(mass)[subset]
        self._shift = float(np.median(stiff / heavy)) * 1e-6
        self._scale = 1.0 / np.sqrt(stiff + self._shift * heavy)
        self._constraints = Constraints(
            supports, subset, taken, self._scale, polynomials=polynomials
        )

    @property
    def _stiffness(self) -> FloatArray:
        return self._own_part(self._forms[0])

    @property
    def _mass(self) -> FloatArray:
        return self._own_part(self._forms[1])

    def _own_part(self, form: FloatArray) -> FloatArray:
        """A form over the subset; cut out each time, since several subsets share the whole."""
        if self._subset.size == self._size:
            return form
        return form[np.ix_(self._subset, self._subset)]

    @cached_property
    def _free(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What obeys the supports, as columns of coefficients, and the two forms of it."""
        null = self._constraints.null_space * self._scale[:, None]
        return null, null.T @ self._stiffness @ null, null.T @ self._mass @ null

    @cached_property
    def _whitened(self) -> tuple[FloatArray, FloatArray]:
        """(μ, vectors): vectors with K + σM = 1 and M = diag μ, the lowest modes first.

        μ = 1/(ω² + σ) is largest for the lowest modes, so they come out best. The stiffest
        combinations have a μ lost in rounding; as forces bend them all the same they stay, and
        nothing is divided by μ.
        """
        null, stiffness, mass = self._free
        energy, vectors = np.linalg.eigh(stiffness + self._shift * mass)
        keep = energy > REDUNDANT * energy[-1]
        whiten = vectors[:, keep] / np.sqrt(energy[keep])
        ratio, turn = np.linalg.eigh(whiten.T @ mass @ whiten)
        return np.maximum(ratio[::-1], 0.0), null @ (whiten @ turn[:, ::-1])

    @cached_property
    def _has_frequency(self) -> NDArray[np.bool_]:
        ratio = self._whitened[0]
        return np.asarray(ratio > REDUNDANT * ratio[0])

    @property
    def omega_squared(self) -> FloatArray:
        """ω² of every mode whose frequency is known, ascending, (rad/s)²."""
        return np.asarray(1.0 / self._whitened[0][self._has_frequency] - self._shift)

    @property
    def modes(self) -> FloatArray:
        """Mass-normalised modes in the order of `omega_squared`; (class size, modes)."""
        ratio, vectors = self._whitened
        result = np.zeros((self._size, int(self._has_frequency.sum())))
        result[self._subset] = vectors[:, self._has_frequency] / np.sqrt(ratio[self._has_frequency])
        return result

    def respond(self, load: ClassLoad, omega: float, loss_factor: float) -> ComplexArray:
        """Coefficients of the class (size, loads) at one frequency, by modes."""
        assert self._has_one_loss(loss_factor), "modes are of one loss factor"
        particular, own = self._prepare(load, omega, loss_factor)
        ratio, vectors = self._whitened
        stiffness = (1.0 - self._shift * ratio) * (1.0 + 1j * loss_factor)
        # Exactly on a mode without loss this is infinite, and whoever asked is told so.
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = 1.0 / (stiffness - omega**2 * ratio)
        modal = gain[:, None] * _product(vectors.T, own)
        return self._spread(particular + _product(vectors, modal))

    def solve(self, load: ClassLoad, omega: float, loss_factor: float) -> ComplexArray:
        """The same without modes: cheaper for a few frequencies, by modes once more are asked."""
        if not self._is_factored(omega, loss_factor):
            if self._solved >= SOLVED_BEFORE_MODES and self._has_one_loss(loss_factor):
                return self.respond(load, omega, loss_factor)
            self._solved += 1
            self._factored = ((omega, loss_factor), self._factors(omega, loss_factor))
        return self._functions(self._back(self._loaded(load, omega, loss_factor)))

    def stiffened(self, solution: ComplexArray, omega: float, loss_factor: float) -> ComplexArray:
        """What a solution changes by, per relative change of all stiffness."""
        force = -(1.0 + 1j * loss_factor) * _product(self._stiffness, solution[self._subset])
        if self._is_factored(omega, loss_factor):
            return self._functions(self._back(self._forced(force)))
        whole = self._spread(force)
        return self.respond(ClassLoad(whole, np.zeros(whole.shape), None), omega, loss_factor)

    def resonance(self, omega: float) -> float:
        """About ω²/|ω²ₙ − ω²| of the nearest mode without loss, by inverse iteration."""
        if not self._is_factored(omega, 0.0):
            return np.inf  # modes are at hand, so that looking costs nothing
        own = slice(self._subset.size)
        start = np.random.default_rng(0).standard_normal((self._subset.size, 1))
        vector, gain = (self._scale[:, None] * start).astype(np.complex128), 0.0
        for _ in range(INVERSE_STEPS):
            force = self._mass @ vector
            norm = np.sqrt(abs(np.vdot(vector, force)))
            forced = self._back(self._forced(force / max(norm, 1e-300)))
            vector = self._scale[:, None] * forced[own]
            gain = float(np.sqrt(abs(np.vdot(vector, self._mass @ vector))))
        return omega**2 * gain

    def _has_one_loss(self, loss_factor: float) -> bool:
        """Whether all lose what the plate does; modes respond only then."""
        return self._damped is None or self._damped.loss_factors == {loss_factor}

    def _force(self, load: ClassLoad, omega: float, loss_factor: float) -> AnyArray:
        """What pushes the functions of the class, inertia of the loads' own deflection included."""
        factor = 1.0 + 1j * loss_factor
        force = load.force + omega**2 / factor * load.inertia
        if load.damped is not None:
            force = force - (load.damped.stiffness + 1j * load.damped.loss) / factor
        return np.asarray(force)

    def _is_factored(self, omega: float, loss_factor: float) -> bool:
        return self._factored is not None and self._factored[0] == (omega, loss_factor)

    def _factors(self, omega: float, loss_factor: float) -> SymmetricFactors:
        """Factors of [A Vᵀ; V 0]: the dynamic stiffness A with the supports as constraints."""
        constraints = self._constraints.rows
        size, count = self._subset.size, constraints.shape[0]
        is_real = loss_factor == 0.0 and self._has_one_loss(loss_factor)
        bordered = np.zeros((size + count,) * 2, dtype=float if is_real else complex)
        scale = self._scale[:, None] * self._scale
        stiffness = scale * self._stiffness
        bordered[:size, :size] = stiffness - omega**2 * (scale * self._mass)
        if not is_real:
            bordered.imag[:size, :size] = loss_factor * stiffness
        if self._damped is not None and not self._has_one_loss(loss_factor):
            more = self._damped.loss - loss_factor * self._damped.stiffness
            bordered.imag[:size, :size] += scale * self._own_part(more)
        bordered[:size, size:] = constraints.T
        return SymmetricFactors(bordered)

    def solve_in(
        self, coarser: list[ClassModes], load: ClassLoad, omega: float, loss_factor: float
    ) -> list[ComplexArray]:
        """Solutions in parts of this basis; after `solve` they take no factors of their own.

        What is left out, multipliers of conditions among it, is forced to be zero: a block of the
        inverse as large as its number does that.
        """
        if not self._constraints.is_independent or not self._is_factored(omega, loss_factor):
            return [part.solve(load, omega, loss_factor) for part in coarser]
        whole = self._back(self._loaded(load, omega, loss_factor))
        out = [part._left_out_of(self, omega, loss_factor) for part in coarser]
        return [self._functions(whole - o.block @ (o.directions.T @ whole)) for o in out]

    def _left_out_of(self, finer: ClassModes, omega: float, loss_factor: float) -> _LeftOut:
        """What of a finer basis this one has not."""
        if self._left_out is None or self._left_out.at != (omega, loss_factor):
            directions = self._beyond(finer)
            columns = finer._back(directions.astype(np.complex128))
            block = np.asarray(np.linalg.solve((directions.T @ columns).T, columns.T).T)
            self._left_out = _LeftOut((omega, loss_factor), directions, block)
        return self._left_out

    def _beyond(self, finer: ClassModes) -> FloatArray:
        """Directions of a finer basis's unknowns that are none of this one's."""
        is_row_out, edges = self._constraints.released_from(finer._constraints)
        is_out = np.concatenate((~np.isin(finer._subset, self._subset), is_row_out))
        units = np.zeros((is_out.size, np.count_nonzero(is_out)))
        units[is_out] = np.eye(units.shape[1])
        return np.asarray(block_diag(units, edges))

    def _loaded(self, load: ClassLoad, omega: float, loss_factor: float) -> ComplexArray:
        """A load's right-hand side for `_back`; support moments are to be cancelled."""
        right = self._forced(self._force(load, omega, loss_factor)[self._subset])
        if load.supports is not None:
            moments = load.supports / (1.0 + 1j * loss_factor)
            right[self._subset.size :] = -self._constraints.along_rows(moments)
        return right

    def _forced(self, force: AnyArray) -> ComplexArray:
        """The same of forces alone, (subset size, loads)."""
        count = self._subset.size + self._constraints.rows.shape[0]
        right = np.zeros((count, force.shape[1]), dtype=np.complex128)
        right[: self._subset.size] = self._scale[:, None] * force
        return right

    def _back(self, right: ComplexArray) -> ComplexArray:
        """Scaled coefficients and multipliers, by the factors kept."""
        assert self._factored is not None
        factors, count = self._factored[1], right.shape[1]
        if factors.is_complex:
            return factors.solve(right)
        both = factors.solve(np.concatenate((right.real, right.imag), axis=1))
        return np.asarray(both[:, :count] + 1j * both[:, count:])

    def _prepare(
        self, load: ClassLoad, omega: float, loss_factor: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """A displacement that meets the supports, and the force that is left to the free part."""
        factor = 1.0 + 1j * loss_factor
        own = self._force(load, omega, loss_factor)[self._subset]
        particular: ComplexArray = np.zeros(own.shape, dtype=np.complex128)
        if load.supports is not None and load.supports.any():
            moments = self._constraints.along_rows(load.supports) / factor
            particular = np.asarray(-self._scale[:, None] * self._constraints.least(moments))
            own = own - (factor * self._stiffness - omega**2 * self._mass) @ particular
        return particular, np.asarray(own, dtype=np.complex128)

    def _functions(self, unknowns: ComplexArray) -> ComplexArray:
        """Coefficients of the class, of what `_back` gives."""
        return self._spread(self._scale[:, None] * unknowns[: self._subset.size])

    def _spread(self, solution: ComplexArray) -> ComplexArray:
        result = np.zeros((self._size, solution.shape[1]), dtype=np.complex128)
        result[self._subset] = solution
        return result


def _product(matrix: FloatArray, columns: ComplexArray) -> ComplexArray:
    """A real matrix times a few complex columns, without a complex copy of the matrix."""
    count = columns.shape[1]
    both = matrix @ np.concatenate((columns.real, columns.imag), axis=1)
    result = np.empty((matrix.shape[0], count), dtype=np.complex128)
    result.real, result.imag = both[:, :count], both[:, count:]
    return result
