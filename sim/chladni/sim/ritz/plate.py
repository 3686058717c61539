"""A free plate with screws and glued discs, solved by Ritz: modes once, then any frequency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import ResonanceError
from chladni.sim.loads import Load
from chladni.sim.response import Response
from chladni.sim.ritz.assembly import Assembly
from chladni.sim.ritz.basis import Basis
from chladni.sim.ritz.geometry import PlateGeometry, Resolution
from chladni.sim.ritz.grid import GridTable
from chladni.sim.ritz.legendre import gauss_points
from chladni.sim.ritz.loading import LoadCase
from chladni.sim.ritz.modal import ClassModes
from chladni.sim.ritz.symmetry import Mirrors, ParityBasis, find_mirrors

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FINE = Resolution(nx=18, ny=28, rim_rings=2, inclusion_rings=6, inclusion_bubbles=4)
"""On `prototype` within 2e-5 of the converged natural frequencies and 1e-4 of the fields."""
AREA_POINTS = (64, 112)
RESONANCE_BAND = 1e-6
"""As for the simply supported plate: closer to a mode than this, relative, nothing is left."""
CHECK_POINTS = (24, 48)
"""Grid on which two resolutions are compared for the error estimate."""


@dataclass(frozen=True)
class _Class:
    """One parity class, solved at full resolution and, for the error estimate, at a lower one."""

    basis: ParityBasis
    fine: ClassModes
    coarse: ClassModes


class RitzPlate:
    """Modes and fields of a free plate; see rings.py for the method.

    Parameters
    ----------
    geometry
        Plate, supports and features.
    loss_factor
        η in D(1 + iη).
    resolution
        Size of the basis.
    mirrors
        Mirrors to use; those the geometry has by default.
    """

    def __init__(
        self,
        geometry: PlateGeometry,
        loss_factor: float,
        resolution: Resolution = FINE,
        *,
        mirrors: Mirrors | None = None,
    ) -> None:
        self.geometry = geometry
        self.loss_factor = loss_factor
        self.basis = Basis(geometry, resolution)
        self.mirrors = find_mirrors(geometry) if mirrors is None else mirrors
        self.assembly = Assembly(self.basis, self.mirrors, AREA_POINTS)
        self._last_case: tuple[tuple[Load, ...], LoadCase] | None = None
        self._grids: dict[bytes, GridTable] = {}

    @cached_property
    def _classes(self) -> list[_Class]:
        classes = []
        for parity in self.mirrors.classes():
            basis = ParityBasis(self.basis, parity)
            stiffness = self.assembly.stiffness(basis)
            mass = self.assembly.mass(basis)
            supports = self.assembly.supports(basis)
            every = np.arange(basis.size)
            few = basis.subset(fewer_polynomials=4, fewer_orders=1)
            classes.append(
                _Class(
                    basis,
                    ClassModes(stiffness, mass, supports, every),
                    ClassModes(stiffness, mass, supports, few),
                )
            )
        return classes

    def natural_frequencies(self, count: int) -> FloatArray:
        """The lowest natural frequencies, Hz, shape (count,); rigid motions count as 0."""
        squares = np.sort(np.concatenate([c.fine.omega_squared for c in self._classes]))[:count]
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi))

    def respond(
        self,
        loads: Sequence[Load],
        *,
        frequency_hz: float,
        x: FloatArray,
        y: FloatArray,
        tolerance: float,
    ) -> Response:
        """Fields on the grid x × y under unit loads.

        The estimate is the change when the basis loses four degrees each way and one angular
        order, so it is the error of the coarser of two solutions and bounds the finer one's.
        """
        self._refuse_resonance(frequency_hz)
        omega = 2.0 * np.pi * frequency_hz
        case = self._case(tuple(loads))
        key = x.tobytes() + y.tobytes()
        if key not in self._grids:
            self._grids[key] = GridTable(self.basis, self.mirrors, x, y)
        fine = self._solve(case, omega, coarse=False)
        coarse = self._solve(case, omega, coarse=True)
        values = self._grids[key].fields(self._class_bases, fine)
        factor = 1.0 + 1j * self.loss_factor
        values += case.field_on(x, y) / factor
        self._grids[key].clear_cut_out(values)
        probe = self._probe
        change = probe.fields(self._class_bases, [f - c for f, c in zip(fine, coarse, strict=True)])
        whole = probe.fields(self._class_bases, fine) + case.field_on(probe.x, probe.y) / factor
        axes = (1, 2)
        norm = np.sqrt(np.sum(np.abs(whole) ** 2, axis=axes))
        error = np.sqrt(np.sum(np.abs(change) ** 2, axis=axes)) / norm
        return Response(values, self.basis.size, float(error.max()))

    def _case(self, loads: tuple[Load, ...]) -> LoadCase:
        """The loads projected onto the basis; the last case is kept, for the next frequency."""
        if self._last_case is None or self._last_case[0] != loads:
            self._last_case = (loads, LoadCase(self.assembly, loads))
        return self._last_case[1]

    @cached_property
    def _class_bases(self) -> list[ParityBasis]:
        return [c.basis for c in self._classes]

    @cached_property
    def _probe(self) -> GridTable:
        points = [
            gauss_points(length, count)[0]
            for length, count in zip(
                (self.geometry.width, self.geometry.length), CHECK_POINTS, strict=True
            )
        ]
        return GridTable(self.basis, self.mirrors, *points)

    def _solve(self, case: LoadCase, omega: float, *, coarse: bool) -> list[ComplexArray]:
        """Coefficients per class, each of shape (class size, loads)."""
        result = []
        for cls in self._classes:
            modes = cls.coarse if coarse else cls.fine
            result.append(modes.respond(case.in_class(cls.basis), omega, self.loss_factor))
        return result

    def _refuse_resonance(self, frequency_hz: float) -> None:
        if self.loss_factor > 0.0:
            return
        modes = self.natural_frequencies(sum(c.fine.omega_squared.size for c in self._classes))
        nearest = int(np.argmin(np.abs(modes - frequency_hz)))
        if abs(modes[nearest] / frequency_hz - 1.0) < RESONANCE_BAND:
            raise ResonanceError(frequency_hz, float(modes[nearest]), str(nearest + 1))
