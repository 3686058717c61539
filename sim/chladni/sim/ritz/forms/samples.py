"""A basis, and functions outside it, on all quadrature points: what every form is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis import quadrature
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.basis.basis_values import (
    BasisTable,
    Family,
    FamilyTable,
    FunctionTable,
    SharedTable,
    TablePart,
)
from chladni.sim.ritz.basis.parity import Parity, ParityBasis
from chladni.sim.ritz.basis.quadrature import Points
from chladni.sim.ritz.forms.discs import Discs, OnDisc
from chladni.sim.ritz.forms.point_sets import point_sets

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Tables:
    """One set of functions on all quadrature points."""

    edges: list[FunctionTable]
    corners: FunctionTable
    discs: FunctionTable
    foundation: FunctionTable
    offcuts: FunctionTable
    points: FunctionTable
    area: FunctionTable
    rims: dict[int, FunctionTable]


class Samples:
    """The quadrature of one basis, and the basis on its points; shared by all parity classes.

    Attributes
    ----------
    sets, discs
        Quadrature points, and the discs with theirs.
    own
        The basis on all points.
    area
        The basis on the area's points, without the kinks on the rims of discs.
    kinks
        What `area` leaves out, on the points of discs; shape (points, circle functions).
    """

    def __init__(self, basis: Basis, mirrors: Mirrors, area_points: tuple[int, int]) -> None:
        self.basis = basis
        self.mirrors = mirrors
        self.sets = point_sets(basis, mirrors, area_points)
        self.area = BasisTable(basis, self.sets.area, smooth=True)
        self.discs = Discs(basis, mirrors)
        self.kinks = basis.kinks(self.discs.points.x, self.discs.points.y, self.discs.inclusion)
        self.own = self._make_tables(lambda points: BasisTable(basis, points), self.area)
        self._on_discs: dict[Parity, list[OnDisc]] = {}

    def of(self, family: Family) -> Tables:
        """Functions outside the basis, such as the deflection under a load disc."""
        area = FamilyTable(family, self.sets.area, self.mirrors)
        return self._make_tables(lambda p: FamilyTable(family, p, self.mirrors), area)

    def on_discs(self, parity: ParityBasis, tables: Tables) -> list[OnDisc]:
        """Functions as polynomials of each disc; the basis's are kept, every load asks for them."""
        if tables is not self.own:
            return self.discs.project(tables.discs.values(parity, (0, 0)))
        if parity.parity not in self._on_discs:
            values = self.own.discs.values(parity, (0, 0))
            self._on_discs[parity.parity] = self.discs.project(values)
        return self._on_discs[parity.parity]

    def _make_tables(self, make: Callable[[Points], FunctionTable], area: FunctionTable) -> Tables:
        """Functions on all sets of points, those together that want the same derivatives."""
        sets = self.sets
        edges: dict[int, FunctionTable] = {}
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


def _shared(groups: list[Points], make: Callable[[Points], FunctionTable]) -> list[TablePart]:
    """Several sets of points as parts of one table."""
    whole = SharedTable(make(quadrature.join(groups)))
    ends = np.cumsum([group.x.size for group in groups]).tolist()
    spans = zip(groups, ends, strict=True)
    return [TablePart(whole, slice(end - group.x.size, end)) for group, end in spans]
