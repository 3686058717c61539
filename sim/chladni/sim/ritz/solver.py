"""One plate at one resolution: its parity classes, and coarser solutions to judge the error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.geometry import PlateGeometry
from chladni.sim.plate.loads import Load
from chladni.sim.plate.mirrored_grid import Oddness
from chladni.sim.plate.mirrors import Mirrors, Orbits
from chladni.sim.plate.modes import ModeShapes
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.parity import ParityBasis, parity_classes
from chladni.sim.ritz.basis.quadrature import gauss_points
from chladni.sim.ritz.basis.resolution import (
    MOST_VALUES,
    Resolution,
    area_points,
    crowding,
    left_beside,
    stretch,
)
from chladni.sim.ritz.forms.assembly import Assembly
from chladni.sim.ritz.forms.features import sprung_loss_factors
from chladni.sim.ritz.image_grid import GridTable
from chladni.sim.ritz.load_cases import LoadCase
from chladni.sim.ritz.modal import ClassModes

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PROBE_POINTS = (24, 48)
"""Gauss points on which two solutions are compared."""
KEPT_GRIDS = 4
FEWER = ((2, 0, 0), (0, 1, 0), (0, 0, 1))
"""(polynomials along the short side, angular orders on discs, on screws) less in each coarser
solution. Along a long side as many polynomials more as it has more of them."""
SHARES = (6.5, 1.6, 0.3)
"""What is left to find, as so many times what each of those steps did, at least."""
CROWDED_SHARE = 2.0
"""The same where circles are near others, as so many times what a geometric series leaves."""
UNSETTLED = 6.0
"""An error this many times itself larger: near one, modes stand at other frequencies."""
UNRESOLVED_LOAD = 2e-5
"""Left by a load disc on a glued disc of another size, whose own edge the basis does not follow.

These were fitted to 600 random boards (errors of 1e-8 to 0.4): estimates came to 1.4 to 69 times
the error, 13 in the median."""
FORM_ERROR = 3e-7
"""Relative error of stiffness that no step shows (2.5e-7 at the first modes of `prototype`). It
moves modes, and near one fields follow."""
ROUNDING = 1e-11
"""Relative error that conditioning leaves however large the basis."""


@dataclass(frozen=True)
class Estimate:
    """Relative L² error of a solution, the largest of its loads, and what of it a step would mend.

    Attributes
    ----------
    error
        All of it.
    polynomials, orders
        What more polynomials, and more angular orders on circles, would find.
    """

    error: float
    polynomials: float
    orders: float


@dataclass(frozen=True)
class _Class:
    basis: ParityBasis
    modes: ClassModes
    coarser: list[ClassModes]


@dataclass(frozen=True)
class ParityFields:
    """A case's fields at one frequency, still split by parity."""

    _table: GridTable
    _shares: dict[Oddness, FloatArray]
    _own_field: ComplexArray | None

    def unfold(self, orbits: Orbits) -> ComplexArray:
        """The fields of every load on the whole grid, shape (loads, nx, ny)."""
        by_load = (
            {odd: share[:, k] for odd, share in self._shares.items()}
            for k in range(len(orbits.distinct))
        )
        values = self._table.grid.unfold(by_load, orbits)
        if self._own_field is not None:
            for load, (k, (sx, sy)) in enumerate(orbits.images):
                values[load] += self._own_field[k, :: int(sx), :: int(sy)]
        self._table.clear_cut_out(values)
        return values


class Solver:
    """A plate's modes and responses in one basis."""

    def __init__(self, geometry: PlateGeometry, mirrors: Mirrors, resolution: Resolution) -> None:
        self.geometry = geometry
        self.mirrors = mirrors
        self.basis = Basis(geometry, resolution)
        self.assembly = Assembly(self.basis, mirrors, area_points(geometry, resolution))
        self._steps = self._fewer()
        self.classes = self._classes()
        sides = (geometry.width, geometry.length)
        x, y = (gauss_points(s, n)[0] for s, n in zip(sides, PROBE_POINTS, strict=True))
        self._probe = GridTable(self.basis, mirrors, x, y)
        self._last_case: tuple[tuple[Load, ...], LoadCase] | None = None
        self._works: dict[Load, LoadCase] = {}
        self._grids: dict[bytes, GridTable] = {}

    def is_lossy(self, loss_factor: float) -> bool:
        """Whether fields have an imaginary part."""
        layer, factors = self.geometry.foundation, sprung_loss_factors(self.geometry)
        own = {loss_factor, *factors, layer.loss_factor if layer else 0.0}
        return max(own) > 0.0

    def _fewer(self) -> list[tuple[tuple[int, int, int], float]]:
        """Those of `FEWER` that take anything away, with their shares."""
        takes = (True, bool(self.basis.inclusions), bool(self.basis.rims))
        decay, rims = crowding(self.geometry), len(self.basis.rims)
        beside = [
            CROWDED_SHARE * left_beside(float(own.min(initial=np.inf)))
            for own in (np.zeros(0), decay[rims:], decay[:rims])
        ]
        steps = zip(FEWER, np.maximum(SHARES, beside).tolist(), strict=True)
        return [step for step, any_left in zip(steps, takes, strict=True) if any_left]

    def _classes(self) -> list[_Class]:
        """Every parity class with its modes."""
        result = []
        along_x, along_y = stretch(self.geometry)
        for parity in parity_classes(self.mirrors):
            basis = ParityBasis(self.basis, parity)
            stiffness = self.assembly.stiffness(basis)
            overlap = self.assembly.overlap(basis)
            mass = self.assembly.mass(basis, overlap)
            damped = self.assembly.damped(basis, overlap)
            if damped is not None:
                stiffness += damped.stiffness
            supports = self.assembly.supports(basis)
            coarser = [
                ClassModes(
                    stiffness,
                    mass,
                    supports,
                    basis.subset(
                        fewer_polynomials=(fewer * int(along_x), fewer * int(along_y)),
                        fewer_orders=fewer_orders,
                        fewer_on_rims=fewer_on_rims,
                    ),
                    np.flatnonzero(~(supports.is_finest & (fewer_on_rims > 0))),
                    polynomials=basis.polynomials,
                    damped=damped,
                )
                for (fewer, fewer_orders, fewer_on_rims), _ in self._steps
            ]
            every, rows = np.arange(basis.size), np.arange(supports.moments.shape[0])
            modes = ClassModes(
                stiffness,
                mass,
                supports,
                every,
                rows,
                polynomials=basis.polynomials,
                damped=damped,
            )
            result.append(_Class(basis, modes, coarser))
        return result

    @property
    def omega_squared(self) -> FloatArray:
        """ω² of all modes of all classes, ascending, (rad/s)²; rigid motions as 0."""
        squares = np.concatenate([c.modes.omega_squared for c in self.classes])
        return np.asarray(np.maximum(np.sort(squares), 0.0))

    def case(self, loads: Sequence[Load]) -> LoadCase:
        """Loads projected onto the basis; the last case is kept, for the next frequency."""
        key = tuple(loads)
        if self._last_case is None or self._last_case[0] != key:
            self._last_case = (key, LoadCase(self.assembly.samples, key))
        return self._last_case[1]

    def coefficients(self, case: LoadCase, omega: float, loss_factor: float) -> list[ComplexArray]:
        """The response per class, each of shape (class size, loads)."""
        return [c.modes.solve(case.in_class(c.basis), omega, loss_factor) for c in self.classes]

    def resonance(self, omega: float) -> float:
        """About ω²/|ω²ₙ − ω²| of the nearest mode of a plate without loss, after a solution."""
        return max(c.modes.resonance(omega) for c in self.classes)

    def image(
        self,
        case: LoadCase,
        solution: list[ComplexArray],
        loss_factor: float,
        x: FloatArray,
        y: FloatArray,
    ) -> ParityFields:
        """The case's solution on the grid x × y."""
        table = self._grid(x, y)
        parts = (np.real, np.imag) if self.is_lossy(loss_factor) else (np.real,)
        # All in one call: reading the grid's tables is what takes time.
        columns = [np.concatenate([part(own) for part in parts], axis=1) for own in solution]
        read = table.shares([c.basis for c in self.classes], columns)
        shape = (len(parts), -1, *table.grid.part_shape)
        shares = {odd: own.reshape(shape) for odd, own in read.items()}
        own_field: ComplexArray | None = None
        if not case.is_direct:
            own_field = np.asarray(case.field_on(x, y) / (1.0 + 1j * loss_factor))
        return ParityFields(table, shares, own_field)

    def mode_shapes(
        self, count: int, loads: Sequence[Load], x: FloatArray, y: FloatArray
    ) -> ModeShapes:
        """The lowest modes of all classes on the grid x × y, and unit loads' work on them."""
        found = [
            (value, k, j)
            for k, c in enumerate(self.classes)
            for j, value in enumerate(c.modes.omega_squared[:count])
        ]
        lowest = sorted(found)[:count]
        grid = self._grid(x, y)
        shapes, work = [], []
        for _, k, j in lowest:
            cls = self.classes[k]
            mode = cls.modes.modes[:, [j]]
            field = grid.fields([cls.basis], [mode])
            grid.clear_cut_out(field)
            shapes.append(field[0])
            work.append(
                [
                    float(self._work(load).in_class(cls.basis).force[:, 0] @ mode[:, 0])
                    for load in loads
                ]
            )
        frequencies = np.sqrt(np.maximum([value for value, _, _ in lowest], 0.0)) / (2.0 * np.pi)
        participation = np.array(work).reshape(len(lowest), len(loads)).T
        return ModeShapes(np.asarray(frequencies), np.stack(shapes), participation)

    def _work(self, load: Load) -> LoadCase:
        """A load as plain work on the basis, without a deflection of its own."""
        if load not in self._works:
            self._works[load] = LoadCase(self.assembly.samples, [load], always_direct=True)
        return self._works[load]

    def error_estimate(
        self, case: LoadCase, solution: list[ComplexArray], omega: float, loss_factor: float
    ) -> Estimate:
        """How wrong a solution is.

        Solutions in the same matrices with a little less of one kind of function tell what the last
        functions of that kind did, and so, of what order the next would be.
        """
        probe, loads = self._probe, solution[0].shape[1]
        # All in one call: on so small a grid a call costs more than its sums.
        columns = []
        for fine, c in zip(solution, self.classes, strict=True):
            load = case.in_class(c.basis)
            steps = [fine, c.modes.stiffened(fine, omega, loss_factor)]
            coarser = c.modes.solve_in(c.coarser, load, omega, loss_factor)
            steps += [fine - coarse for coarse in coarser]
            own = [part(step) for step in steps for part in (np.real, np.imag)]
            columns.append(np.concatenate(own, axis=1))
        fields = probe.fields([c.basis for c in self.classes], columns)
        # By step and part; the loads' own deflection is no step.
        fields = fields.reshape(-1, 2, loads, *fields.shape[1:])
        probe.clear_corners(fields)
        factor = 1.0 / (1.0 + 1j * loss_factor)
        own_field = case.field_on(probe.x, probe.y)
        fields[0, 0] += factor.real * own_field
        fields[0, 1] += factor.imag * own_field
        whole, stiffened, *steps = np.sqrt(np.sum(fields**2, axis=(1, 3, 4)))
        whole = np.maximum(whole, 1e-300)
        left = [share * step / whole for (_, share), step in zip(self._steps, steps, strict=True)]
        error = np.asarray(sum(left))
        error *= 1.0 + UNSETTLED * np.minimum(error, 1.0)
        error += FORM_ERROR * stiffened / whole
        floor = ROUNDING + (UNRESOLVED_LOAD if case.is_unresolved else 0.0)
        by_kind = [float(np.max(part)) for part in left]
        return Estimate(float(np.max(error) + floor), by_kind[0], max(by_kind[1:], default=0.0))

    def _grid(self, x: FloatArray, y: FloatArray) -> GridTable:
        key = x.tobytes() + b"|" + y.tobytes()
        if key not in self._grids:
            table = GridTable(self.basis, self.mirrors, x, y)
            held = table.kept_values + sum(grid.kept_values for grid in self._grids.values())
            while self._grids and (len(self._grids) >= KEPT_GRIDS or held > MOST_VALUES):
                held -= self._grids.pop(next(iter(self._grids))).kept_values
            self._grids[key] = table
        return self._grids[key]
