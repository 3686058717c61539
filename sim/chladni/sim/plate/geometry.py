"""What a plate with any supports is made of. SI units throughout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.parts import Edges

FloatArray = NDArray[np.float64]

PATCH_SPREAD = 0.6
"""Of the distance from a patch of foundation to the next, by which it passes into that."""


@dataclass(frozen=True)
class RimSupport:
    """A screw, which holds the plate on a circle, m.

    Parameters
    ----------
    holds_deflection, holds_slope
        Whether w = 0 and ∂w/∂r = 0 on the circle. Both: clamped; the first alone: pinned.
    stiffness
        Of springs spread over the circle, N/m in all.
    rotational
        Of springs against ∂w/∂r spread over the circle, N·m/rad in all.
    loss_factor
        η of both kinds of springs; None for that of the plate.
    """

    x: float
    y: float
    radius: float
    holds_deflection: bool = True
    holds_slope: bool = True
    stiffness: float = 0.0
    rotational: float = 0.0
    loss_factor: float | None = None

    @property
    def is_clamped(self) -> bool:
        """Whether the plate inside is cut off from the rest."""
        return self.holds_deflection and self.holds_slope

    @property
    def is_sprung(self) -> bool:
        """Whether springs of any kind act on it."""
        return self.stiffness > 0.0 or self.rotational > 0.0


@dataclass(frozen=True)
class PointFeature:
    """A pin (w = 0), a spring (N/m) or a mass (kg) at one point, m.

    A spring has a loss factor of its own, or None for that of the plate. A point cannot hold a
    slope: the clamp at a point has no limit for a thin plate.
    """

    x: float
    y: float
    is_pinned: bool = False
    stiffness: float = 0.0
    mass: float = 0.0
    loss_factor: float | None = None


@dataclass(frozen=True)
class Inclusion:
    """A disc of the plate that is unlike the rest: a glued disc, or a hole.

    Parameters
    ----------
    areal_mass
        Added mass per area, kg/m²; that of the plate with a minus sign for a hole.
    stiffness_ratio
        Factor on the plate's bending stiffness; 0 for a hole.
    rotary
        Added rotary inertia per area, kg, beyond what `areal_mass` has by its extent.
    """

    x: float
    y: float
    radius: float
    areal_mass: float
    stiffness_ratio: float
    rotary: float = 0.0

    @property
    def is_hole(self) -> bool:
        """Whether nothing is left of the plate here."""
        return self.stiffness_ratio == 0.0


@dataclass(frozen=True)
class FoundationLayer:
    """What lies under the plate and resists its deflection, without mass.

    Parameters
    ----------
    stiffness
        k, per area, N/m³.
    loss_factor
        η of k(1 + iη).
    cut_outs
        Discs (x, y, radius) where there is none, m.
    strips
        Rectangles (x from, x to, y from, y to) where there is some, m, none of which overlap; none
        for all of the plate.
    patches
        Places (x, y, ratio) about which it is so many times as stiff, m.
    """

    stiffness: float
    loss_factor: float = 0.0
    cut_outs: tuple[tuple[float, float, float], ...] = ()
    strips: tuple[tuple[float, float, float, float], ...] = ()
    patches: tuple[tuple[float, float, float], ...] = ()

    def ratio(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """How stiff it is at places over `stiffness`: smooth from patch to patch.

        Logarithms of the patches' ratios are averaged, weighted by exp(−d²/2s²) of the distance d
        to each, with s a share of the distance from patch to patch. One patch is everywhere.
        """
        if not self.patches:
            return np.ones(np.shape(x))
        weights = patch_weights(self.patches, x, y)
        logarithms = np.log([ratio for _, _, ratio in self.patches])
        return np.asarray(np.exp(np.tensordot(logarithms, weights, axes=1)))

    def lies(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """`ratio` at places where there is any, 0 at the others."""
        own = self.ratio(x, y)
        for at_x, at_y, radius in self.cut_outs:
            own = np.where(np.hypot(x - at_x, y - at_y) <= radius, 0.0, own)
        if self.strips:
            on = [(x >= a) & (x <= b) & (y >= c) & (y <= d) for a, b, c, d in self.strips]
            own = own * np.any(on, axis=0)
        return np.asarray(own)


def patch_weights(patches: Sequence[tuple[float, ...]], x: FloatArray, y: FloatArray) -> FloatArray:
    """Share of each patch (x, y, …), m, at places: shape (patches, *x.shape); 1 in all."""
    at = np.array([patch[:2] for patch in patches])
    apart = np.hypot(*(at[:, None] - at).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    spread = PATCH_SPREAD * float(np.median(apart.min(axis=1))) if len(at) > 1 else np.inf
    away = (np.asarray(x) - at[:, 0].reshape(-1, *[1] * np.ndim(x))) ** 2
    away = away + (np.asarray(y) - at[:, 1].reshape(-1, *[1] * np.ndim(y))) ** 2
    # The nearest has weight 1 before all are shared out, so that none is lost far away from all.
    weights = np.exp(-(away - away.min(axis=0)) / (2.0 * spread**2))
    return np.asarray(weights / weights.sum(axis=0))


Sprung = TypeVar("Sprung", RimSupport, PointFeature)


def _with_more_loss(own: Sprung, more: float) -> Sprung:
    return own if own.loss_factor is None else replace(own, loss_factor=own.loss_factor + more)


@dataclass(frozen=True)
class PlateGeometry:
    """A rectangle centred on the origin, with what holds it and what sits on it.

    Parameters
    ----------
    width, length
        Along x and y, m.
    bending_stiffness
        D = Eh³/(12(1 − ν²)), N·m.
    poisson
        ν.
    areal_mass
        ρh, kg/m².
    rims, inclusions, points, edges
        Features and supports.
    corner_radius
        Of all four corners, m; where it is above 0 all edges are free.
    foundation
        What the plate lies on.
    """

    width: float
    length: float
    bending_stiffness: float
    poisson: float
    areal_mass: float
    rims: tuple[RimSupport, ...] = ()
    inclusions: tuple[Inclusion, ...] = ()
    points: tuple[PointFeature, ...] = ()
    edges: Edges = field(default_factory=Edges)
    corner_radius: float = 0.0
    foundation: FoundationLayer | None = None

    def distance_to_edge(self, x: float, y: float) -> float:
        """From a place to the nearest edge, m; negative off the plate."""
        return min(self.width / 2.0 - abs(x), self.length / 2.0 - abs(y))

    def is_cut_off(
        self, x: FloatArray | float, y: FloatArray | float, reach: float = 0.0
    ) -> NDArray[np.bool_]:
        """Which places, of any shape, are in what round corners take away, or so near (m)."""
        radius = self.corner_radius
        beyond_x = np.abs(x) - (self.width / 2.0 - radius)
        beyond_y = np.abs(y) - (self.length / 2.0 - radius)
        far = np.hypot(np.maximum(beyond_x, 0.0), np.maximum(beyond_y, 0.0)) + reach > radius
        return np.asarray(far & (np.minimum(beyond_x, beyond_y) + reach > 0.0) & (radius > 0.0))

    def with_more_loss(self, more: float) -> PlateGeometry:
        """The same, with so much added to the loss factors of what is not the plate's own."""
        layer = self.foundation
        own = layer and replace(layer, loss_factor=layer.loss_factor + more)
        return replace(
            self,
            foundation=own,
            rims=tuple(_with_more_loss(rim, more) for rim in self.rims),
            points=tuple(_with_more_loss(point, more) for point in self.points),
        )

    @property
    def cut_out(self) -> list[tuple[float, float, float]]:
        """Discs (x, y, radius) where there is no plate to move: clamped screws and holes."""
        screws = [(r.x, r.y, r.radius) for r in self.rims if r.is_clamped]
        return screws + [(i.x, i.y, i.radius) for i in self.inclusions if i.is_hole]
