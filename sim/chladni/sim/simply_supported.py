"""Simply supported rectangular plate: closed modes, summed until the rest is small enough."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import j1

from chladni.sim.errors import RESONANCE_BAND, ResonanceError
from chladni.sim.levy import LEAST_WAVE, levy_displacement
from chladni.sim.loads import Load
from chladni.sim.mirrored_grid import MirroredGrid, Oddness
from chladni.sim.mirrors import Mirrors, orbits_of
from chladni.sim.modes import ModeShapes
from chladni.sim.response import Response

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MAX_MODES_PER_SIDE = 2000


@dataclass(frozen=True)
class SimplySupportedPlate:
    """Modes φₘₙ = 2/√(abρh) sin(mπx/a) sin(nπy/b), x and y from a corner (physics.md).

    Parameters
    ----------
    width, length
        Along x and y, m.
    bending_stiffness
        D, N·m.
    areal_mass
        ρh, kg/m².
    loss_factor
        η in D(1 + iη).
    """

    width: float
    length: float
    bending_stiffness: float
    areal_mass: float
    loss_factor: float

    def natural_frequencies(self, count: int) -> FloatArray:
        """The lowest natural frequencies, Hz, shape (count,)."""
        side = count + 1
        omega = np.sqrt(self._omega_squared(np.arange(1, side + 1), np.arange(1, side + 1)))
        return np.asarray(np.sort(omega.ravel())[:count] / (2.0 * np.pi))

    def respond(
        self,
        loads: Sequence[Load],
        *,
        frequency_hz: float,
        x: FloatArray,
        y: FloatArray,
        tolerance: float,
    ) -> Response:
        """Fields on the grid x × y under unit loads; sums modes until the tail is below tolerance.

        With q = φₘₙ(x₀, y₀) / (ω²ₘₙ(1 + iη) − ω²) and orthogonal modes, the squared L² error is
        the tail of Σ|q|², which the integral in `_tail` bounds.

        Raises
        ------
        ResonanceError
            The plate has no loss and `frequency_hz` lies on a mode.
        """
        omega = 2.0 * np.pi * frequency_hz
        self._refuse_resonance(frequency_hz)
        orbits = orbits_of(loads, Mirrors(x=True, y=True).shared_with(x, y))
        # Along y too the products would be as many, and the putting together more.
        grid = MirroredGrid(x, y, Mirrors(x=True, y=False))
        radius = self._cutoff(omega, orbits.distinct, tolerance)
        m = np.arange(1, int(radius * self.width / np.pi) + 1)
        n = np.arange(1, int(radius * self.length / np.pi) + 1)
        wave_x, wave_y = self._waves(m, n)
        inside = wave_x[:, None] ** 2 + wave_y**2 <= radius**2
        stiffness = self._omega_squared(m, n) * self._stiffness_factor
        gain = np.where(inside, 1.0 / (stiffness - omega**2), 0.0)
        norm = 4.0 / (self.width * self.length * self.areal_mass)
        weights = np.array(
            [norm * gain * self._participation(load, wave_x, wave_y) for load in orbits.distinct]
        )
        energies = np.sum(np.abs(weights) ** 2, axis=(1, 2))
        error = np.sqrt(self._tail(radius, omega) / max(energies.min(), np.finfo(float).tiny))
        # A lossless plate is all real; its sums cost half.
        is_real = not np.iscomplexobj(weights)
        columns = weights if is_real else np.concatenate((weights.real, weights.imag))
        shape = (1 if is_real else 2, len(orbits.distinct), *grid.part_shape)
        shares = self._shares(grid, columns)
        values = grid.unfold({odd: own.reshape(shape) for odd, own in shares.items()}, orbits)
        return Response(values, int(inside.sum()), float(error), frequency_hz)

    def _shares(self, grid: MirroredGrid, columns: FloatArray) -> dict[Oddness, FloatArray]:
        """Sums over the modes of each parity, on the grid's fundamental part.

        `columns` has shape (columns, modes along x, modes along y). A sine with an odd number of
        half waves is even about the plate's middle.
        """
        _, count_x, count_y = columns.shape
        shapes_x = _sines(np.pi * (grid.part_x / self.width + 0.5), count_x)
        shapes_y = _sines(np.pi * (grid.part_y / self.length + 0.5), count_y)
        shares: dict[Oddness, FloatArray] = {}
        along_y = columns @ shapes_y
        for odd_x, own_x in _by_parity(mirrored=grid.mirrors.x):
            if own_x.start < count_x:
                own = np.ascontiguousarray(along_y[:, own_x])
                shares[odd_x, False] = np.ascontiguousarray(shapes_x[own_x].T) @ own
        return shares

    def respond_over(
        self,
        loads: Sequence[Load],
        frequencies_hz: FloatArray,
        *,
        x: FloatArray,
        y: FloatArray,
        tolerance: float,
    ) -> Iterator[Response]:
        """The same for many frequencies, one after another: each has its own sum."""
        for frequency in frequencies_hz.tolist():
            yield self.respond(loads, frequency_hz=frequency, x=x, y=y, tolerance=tolerance)

    def modes(self, count: int, loads: Sequence[Load], x: FloatArray, y: FloatArray) -> ModeShapes:
        """The lowest modes on the grid x × y, and what unit loads do to them."""
        index = np.arange(1, count + 2)
        squares = self._omega_squared(index, index)
        order = np.argsort(squares, axis=None, kind="stable")[:count]
        m, n = np.unravel_index(order, squares.shape)
        wave_x, wave_y = self._waves(index, index)
        norm = 2.0 / np.sqrt(self.width * self.length * self.areal_mass)
        along_x = np.sin(np.outer(wave_x[m], x + self.width / 2.0))
        along_y = np.sin(np.outer(wave_y[n], y + self.length / 2.0))
        work = np.array([self._participation(load, wave_x, wave_y)[m, n] for load in loads])
        return ModeShapes(
            np.sqrt(squares[m, n]) / (2.0 * np.pi),
            norm * along_x[:, :, None] * along_y[:, None, :],
            norm * work.reshape(len(loads), count),
        )

    def respond_at(
        self,
        loads: Sequence[Load],
        frequencies_hz: FloatArray,
        points: FloatArray,
        *,
        tolerance: float,
    ) -> ComplexArray:
        """Displacement per newton at points (points, 2); shape (loads, frequencies, points).

        Point forces by Lévy's single series, which is exact at every point; discs, and frequencies
        so low that the series loses digits, by the double sum.
        """
        result = np.empty((len(loads), frequencies_hz.size, len(points)), dtype=np.complex128)
        for k, frequency in enumerate(frequencies_hz.tolist()):
            self._refuse_resonance(frequency)
            for i, load in enumerate(loads):
                result[i, k] = self._at_points(load, frequency, points, tolerance)
        return result

    def _at_points(
        self, load: Load, frequency_hz: float, points: FloatArray, tolerance: float
    ) -> ComplexArray:
        omega = 2.0 * np.pi * frequency_hz
        wave = (self.areal_mass / self.bending_stiffness) ** 0.25 * np.sqrt(omega)
        if load.radius == 0.0 and wave * self.width / np.pi > LEAST_WAVE:
            return levy_displacement(
                (self.width, self.length),
                self.bending_stiffness * self._stiffness_factor,
                self.areal_mass,
                omega,
                (load.x, load.y),
                points,
                tolerance,
            )
        values = [
            self.respond(
                [load], frequency_hz=frequency_hz, x=np.array([x]), y=np.array([y]),
                tolerance=tolerance,
            ).values[0, 0, 0]
            for x, y in points
        ]  # fmt: skip
        return np.array(values, dtype=np.complex128)

    @property
    def _stiffness_factor(self) -> complex | float:
        return 1.0 + 1j * self.loss_factor if self.loss_factor else 1.0

    def _waves(self, m: NDArray[np.intp], n: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Wave numbers mπ/a and nπ/b, rad/m."""
        return np.asarray(m * (np.pi / self.width)), np.asarray(n * (np.pi / self.length))

    def _omega_squared(self, m: NDArray[np.intp], n: NDArray[np.intp]) -> FloatArray:
        wave_x, wave_y = self._waves(m, n)
        wave = wave_x[:, None] ** 2 + wave_y**2
        return np.asarray(self.bending_stiffness / self.areal_mass * wave**2)

    def _participation(self, load: Load, wave_x: FloatArray, wave_y: FloatArray) -> FloatArray:
        """Mean of sin·sin over the load: the value at its centre times 2J₁(kR)/(kR) for a disc."""
        at_x = np.sin(wave_x * (load.x + self.width / 2.0))
        at_y = np.sin(wave_y * (load.y + self.length / 2.0))
        result = np.outer(at_x, at_y)
        if load.radius > 0.0:
            k = np.hypot(wave_x[:, None], wave_y) * load.radius
            result *= 2.0 * j1(k) / k
        return result

    def _refuse_resonance(self, frequency_hz: float) -> None:
        if self.loss_factor > 0.0:
            return
        omega = 2.0 * np.pi * frequency_hz
        wave = (self.areal_mass / self.bending_stiffness) ** 0.25 * np.sqrt(omega)
        m = np.arange(1, int(wave * self.width / np.pi) + 3)
        n = np.arange(1, int(wave * self.length / np.pi) + 3)
        modes = np.sqrt(self._omega_squared(m, n)) / (2.0 * np.pi)
        i, j = np.unravel_index(np.argmin(np.abs(modes - frequency_hz)), modes.shape)
        if abs(modes[i, j] / frequency_hz - 1.0) < RESONANCE_BAND:
            raise ResonanceError(frequency_hz, float(modes[i, j]), f"({m[i]}, {n[j]})")

    def _cutoff(self, omega: float, loads: Sequence[Load], tolerance: float) -> float:
        """Wave number up to which modes are summed."""
        free = (self.areal_mass / self.bending_stiffness) ** 0.25 * np.sqrt(omega)
        radius = max(2.0 * free, 8.0 * np.pi / min(self.width, self.length))
        limit = MAX_MODES_PER_SIDE * np.pi / self.length
        norm = 4.0 / (self.width * self.length * self.areal_mass)
        low = np.arange(1, 33)
        wave_x, wave_y = self._waves(low, low)
        stiffness = self._omega_squared(low, low) * self._stiffness_factor
        energy = min(
            float(np.sum(np.abs(norm * self._participation(load, wave_x, wave_y)
                                / (stiffness - omega**2)) ** 2))
            for load in loads
        )  # fmt: skip
        while radius < limit and self._tail(radius, omega) > tolerance**2 * energy:
            radius *= 1.15
        return float(min(radius, limit))

    def _tail(self, radius: float, omega: float) -> float:
        """Bound on Σ|q|² beyond a wave number, from sin² ≤ 1 and the mode density ab/π² · π/2 k dk.

        With D/ρh k⁴ − ω² ≥ D/ρh k⁴ (1 − (k₀/K)⁴) for k ≥ K, the sum is at most
        c² · ab/(2π) ∫ k⁻⁷ dk. Counting cells of the mode lattice by their lower corner moves the
        limit inwards by one cell diagonal.
        """
        ratio = self.bending_stiffness / self.areal_mass
        cell = np.pi * np.hypot(1.0 / self.width, 1.0 / self.length)
        start = radius - cell
        free4 = omega**2 / ratio
        if start**4 <= 2.0 * free4:
            return np.inf
        norm = 4.0 / (self.width * self.length * self.areal_mass)
        scale = norm / (ratio * (1.0 - free4 / start**4))
        density = self.width * self.length / (2.0 * np.pi)
        return float(scale**2 * density * start**-6 / 6.0)


def _sines(angles: FloatArray, count: int) -> FloatArray:
    """sin(k·angle) for k = 1 … count, shape (count, angles).

    Powers of exp(i·angle) by doubling: each is a product of two known ones, so rounding grows with
    log₂ k, and a product is ten times sooner than a sine.
    """
    powers = np.empty((count, angles.size), dtype=np.complex128)
    powers[0] = np.exp(1j * angles)
    known = 1
    while known < count:
        more = min(known, count - known)
        np.multiply(powers[:more], powers[known - 1], out=powers[known : known + more])
        known += more
    return np.ascontiguousarray(powers.imag)


def _by_parity(*, mirrored: bool) -> list[tuple[bool, slice]]:
    """(is odd about the middle, its modes), or all modes at once where nothing is mirrored."""
    return (
        [(False, slice(0, None, 2)), (True, slice(1, None, 2))]
        if mirrored
        else [(False, slice(0, None))]
    )
