"""Stiffness, mass and support matrices of one parity class of a plate.

Rim functions are biharmonic off their rim, so by Green's identity for a Kirchhoff plate,

    a(u, v) = D ∮ [M(u) ∂v/∂n − V(u) v] ds + 2(1 − ν) D Σ corners ± u_xy v + rim terms,

with M = u_nn + ν u_ss and V = u_nnn + (2 − ν) u_nss, their strain energy with any other function
needs only the four edges and their own rim: no singular integral over the area is left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz import quadrature
from chladni.sim.ritz.basis import Basis
from chladni.sim.ritz.basis_values import (
    BasisTable,
    Family,
    FamilyTable,
    SharedTable,
    Table,
    TablePart,
)  # fmt: skip
from chladni.sim.ritz.circles.derivatives import Derivative
from chladni.sim.ritz.circles.terms import radial_derivative
from chladni.sim.ritz.forms.discs import Discs, OnDisc, bending_rows, signed_product
from chladni.sim.ritz.forms.foundation import is_left_out
from chladni.sim.ritz.forms.point_sets import Edge, point_sets
from chladni.sim.ritz.parity import Parity, ParityBasis
from chladni.sim.ritz.quadrature import Points

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Tables:
    """One set of functions on all quadrature points."""

    edges: list[Table]
    corners: Table
    discs: Table
    foundation: Table
    offcuts: Table
    points: Table
    area: Table
    rims: dict[int, Table]


class Assembly:
    """Forms over one basis; the evaluated functions are shared by all parity classes."""

    def __init__(self, basis: Basis, mirrors: Mirrors, area_points: tuple[int, int]) -> None:
        self.basis = basis
        self.mirrors = mirrors
        self.sets = point_sets(basis, mirrors, area_points)
        self._area = BasisTable(basis, self.sets.area, smooth=True)
        self.discs = Discs(basis, mirrors)
        self._kinks = basis.kinks(self.discs.points.x, self.discs.points.y, self.discs.inclusion)
        self._on_discs: dict[Parity, list[OnDisc]] = {}
        self._tables = self._make_tables(lambda points: BasisTable(basis, points), self._area)

    def _make_tables(self, make: Callable[[Points], Table], area: Table) -> Tables:
        """Functions on all sets of points, those together that want the same derivatives."""
        sets = self.sets
        edges: dict[int, Table] = {}
        for axis in (0, 1):
            alike = [k for k, edge in enumerate(sets.edges) if edge.axis == axis]
            edges |= zip(alike, _shared([sets.edges[k].points for k in alike], make), strict=True)
        rims = _shared([rim.points for rim in sets.rims.values()], make)
        corners, offcuts, points = _shared([sets.corners, sets.offcuts, sets.points], make)
        (discs,) = _shared([self.discs.points], make)
        (foundation,) = _shared([sets.foundation], make)
        return Tables(
            edges=[edges[k] for k in range(len(sets.edges))],
            corners=corners,
            discs=discs,
            foundation=foundation,
            offcuts=offcuts,
            points=points,
            area=area,
            rims=dict(zip(sets.rims, rims, strict=True)),
        )

    def load_tables(self, family: Family) -> Tables:
        """Functions outside the basis, such as the deflection under a load disc."""
        area = FamilyTable(family, self.sets.area, self.mirrors)
        return self._make_tables(lambda p: FamilyTable(family, p, self.mirrors), area)

    def stiffness(self, parity: ParityBasis) -> FloatArray:
        """Strain energy form, shape (size, size), real symmetric."""
        basis, p = self.basis, parity.polynomials
        form = np.zeros((parity.size, parity.size))
        form[:p, :p] = parity.polynomial_bending()
        if parity.members:
            rows = self.edge_work(parity, self._tables, first=p)
            self._add_rim_work(parity, rows)
            form[p:] = rows
            form[:p, p:] = rows[:, :p].T
            form[p:, p:] = (rows[:, p:] + rows[:, p:].T) / 2.0
            self._set_bubbles(parity, form)
        form *= basis.geometry.bending_stiffness
        return form + self.added_stiffness(parity, self._tables)

    def overlap(self, parity: ParityBasis) -> FloatArray:
        """∫ of the functions' products over the whole rectangle, shape (size, size), symmetric."""
        p = parity.polynomials
        form = np.zeros((parity.size, parity.size))
        form[:p, :p] = np.eye(p)
        if parity.members:
            rows = self._project(parity)
            rows += self._kinked_mass(parity)
            form[p:] = rows
            form[:p, p:] = rows[:, :p].T
        return form

    def mass(self, parity: ParityBasis, overlap: FloatArray) -> FloatArray:
        """Kinetic energy form, shape (size, size), real symmetric."""
        added = self._added_inertia(parity, self._tables)
        return self.basis.geometry.areal_mass * overlap + added

    def foundation(
        self, parity: ParityBasis, overlap: FloatArray, tables: Tables | None = None
    ) -> FloatArray | None:
        """Strain energy form of the foundation with the basis, of functions' `overlap` with it."""
        layer = self.basis.geometry.foundation
        if layer is None:
            return None
        form = overlap if not layer.strips else np.zeros(overlap.shape)
        basis = self._tables.foundation.values(parity, (0, 0))
        own = basis if tables is None else tables.foundation.values(parity, (0, 0))
        beside = signed_product(own, basis, self.sets.foundation.weights)
        on_discs = self._project_on_discs(parity, tables), self._project_on_discs(parity)
        left_out = self.discs.overlap(*on_discs, lambda disc: float(is_left_out(layer, disc)))
        return np.asarray(layer.stiffness * (form + beside - left_out))

    def supports(self, parity: ParityBasis, tables: Tables | None = None) -> FloatArray:
        """What must vanish for the supports to hold; shape (conditions, functions).

        Fourier moments of w and R ∂w/∂r on rims, w at pins, Legendre moments of w and ∂w/∂n on
        edges (as many as the basis has polynomials along the edge).
        """
        tables = tables or self._tables
        rows = [np.zeros((0, tables.corners.values(parity, (0, 0)).shape[1]))]
        for k, support in enumerate(self.basis.geometry.rims):
            if k in self.sets.rims:
                value, slope = self.sets.rims[k].moments(tables.rims[k], parity)
                rows += [value] if support.holds_deflection else []
                rows += [slope] if support.holds_slope else []
        pinned = [self.basis.geometry.points[k].is_pinned for k in self.sets.point_index]
        rows.append(tables.points.values(parity, (0, 0))[np.array(pinned, dtype=bool)])
        for edge, table in zip(self.sets.edges, tables.edges, strict=True):
            kind = self.basis.geometry.edges.of(edge.axis, edge.normal)
            if kind == "free":
                continue
            moments = self._edge_moments(parity, edge)
            rows.append(moments @ table.values(parity, (0, 0)))
            if kind == "clamped":
                slope_of: Derivative = (1, 0) if edge.axis == 0 else (0, 1)
                # In units of the board's width, as deflections are in units of themselves.
                rows.append(self.basis.geometry.width * moments @ table.values(parity, slope_of))
        return np.concatenate(rows)

    def finest_conditions(self, conditions: int) -> NDArray[np.bool_]:
        """Whether a row of `supports` is of the highest angular order of its rim."""
        finest: list[bool] = []
        for k, support in enumerate(self.basis.geometry.rims):
            if k in self.sets.rims:
                rings = self.basis.rims[k].own.rings
                own = [*([False] * (2 * rings - 1)), True, True]
                finest += own * (int(support.holds_deflection) + int(support.holds_slope))
        return np.array(finest + [False] * (conditions - len(finest)), dtype=bool)

    def edge_conditions(self, parity: ParityBasis) -> int:
        """How many rows of `supports` are an edge's: the last ones."""
        degrees = (parity.degrees_y.size, parity.degrees_x.size)
        kinds = {"free": 0, "simply supported": 1, "clamped": 2}
        edges = self.basis.geometry.edges
        return sum(kinds[edges.of(e.axis, e.normal)] * degrees[e.axis] for e in self.sets.edges)

    def _edge_moments(self, parity: ParityBasis, edge: Edge) -> FloatArray:
        """Weighted Legendre polynomials of the class along an edge; shape (degrees, points)."""
        line = (self.basis.along_y, self.basis.along_x)[edge.axis]
        degrees = (parity.degrees_y, parity.degrees_x)[edge.axis]
        along = (edge.points.y, edge.points.x)[edge.axis]
        return np.asarray((line.evaluate(along)[:, degrees] * edge.points.weights[:, None]).T)

    def edge_work(self, parity: ParityBasis, tables: Tables, *, first: int = 0) -> FloatArray:
        """Work of functions' edge forces on the basis, by D, from the `first` function on.

        Shape (functions, size).
        """
        nu = self.basis.geometry.poisson
        total: FloatArray | float = 0.0
        for edge, own, basis in zip(self.sets.edges, tables.edges, self._tables.edges, strict=True):
            nn, ss, nnn, nss = edge.derivatives
            slope: Derivative = (1, 0) if edge.axis == 0 else (0, 1)
            along = {d: own.values(parity, d)[:, first:] for d in edge.derivatives}
            moment = along[nn] + nu * along[ss]
            shear = along[nnn] + (2.0 - nu) * along[nss]
            weights = edge.points.weights * edge.normal
            total = total + (moment.T * weights) @ basis.values(parity, slope)
            total = total - (shear.T * weights) @ basis.values(parity, (0, 0))
        twist = tables.corners.values(parity, (1, 1))[:, first:].T * self.sets.corners.weights
        corners = twist @ self._tables.corners.values(parity, (0, 0))
        return np.asarray(total + 2.0 * (1.0 - nu) * corners)

    def added_stiffness(self, parity: ParityBasis, tables: Tables) -> FloatArray:
        """Strain energy with the basis of glued discs, holes and springs; (functions, size)."""
        own, basis = self._project_on_discs(parity, tables), self._project_on_discs(parity)
        total = self.discs.added_stiffness(own, basis)
        if self.sets.offcuts.x.size:
            bent = self._bend(parity, self._tables)
            total -= (bent if tables is self._tables else self._bend(parity, tables)).T @ bent
        total = self.basis.geometry.bending_stiffness * np.asarray(total)
        features = [self.basis.geometry.points[k].stiffness for k in self.sets.point_index]
        total += self._at_points(parity, tables, np.array(features))
        for k, support in enumerate(self.basis.geometry.rims):
            if k in self.sets.rims and (support.stiffness > 0.0 or support.rotational > 0.0):
                rim = self.sets.rims[k]
                orbit = self.mirrors.orbit(support.x, support.y)
                value, slope = rim.values(tables.rims[k], parity)
                basis_value, basis_slope = rim.values(self._tables.rims[k], parity)
                # `values` gives R ∂w/∂r, the spring resists ∂w/∂r.
                rotational = support.rotational / support.radius**2
                mean = orbit * rim.points.weights
                total += support.stiffness * (value.T * mean) @ basis_value
                total += rotational * (slope.T * mean) @ basis_slope
        return np.asarray(total)

    def _at_points(self, parity: ParityBasis, tables: Tables, strength: FloatArray) -> FloatArray:
        """Σ strength · u v over the point features; shape (functions, size)."""
        own = tables.points.values(parity, (0, 0))
        weights = strength * self.sets.points.weights
        return np.asarray((own.T * weights) @ self._tables.points.values(parity, (0, 0)))

    def overlap_with(self, parity: ParityBasis, tables: Tables) -> FloatArray:
        """∫ of functions times the basis over the whole rectangle; shape (functions, size)."""
        plate = self._project(parity, tables.area.values(parity, (0, 0)))
        on_discs = tables.discs.values(parity, (0, 0)).T * self.discs.points.weights
        plate[:, parity.polynomials :] += on_discs @ parity.combine(self._kinks)
        return plate

    def inertia(self, parity: ParityBasis, overlap: FloatArray, tables: Tables) -> FloatArray:
        """Kinetic energy form of functions with the basis; shape (functions, size)."""
        added = self._added_inertia(parity, tables)
        return self.basis.geometry.areal_mass * overlap + added

    def _kinked_mass(self, parity: ParityBasis) -> FloatArray:
        """What the area's points leave out of circle functions; shape (members, size).

        With f = s + k and g = t + l, smooth parts and kinks: the area has st, the discs the rest,
        which is kg + fl − kl.
        """
        values = self._tables.discs.values(parity, (0, 0))
        kinks = parity.combine(self._kinks)
        rows = np.zeros((kinks.shape[1], values.shape[1]))
        for circle, points in self.discs.spans():
            # Only the disc's own functions have a kink there.
            own = parity.members_of(circle)
            kinked = kinks[points, own]
            weighted = kinked.T * self.discs.points.weights[points]
            rows[own] += weighted @ values[points]
            others = values[points, parity.polynomials :] - kinks[points]
            rows[:, parity.polynomials :][:, own] += (weighted @ others).T
        return rows

    def _add_rim_work(self, parity: ParityBasis, rows: FloatArray) -> None:
        """Add the work of the jumps in moment and shear that rim functions have on their rim."""
        moments = {
            k: rim.moments(self._tables.rims[k], parity) for k, rim in self.sets.rims.items()
        }
        for k, member in enumerate(parity.members):
            circle = self.basis.circles[member.circle]
            function, sine = circle.members[member.column]
            if not function.outside:
                continue
            second, third = (
                radial_derivative(function.outside, k) - radial_derivative(function.inside, k)
                for k in (2, 3)
            )
            # Moment jump −f'' and shear jump −(f''' + f''), in units of D/R² and D/R³.
            component = 2 * function.order - (0 if sine or function.order == 0 else 1)
            value, slope = (moment[component] for moment in moments[member.circle])
            scale = np.pi * (2.0 if function.order == 0 else 1.0) / circle.radius**2
            rows[k] += member.orbit * scale * ((second + third) * value - second * slope)

    def _set_bubbles(self, parity: ParityBasis, form: FloatArray) -> None:
        """Bubbles end at their rim, so their energy by D is the integral over the disc."""
        for circle, _ in self.discs.spans():
            members = parity.members[parity.members_of(circle)]
            first = parity.polynomials + parity.members_of(circle).start
            own = first + np.flatnonzero(
                [not self.basis.circles[circle].members[m.column][0].outside for m in members]
            )
            rows = self.discs.bending_of(circle, own, self._project_on_discs(parity))
            form[own] = rows
            form[:, own] = rows.T

    def _project_on_discs(self, parity: ParityBasis, tables: Tables | None = None) -> list[OnDisc]:
        """Functions as polynomials of each disc; the basis's are kept, every load asks for them."""
        if tables is not None and tables is not self._tables:
            return self.discs.project(tables.discs.values(parity, (0, 0)))
        if parity.parity not in self._on_discs:
            values = self._tables.discs.values(parity, (0, 0))
            self._on_discs[parity.parity] = self.discs.project(values)
        return self._on_discs[parity.parity]

    def _bend(self, parity: ParityBasis, tables: Tables) -> FloatArray:
        """B with BᵀB the energy form by D over the offcuts; shape (3 · points, functions)."""
        root = np.sqrt(self.sets.offcuts.weights)[:, None]
        xx, xy, yy = (root * tables.offcuts.values(parity, d) for d in ((2, 0), (1, 1), (0, 2)))
        return bending_rows(xx, xy, yy, self.basis.geometry.poisson)

    def _added_inertia(self, parity: ParityBasis, tables: Tables) -> FloatArray:
        """Kinetic energy with the basis of glued discs, holes and point masses."""
        own, basis = self._project_on_discs(parity, tables), self._project_on_discs(parity)
        total = self.discs.added_inertia(own, basis)
        if self.sets.offcuts.x.size:
            weights = self.basis.geometry.areal_mass * self.sets.offcuts.weights
            cut = tables.offcuts.values(parity, (0, 0)).T * weights
            total -= cut @ self._tables.offcuts.values(parity, (0, 0))
        features = [self.basis.geometry.points[k].mass for k in self.sets.point_index]
        return np.asarray(total + self._at_points(parity, tables, np.array(features)))

    def _project(self, parity: ParityBasis, values: FloatArray | None = None) -> FloatArray:
        """∫ of functions, given at the area points, times the basis; shape (functions, size).

        Without `values` the functions are the circles' own.
        """
        (x, _), (y, _) = self.sets.gauss_x, self.sets.gauss_y
        root = np.sqrt(self.sets.area.weights)[:, None]
        circles = root * self._area.circle_values(parity, (0, 0))
        # A matrix by its own transpose takes half the time.
        rooted = circles if values is None else root * values
        along_x = self.basis.along_x.evaluate(x)[:, parity.degrees_x]
        along_y = self.basis.along_y.evaluate(y)[:, parity.degrees_y]
        count = rooted.shape[1]
        weighted = np.reshape((root * rooted).T, (count, x.size, y.size))
        polynomials = (along_x.T @ weighted @ along_y).reshape(count, parity.polynomials)
        return np.concatenate((polynomials, rooted.T @ circles), axis=1)


def _shared(groups: list[Points], make: Callable[[Points], Table]) -> list[TablePart]:
    """Several sets of points as parts of one table."""
    whole = SharedTable(make(quadrature.join(groups)))
    ends = np.cumsum([group.x.size for group in groups]).tolist()
    spans = zip(groups, ends, strict=True)
    return [TablePart(whole, slice(end - group.x.size, end)) for group, end in spans]
