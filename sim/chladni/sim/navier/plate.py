"""Simply supported rectangular plate: closed modes, summed until the rest is small enough."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import j1

from chladni.sim.errors import RESONANCE_BAND, ResonanceError
from chladni.sim.plate.loads import Load
from chladni.sim.plate.mirrored_grid import MirroredGrid, Oddness
from chladni.sim.plate.mirrors import Mirrors, orbits_of
from chladni.sim.plate.modes import ModeShapes
from chladni.sim.plate.response import Excitation, PlateModel, Response

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MAX_MODES_PER_SIDE = 2000
STILL = 1e-9
"""A field this small beside that of an endless plate is no motion."""
RADIUS_STEP = 1.15
"""Wave numbers to sum up to are tried this far apart."""


@dataclass(frozen=True)
class SimplySupportedPlate(PlateModel):
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

    def _respond(self, excitation: Excitation) -> Response:
        """Sum modes until the tail is below the tolerance.

        With q = φₘₙ(x₀, y₀) / (ω²ₘₙ(1 + iη) − ω²) and orthogonal modes, the squared L² error is
        the tail of Σ|q|², which the integral in `_tail` bounds.
        """
        self._refuse_resonance(excitation.frequency_hz)
        x, y, omega = excitation.x, excitation.y, excitation.omega
        shared = Mirrors(x=True, y=True).shared_with(x, y)
        orbits = orbits_of(excitation.loads, shared)
        # Along y too the products would be as many, and the putting together more.
        grid = MirroredGrid(x, y, Mirrors(x=shared.x, y=False))
        radius, tail = self._cutoff(omega, orbits.distinct, excitation.tolerance)
        weights, inside = self._weights(orbits.distinct, omega, radius)
        energies = _energies(weights)
        # A load on an edge moves nothing, and of nothing there is no relative error.
        moved = energies[energies > self._still_energy(omega)]
        error = np.sqrt(tail / moved.min()) if moved.size else 0.0
        values = grid.unfold(self._shares(grid, orbits.distinct, weights), orbits)
        return Response(
            values, int(inside.sum()), float(error), excitation.frequency_hz, excitation.tolerance
        )

    def _shares(
        self, grid: MirroredGrid, loads: Sequence[Load], weights: NDArray[Any]
    ) -> Iterator[dict[Oddness, FloatArray]]:
        """Sums over the modes of each parity on the grid's fundamental part, load by load.

        Shape (parts, *part_shape): one part where the weights, (loads, modes along x, along y), are
        real, as on a plate without loss. A sine with an odd number of half waves is even about the
        plate's middle, and a load there moves no other.
        """
        shapes_x = _sines(np.pi * (grid.part_x / self.width + 0.5), weights.shape[1])
        shapes_y = _sines(np.pi * (grid.part_y / self.length + 0.5), weights.shape[2])
        by_parity = [
            (odd_x, own_x, np.ascontiguousarray(shapes_x[own_x].T))
            for odd_x, own_x in _by_parity(mirrored=grid.mirrors.x)
        ]
        for load, own in zip(loads, weights, strict=True):
            parts = np.stack((own.real, own.imag)) if np.iscomplexobj(own) else own[None]
            along_y = parts @ shapes_y
            yield {
                (odd_x, False): shape_x @ along_y[:, own_x]
                for odd_x, own_x, shape_x in by_parity
                if not odd_x or load.x != 0.0
            }

    def _modes(self, count: int, loads: Sequence[Load], x: FloatArray, y: FloatArray) -> ModeShapes:
        """The lowest modes on the grid x × y, and what unit loads do to them."""
        index = np.arange(1, count + 2)
        squares = self._omega_squared(index, index)
        order = np.argsort(squares, axis=None, kind="stable")[:count]
        m, n = np.unravel_index(order, squares.shape)
        wave_x, wave_y = self._waves(index, index)
        norm = 2.0 / np.sqrt(self.width * self.length * self.areal_mass)
        along_x = np.sin(np.outer(wave_x[m], x + self.width / 2.0))
        along_y = np.sin(np.outer(wave_y[n], y + self.length / 2.0))
        work = self._participations(loads, wave_x, wave_y)[:, m, n]
        return ModeShapes(
            np.sqrt(squares[m, n]) / (2.0 * np.pi),
            norm * along_x[:, :, None] * along_y[:, None, :],
            norm * work.reshape(len(loads), count),
        )

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

    def _participations(
        self, loads: Sequence[Load], wave_x: FloatArray, wave_y: FloatArray
    ) -> FloatArray:
        """Means of sin·sin over each load, shape (loads, modes along x, modes along y).

        The value at its centre, times 2J₁(kR)/(kR) for a disc.
        """
        places = np.array([(load.x, load.y) for load in loads]).reshape(-1, 2, 1)
        at_x = np.sin(wave_x * (places[:, 0] + self.width / 2.0))
        at_y = np.sin(wave_y * (places[:, 1] + self.length / 2.0))
        result = at_x[:, :, None] * at_y[:, None, :]
        for i, load in enumerate(loads):
            if load.radius > 0.0:
                k = np.hypot(wave_x[:, None], wave_y) * load.radius
                result[i] *= 2.0 * j1(k) / k
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

    def _weights(
        self, loads: Sequence[Load], omega: float, radius: float
    ) -> tuple[NDArray[Any], NDArray[np.bool_]]:
        """What each mode's sines are summed with, and which modes are within the radius.

        Both by (modes along x, along y), the first by load before that, and zero for other modes.
        """
        wave_x, wave_y = self._waves(
            np.arange(1, int(radius * self.width / np.pi) + 1),
            np.arange(1, int(radius * self.length / np.pi) + 1),
        )
        square = wave_x[:, None] ** 2 + wave_y**2
        inside = square <= radius**2
        stiffness = self.bending_stiffness * self._stiffness_factor * square**2
        moving = stiffness - self.areal_mass * omega**2
        norm = 4.0 / (self.width * self.length)
        gain = np.where(inside, norm / moving, 0.0)
        return gain * self._participations(loads, wave_x, wave_y), inside

    def _cutoff(self, omega: float, loads: Sequence[Load], tolerance: float) -> tuple[float, float]:
        """Wave number up to which modes are summed, and the bound on Σ|q|² beyond it."""
        free = (self.areal_mass / self.bending_stiffness) ** 0.25 * math.sqrt(omega)
        limit = MAX_MODES_PER_SIDE * math.pi / self.length
        first = min(max(2.0 * free, 8.0 * math.pi / min(self.width, self.length)), limit)
        # Below the first radius is most of the energy, and any part of it is on the safe side.
        least = float(_energies(self._weights(loads, omega, first)[0]).min())
        radius, tail = first, self._tail(first, omega)
        while radius < limit and tail > tolerance**2 * least:
            radius = min(radius * RADIUS_STEP, limit)
            tail = self._tail(radius, omega)
        return radius, tail

    def _still_energy(self, omega: float) -> float:
        """Σ|q|² of a field that is `STILL` times as large as that of an endless plate at its load.

        There w = 1/(8ω√(Dρh)) per newton (Cremer, Heckl, Petersson, Structure-Borne Sound, 4.3).
        """
        endless = 1.0 / (8.0 * omega * math.sqrt(self.bending_stiffness * self.areal_mass))
        return (STILL * endless) ** 2 * self.width * self.length * self.areal_mass

    def _tail(self, radius: float, omega: float) -> float:
        """Bound on Σ|q|² beyond a wave number, from sin² ≤ 1 and the mode density ab/π² · π/2 k dk.

        With D/ρh k⁴ − ω² ≥ D/ρh k⁴ (1 − (k₀/K)⁴) for k ≥ K, the sum is at most
        c² · ab/(2π) ∫ k⁻⁷ dk. Counting cells of the mode lattice by their lower corner moves the
        limit inwards by one cell diagonal.
        """
        ratio = self.bending_stiffness / self.areal_mass
        start = radius - math.pi * math.hypot(1.0 / self.width, 1.0 / self.length)
        free4 = omega**2 / ratio
        if start**4 <= 2.0 * free4:
            return math.inf
        norm = 4.0 / (self.width * self.length * self.areal_mass)
        scale = norm / (ratio * (1.0 - free4 / start**4))
        density = self.width * self.length / (2.0 * math.pi)
        return scale**2 * density * start**-6 / 6.0


def _energies(weights: NDArray[Any]) -> FloatArray:
    """Σ|q|² over the modes, per load."""
    return np.asarray(np.sum((weights * weights.conj()).real, axis=(1, 2)))


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
