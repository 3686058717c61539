"""One plate at one resolution: its parity classes, and coarser solutions to judge the error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chladni.sim.loads import Load
from chladni.sim.ritz.assembly import Assembly
from chladni.sim.ritz.basis import Basis
from chladni.sim.ritz.geometry import PlateGeometry, Resolution
from chladni.sim.ritz.grid import GridTable
from chladni.sim.ritz.legendre import gauss_points
from chladni.sim.ritz.loading import LoadCase
from chladni.sim.ritz.modal import ClassModes
from chladni.sim.ritz.symmetry import Mirrors, ParityBasis

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PROBE_POINTS = (24, 48)
"""Gauss points on which two solutions are compared."""
KEPT_GRIDS = 4
FEWER = ((4, 1), (8, 2))
"""(polynomials each way, angular orders) less in the two coarser solutions."""
SAFETY, LARGEST = 3.0, 2.0
ROUNDING = 1e-11
"""Relative error that conditioning leaves however large the basis."""


@dataclass(frozen=True)
class _Class:
    basis: ParityBasis
    modes: ClassModes
    coarser: list[ClassModes]


class Solver:
    """A plate's modes and responses in one basis."""

    def __init__(self, geometry: PlateGeometry, mirrors: Mirrors, resolution: Resolution) -> None:
        self.geometry = geometry
        self.mirrors = mirrors
        self.basis = Basis(geometry, resolution)
        area_points = tuple(2 * (5 * n // 4 + 12) for n in (resolution.nx, resolution.ny))
        self.assembly = Assembly(self.basis, mirrors, (area_points[0], area_points[1]))
        self._last_case: tuple[tuple[Load, ...], LoadCase] | None = None
        self._grids: dict[bytes, GridTable] = {}

    @cached_property
    def classes(self) -> list[_Class]:
        """Every parity class with its modes."""
        result = []
        for parity in self.mirrors.classes():
            basis = ParityBasis(self.basis, parity)
            stiffness = self.assembly.stiffness(basis)
            mass = self.assembly.mass(basis)
            supports = self.assembly.supports(basis)
            coarser = [
                ClassModes(
                    stiffness, mass, supports,
                    basis.subset(fewer_polynomials=fewer, fewer_orders=orders),
                )
                for fewer, orders in FEWER
            ]  # fmt: skip
            every = np.arange(basis.size)
            result.append(_Class(basis, ClassModes(stiffness, mass, supports, every), coarser))
        return result

    @cached_property
    def omega_squared(self) -> FloatArray:
        """ω² of all modes of all classes, ascending, (rad/s)²; rigid motions as 0."""
        squares = np.concatenate([c.modes.omega_squared for c in self.classes])
        return np.asarray(np.maximum(np.sort(squares), 0.0))

    def case(self, loads: Sequence[Load]) -> LoadCase:
        """Loads projected onto the basis; the last case is kept, for the next frequency."""
        key = tuple(loads)
        if self._last_case is None or self._last_case[0] != key:
            self._last_case = (key, LoadCase(self.assembly, key))
        return self._last_case[1]

    def coefficients(self, case: LoadCase, omega: float, loss_factor: float) -> list[ComplexArray]:
        """The response per class, each of shape (class size, loads)."""
        return [c.modes.respond(case.in_class(c.basis), omega, loss_factor) for c in self.classes]

    def field(
        self, case: LoadCase, coefficients: list[ComplexArray], loss_factor: float,
        x: FloatArray, y: FloatArray,
    ) -> ComplexArray:  # fmt: skip
        """Fields on the grid x × y, shape (loads, nx, ny)."""
        grid = self._grid(x, y)
        values = grid.fields([c.basis for c in self.classes], coefficients)
        if not case.is_direct:
            values += case.field_on(x, y) / (1.0 + 1j * loss_factor)
        grid.clear_cut_out(values)
        return values

    def error_estimate(
        self, case: LoadCase, fine: list[ComplexArray], omega: float, loss_factor: float
    ) -> float:
        """Relative L² error of the response, the largest of the loads.

        Two coarser solutions in the same matrices give two steps. The next would shrink by their
        ratio; its root is taken, since a ratio seen once may flatter, and a safety factor.
        """
        bases = [c.basis for c in self.classes]
        probe = self._probe
        solutions = [fine] + [
            [c.coarser[k].solve(case.in_class(c.basis), omega, loss_factor) for c in self.classes]
            for k in range(len(FEWER))
        ]
        steps = []
        for one, other in pairwise(solutions):
            change = probe.fields(bases, [a - b for a, b in zip(one, other, strict=True)])
            steps.append(_norm(change))
        whole = probe.fields(bases, fine) + case.field_on(probe.x, probe.y) / (1 + 1j * loss_factor)
        last, before = steps
        ratio = last / np.maximum(before, 1e-300)
        error = last * np.minimum(SAFETY * np.sqrt(ratio), LARGEST)
        return float(np.max(error / np.maximum(_norm(whole), 1e-300)) + ROUNDING)

    def _grid(self, x: FloatArray, y: FloatArray) -> GridTable:
        key = x.tobytes() + b"|" + y.tobytes()
        if key not in self._grids:
            if len(self._grids) >= KEPT_GRIDS:
                self._grids.pop(next(iter(self._grids)))
            self._grids[key] = GridTable(self.basis, self.mirrors, x, y)
        return self._grids[key]

    @cached_property
    def _probe(self) -> GridTable:
        sides = (self.geometry.width, self.geometry.length)
        x, y = (gauss_points(s, n)[0] for s, n in zip(sides, PROBE_POINTS, strict=True))
        return GridTable(self.basis, self.mirrors, x, y)


def _norm(fields: ComplexArray) -> FloatArray:
    return np.asarray(np.sqrt(np.sum(np.abs(fields) ** 2, axis=(1, 2))))
