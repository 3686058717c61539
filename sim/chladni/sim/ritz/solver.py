"""One plate at one resolution: its parity classes, and coarser solutions to judge the error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chladni.sim.loads import Load
from chladni.sim.modes import ModeShapes
from chladni.sim.ritz.assembly import Assembly
from chladni.sim.ritz.basis import Basis
from chladni.sim.ritz.geometry import PlateGeometry, Resolution
from chladni.sim.ritz.grid import GridTable
from chladni.sim.ritz.legendre import gauss_points
from chladni.sim.ritz.loading import LoadCase
from chladni.sim.ritz.modal import ClassModes
from chladni.sim.ritz.quadrature import Points
from chladni.sim.ritz.symmetry import Mirrors, ParityBasis
from chladni.sim.ritz.tables import BasisTable

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PROBE_POINTS = (24, 48)
"""Gauss points on which two solutions are compared."""
KEPT_GRIDS = 4
FEWER = ((4, 1, 0), (8, 2, 0), (0, 0, 1))
"""(polynomials each way, angular orders on discs, on screws) less in the coarser solutions."""
SAFETY, POWER, LARGEST = 6.0, 0.25, 2.0
RIM_SHARE = 0.25
"""What the next angular order on a screw adds, as a share of what the last did: a hundredth where
it stands alone, a quarter where three stand millimetres apart."""
UNRESOLVED_LOAD = 2e-5
"""Left by a load disc on a glued disc of another size, whose own edge the basis does not follow.

These four were fitted to 220 random boards (1e-8 to 1e-2 of error): one estimate was 0.4 of the
error, all others between it and 99 times it."""
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
        self._works: dict[Load, LoadCase] = {}
        self._last_points: tuple[bytes, BasisTable] | None = None
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
            rings = self.basis.resolution.rim_rings
            row_orders = self.assembly.support_orders(supports.shape[0])
            coarser = [
                ClassModes(
                    stiffness,
                    mass,
                    supports,
                    basis.subset(
                        fewer_polynomials=fewer,
                        fewer_orders=fewer_orders,
                        fewer_on_rims=fewer_on_rims,
                    ),
                    np.flatnonzero(row_orders <= rings - fewer_on_rims),
                )
                for fewer, fewer_orders, fewer_on_rims in FEWER
                if self.basis.rims or not fewer_on_rims
            ]
            every, rows = np.arange(basis.size), np.arange(supports.shape[0])
            modes = ClassModes(stiffness, mass, supports, every, rows)
            result.append(_Class(basis, modes, coarser))
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
        self, case: LoadCase, solutions: Sequence[list[ComplexArray]], loss_factor: float,
        x: FloatArray, y: FloatArray,
    ) -> ComplexArray:  # fmt: skip
        """Fields of several solutions on the grid x × y, shape (solutions, loads, nx, ny).

        Together they cost far less than one by one: reading the grid's tables is what takes time.
        """
        grid = self._grid(x, y)
        columns = [np.concatenate(own, axis=1) for own in zip(*solutions, strict=True)]
        values = grid.fields([c.basis for c in self.classes], columns)
        grid.clear_cut_out(values)
        values = values.reshape(len(solutions), -1, x.size, y.size)
        if not case.is_direct:
            own = case.field_on(x, y) / (1.0 + 1j * loss_factor)
            grid.clear_cut_out(own)
            values += own
        return values

    def at_points(
        self, case: LoadCase, coefficients: list[ComplexArray], loss_factor: float,
        points: FloatArray,
    ) -> ComplexArray:  # fmt: skip
        """Displacements at points (points, 2), shape (loads, points)."""
        x, y = points[:, 0], points[:, 1]
        table = self._point_table(points)
        values = sum(
            table.values(c.basis, (0, 0)) @ own
            for c, own in zip(self.classes, coefficients, strict=True)
        )
        result = np.asarray(values).T
        if not case.is_direct:
            result = result + case.deflection(x, y) / (1.0 + 1j * loss_factor)
        for centre_x, centre_y, radius in self.geometry.cut_out:
            result[:, np.hypot(x - centre_x, y - centre_y) <= radius] = 0.0
        return np.asarray(result)

    def mode_shapes(
        self, count: int, loads: Sequence[Load], x: FloatArray, y: FloatArray
    ) -> ModeShapes:
        """The lowest modes of all classes on the grid x × y, and unit loads' work on them."""
        found = [(value, k, j) for k, c in enumerate(self.classes)
                 for j, value in enumerate(c.modes.omega_squared[:count])]  # fmt: skip
        lowest = sorted(found)[:count]
        grid = self._grid(x, y)
        shapes, work = [], []
        for _, k, j in lowest:
            cls = self.classes[k]
            mode = cls.modes.modes[:, [j]]
            field = grid.fields([cls.basis], [mode.astype(np.complex128)])
            grid.clear_cut_out(field)
            shapes.append(field[0].real)
            work.append([float(self._work(load).in_class(cls.basis).force[:, 0] @ mode[:, 0])
                         for load in loads])  # fmt: skip
        frequencies = np.sqrt(np.maximum([value for value, _, _ in lowest], 0.0)) / (2.0 * np.pi)
        participation = np.array(work).reshape(len(lowest), len(loads)).T
        return ModeShapes(np.asarray(frequencies), np.stack(shapes), participation)

    def _work(self, load: Load) -> LoadCase:
        """A load as plain work on the basis, without a deflection of its own."""
        if load not in self._works:
            self._works[load] = LoadCase(self.assembly, [load], always_direct=True)
        return self._works[load]

    def _point_table(self, points: FloatArray) -> BasisTable:
        """The basis at scattered points; the last one is kept, for the next frequency."""
        key = points.tobytes()
        if self._last_points is None or self._last_points[0] != key:
            weights = np.ones(len(points))
            table = BasisTable(self.basis, Points(points[:, 0], points[:, 1], weights))
            self._last_points = (key, table)
        return self._last_points[1]

    def error_estimates(
        self, case: LoadCase, solutions: Sequence[list[ComplexArray]], omegas: Sequence[float],
        loss_factor: float,
    ) -> FloatArray:  # fmt: skip
        """Relative L² error of every solution, the largest of its loads.

        Coarser solutions in the same matrices give two steps of the polynomials and the discs. The
        next would shrink by their ratio; its fourth root is taken, since a ratio seen once may
        flatter. Screws have few orders, so the last one's step stands for the next.
        """
        probe, loads = self._probe, solutions[0][0].shape[1]
        # All in one call: on so small a grid a call costs more than its sums.
        columns = []
        for number, c in enumerate(self.classes):
            load, own = case.in_class(c.basis), []
            for solution, omega in zip(solutions, omegas, strict=True):
                fine = solution[number]
                coarse, coarsest, *fewer = [k.solve(load, omega, loss_factor) for k in c.coarser]
                own += [fine, fine - coarse, coarse - coarsest, *(fine - k for k in fewer)]
            columns.append(np.concatenate(own, axis=1))
        fields = probe.fields([c.basis for c in self.classes], columns)
        shape = (len(solutions), -1, loads, *fields.shape[1:])
        fields = fields.reshape(shape)
        fields[:, 0] += case.field_on(probe.x, probe.y) / (1.0 + 1j * loss_factor)
        norms = np.moveaxis(np.sqrt(np.sum(np.abs(fields) ** 2, axis=(3, 4))), 1, 0)
        whole, last, before, *on_rims = norms

        ratio = last / np.maximum(before, 1e-300)
        error = last * np.minimum(SAFETY * ratio**POWER, LARGEST)
        for step in on_rims:
            error = error + RIM_SHARE * step
        floor = ROUNDING + (UNRESOLVED_LOAD if case.is_unresolved else 0.0)
        return np.asarray(np.max(error / np.maximum(whole, 1e-300), axis=1) + floor)

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
