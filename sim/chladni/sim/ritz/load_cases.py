"""Load discs on a Ritz plate: each as the endless plate's deflection plus what the board corrects.

A disc away from glued discs is not resolved by polynomials. Its deflection on an endless plate is
known in closed form, and the rest of the field is smooth: it answers only to what that deflection
does at the edges, the screws, the glued discs, and to its inertia. Overhang at an edge or a screw
needs nothing more, since force beyond the plate leaves no force on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.disc_load import disc_load_deflection
from chladni.sim.plate.geometry import Inclusion, PlateGeometry
from chladni.sim.plate.loads import Load
from chladni.sim.plate.mirrors import SAME_PLACE
from chladni.sim.ritz.basis import quadrature
from chladni.sim.ritz.basis.basis import EDGE_ZONE
from chladni.sim.ritz.basis.basis_values import BasisTable
from chladni.sim.ritz.basis.parity import Parity, ParityBasis
from chladni.sim.ritz.basis.quadrature import Points
from chladni.sim.ritz.circles.derivatives import Derivative
from chladni.sim.ritz.forms.loads import ClassLoad, load_of_deflections
from chladni.sim.ritz.forms.samples import Samples, Tables

FloatArray = NDArray[np.float64]

POINT_RADIUS = 1e-5
"""A point force is a disc of this radius, m; its field differs by R² ln R, below 1e-8."""
NO_POINTS = Points(np.zeros(0), np.zeros(0), np.zeros(0))
DISC_RULE = quadrature.DiscRule(radial=8, angular=36)
"""Over a whole disc. A uniform load asks for the mean of functions only."""
DIRECT_RULE = quadrature.DiscRule(radial=16, angular=64)
AT_ONCE = 1 << 14
"""Values of load deflections worked out in one go, so that they stay in the cache."""


class LoadCase:
    """Several loads, each treated in the way that suits its place."""

    def __init__(
        self, samples: Samples, loads: Sequence[Load], *, always_direct: bool = False
    ) -> None:
        self._samples = samples
        self._loads = list(loads)
        geometry = samples.basis.geometry
        self._direct = [always_direct or _is_direct(geometry, load) for load in loads]
        self._share = [1.0 / _covered(geometry, load) for load in loads]
        self._tables: Tables | None = None
        if not all(self._direct):
            self._tables = samples.of(self._family)
        spread = [
            _disc_on_plate(geometry, load) if direct else NO_POINTS
            for load, direct in zip(loads, self._direct, strict=True)
        ]
        # One evaluation for all direct loads.
        self._spread = BasisTable(samples.basis, quadrature.join(spread))
        self._shares = [own.weights / max(own.weights.sum(), 1e-300) for own in spread]
        self._classes: dict[Parity, ClassLoad] = {}

    @property
    def is_direct(self) -> bool:
        """Whether the basis carries every load without a deflection of its own."""
        return all(self._direct)

    @property
    def is_unresolved(self) -> bool:
        """Whether a load disc lies on a glued disc that is not its own."""
        discs = self._samples.basis.geometry.inclusions
        return any(
            direct and load.radius > 0.0 and not any(_is_same_disc(load, disc) for disc in discs)
            for load, direct in zip(self._loads, self._direct, strict=True)
        )

    def in_class(self, parity: ParityBasis) -> ClassLoad:
        """The loads projected onto a parity class."""
        if parity.parity not in self._classes:
            self._classes[parity.parity] = self._project(parity)
        return self._classes[parity.parity]

    def _project(self, parity: ParityBasis) -> ClassLoad:
        direct = np.zeros((parity.size, len(self._loads)))
        if any(self._direct):
            direct += self._spread.sums(parity, self._shares).T
        if self._tables is None:
            return ClassLoad(direct, np.zeros(direct.shape), None)
        own = load_of_deflections(self._samples, parity, self._tables)
        return replace(own, force=direct + own.force)

    def field_on(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """The endless plate's static deflection on a grid, shape (loads, nx, ny), m/N."""
        if self.is_direct:
            return np.zeros((len(self._loads), x.size, y.size))
        px, py = np.meshgrid(x, y, indexing="ij")
        values = self.deflection(px.ravel(), py.ravel())
        return values.reshape(len(self._loads), x.size, y.size)

    def deflection(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """The same at scattered points, shape (loads, points)."""
        return self._family(x, y, (0, 0)).T

    def _family(self, x: FloatArray, y: FloatArray, derivative: Derivative) -> FloatArray:
        stiffness = self._samples.basis.geometry.bending_stiffness
        result = np.zeros((len(self._loads), x.size))
        own = np.flatnonzero(~np.array(self._direct))
        # Many loads at once at few points, few at many: calls cost more than small arrays.
        together = max(1, AT_ONCE // max(x.size, 1))
        for first in range(0, own.size, together):
            some = own[first : first + together]
            loads = [self._loads[k] for k in some]
            radius = np.array([max(load.radius, POINT_RADIUS) for load in loads])[:, None]
            unit = np.array(self._share)[some, None] * radius**2 / (8.0 * np.pi * stiffness)
            u = (x - np.array([load.x for load in loads])[:, None]) / radius
            v = (y - np.array([load.y for load in loads])[:, None]) / radius
            values = disc_load_deflection(u, v, derivative)
            result[some] = unit / radius ** sum(derivative) * values
        return result.T


def _is_direct(geometry: PlateGeometry, load: Load) -> bool:
    """Whether a load is left to the basis: it overlaps a glued disc, or is a point at an edge.

    On a magnet the basis holds that very disc; a point force on an edge has no closed deflection
    with finite edge forces. A disc over a round corner would push what is cut off there, which
    nothing resists.
    """
    for disc in geometry.inclusions:
        if np.hypot(load.x - disc.x, load.y - disc.y) < disc.radius + load.radius:
            return True
    if geometry.is_cut_off(load.x, load.y, load.radius):
        return True
    to_edge = geometry.distance_to_edge(load.x, load.y)
    return load.radius == 0.0 and to_edge < EDGE_ZONE * geometry.width


def _covered(geometry: PlateGeometry, load: Load) -> float:
    """Share of a load disc that lies on the plate, outside its screws."""
    if load.radius == 0.0:
        return 1.0
    overhangs = (
        abs(load.x) + load.radius > geometry.width / 2.0
        or abs(load.y) + load.radius > geometry.length / 2.0
        or geometry.is_cut_off(load.x, load.y, load.radius)
    )
    touches = any(
        np.hypot(load.x - x, load.y - y) < radius + load.radius for x, y, radius in geometry.cut_out
    )
    if not overhangs and not touches:
        return 1.0
    # 200 × 200 cells: 3e-4 of the area, and only the scale of the field depends on it.
    offset = (np.arange(200) + 0.5) / 100.0 - 1.0
    u, v = np.meshgrid(offset, offset, indexing="ij")
    inside = u**2 + v**2 < 1.0
    x, y = load.x + u[inside] * load.radius, load.y + v[inside] * load.radius
    return float(np.mean(_on_plate(geometry, x, y)))


def _disc_on_plate(geometry: PlateGeometry, load: Load) -> Points:
    """Quadrature over the part of a load disc that lies on the plate."""
    if load.radius == 0.0:
        return Points(np.array([load.x]), np.array([load.y]), np.array([1.0]))
    if any(_is_same_disc(load, disc) for disc in geometry.inclusions):
        return DISC_RULE.on(load.x, load.y, load.radius)
    points = DIRECT_RULE.on(load.x, load.y, load.radius)
    keep = _on_plate(geometry, points.x, points.y)
    return Points(points.x[keep], points.y[keep], points.weights[keep])


def _is_same_disc(load: Load, disc: Inclusion) -> bool:
    apart = np.hypot(load.x - disc.x, load.y - disc.y)
    return bool(apart < SAME_PLACE and abs(load.radius - disc.radius) < SAME_PLACE)


def _on_plate(geometry: PlateGeometry, x: FloatArray, y: FloatArray) -> NDArray[np.bool_]:
    inside = (np.abs(x) <= geometry.width / 2.0) & (np.abs(y) <= geometry.length / 2.0)
    inside &= ~geometry.is_cut_off(x, y)
    for centre_x, centre_y, radius in geometry.cut_out:
        inside &= np.hypot(x - centre_x, y - centre_y) > radius
    return np.asarray(inside)
