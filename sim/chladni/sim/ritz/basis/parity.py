"""Mirror symmetry of a plate: found in its geometry, then used to split every matrix.

A plate that is its own mirror image in x, in y or in both decouples into two or four problems
of definite parity. A plate without a mirror is one problem; nothing is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.geometry import PlateGeometry
from chladni.sim.plate.mirrors import SAME_PLACE, Mirrors
from chladni.sim.ritz.basis.basis import Basis
from chladni.sim.ritz.circles.functions import Circle

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


@dataclass(frozen=True)
class Parity:
    """One irreducible class: even or odd in each mirror there is."""

    mirrors: Mirrors
    odd_x: bool
    odd_y: bool

    def character(self, image: tuple[float, float]) -> float:
        """The sign a function of this class takes under a group element."""
        return (image[0] if self.odd_x else 1.0) * (image[1] if self.odd_y else 1.0)

    def degrees(self, count: int, *, axis: int) -> IntArray:
        """Which of `count` Legendre degrees along an axis belong to this class."""
        mirrored, odd = ((self.mirrors.x, self.odd_x), (self.mirrors.y, self.odd_y))[axis]
        return np.arange(int(odd), count, 2) if mirrored else np.arange(count)


def parity_classes(mirrors: Mirrors) -> list[Parity]:
    """Every parity class of a plate with these mirrors."""
    return [
        Parity(mirrors, odd_x, odd_y)
        for odd_x in ((False, True) if mirrors.x else (False,))
        for odd_y in ((False, True) if mirrors.y else (False,))
    ]


@dataclass(frozen=True)
class Member:
    """A circle function of a class: the one it stands for, and how many circles it sits on."""

    circle: int
    column: int
    orbit: int


def find_mirrors(geometry: PlateGeometry) -> Mirrors:
    """The mirrors that map a plate's supports and features onto equal ones."""
    # Two are alike that differ in nothing but where they are.
    features: list[Any] = [*geometry.rims, *geometry.inclusions, *geometry.points]
    items: list[tuple[float, float, object]] = [
        (own.x, own.y, replace(own, x=0.0, y=0.0)) for own in features
    ]
    if geometry.foundation:
        items += [(x, y, ("cut-out", radius)) for x, y, radius in geometry.foundation.cut_outs]
        items += [
            ((x0 + x1) / 2.0, (y0 + y1) / 2.0, ("strip", x1 - x0, y1 - y0))
            for x0, x1, y0, y1 in geometry.foundation.strips
        ]
        items += [(x, y, ("patch", ratio)) for x, y, ratio in geometry.foundation.patches]
    # SciPy is loaded where a plate is solved: a device's host only asks for mirrors.
    from scipy.spatial import cKDTree  # noqa: PLC0415

    edges = geometry.edges
    places = np.array([(x, y) for x, y, _ in items]).reshape(-1, 2)
    tree = cKDTree(places) if items else None

    def mapped(sx: float, sy: float) -> bool:
        if tree is None:
            return True
        images: Any = tree.query_ball_point(places * (sx, sy), SAME_PLACE)
        return all(
            any(items[other][2] == kind for other in found)
            for (_, _, kind), found in zip(items, images, strict=True)
        )

    return Mirrors(
        edges.left == edges.right and mapped(-1.0, 1.0),
        edges.bottom == edges.top and mapped(1.0, -1.0),
    )


class ParityBasis:
    """The functions of a `Basis` that belong to one parity class.

    Attributes
    ----------
    degrees_x, degrees_y
        Legendre degrees of the class.
    members
        One per circle function of the class.
    size, polynomials
        Number of functions and, of them, polynomials (which come first).
    """

    def __init__(self, basis: Basis, parity: Parity) -> None:
        self.basis = basis
        self.parity = parity
        self.oddness = (parity.odd_x, parity.odd_y)
        self.degrees_x = parity.degrees(basis.resolution.nx, axis=0)
        self.degrees_y = parity.degrees(basis.resolution.ny, axis=1)
        columns: list[FloatArray] = []
        self.members: list[Member] = []
        self._spans: list[slice] = []
        for index, circle in enumerate(basis.circles):
            first = len(self.members)
            if parity.mirrors.holds(np.array(circle.x), np.array(circle.y)):
                self._add_circle(index, circle, columns)
            self._spans.append(slice(first, len(self.members)))
        from scipy.sparse import csr_array  # noqa: PLC0415  (as above)

        count = basis.size - basis.polynomials
        dense = np.stack(columns, axis=1) if columns else np.zeros((count, 0))
        # At most one entry per image in a column, so a sparse product costs next to nothing.
        self._combine = csr_array(dense.T)
        self.polynomials = self.degrees_x.size * self.degrees_y.size
        self.size = self.polynomials + len(self.members)

    def _add_circle(self, index: int, circle: Circle, columns: list[FloatArray]) -> None:
        """Symmetrise each function of one circle; keep those that do not cancel."""
        images = self.parity.mirrors.images
        partners = [self._partner(circle, image) for image in images]
        orbit = len(set(partners))
        first = self.basis.offsets[index] - self.basis.polynomials
        for k, (function, sine) in enumerate(circle.members):
            column = np.zeros(self.basis.size - self.basis.polynomials)
            for image, partner in zip(images, partners, strict=True):
                place = self.basis.offsets[partner] - self.basis.polynomials + k
                column[place] += self.parity.character(image) * _mirror_sign(
                    function.order, sine, image
                )
            if column[first + k] != 0.0:
                columns.append(column / abs(column[first + k]))
                self.members.append(Member(index, k, orbit))

    def members_of(self, circle: int) -> slice:
        """Where the members of a circle stand in `members`."""
        return self._spans[circle]

    def _partner(self, circle: Circle, image: tuple[float, float]) -> int:
        distances = [
            np.hypot(image[0] * circle.x - other.x, image[1] * circle.y - other.y)
            + abs(circle.radius - other.radius)
            + abs(circle.own.bubbles - other.own.bubbles)
            for other in self.basis.circles
        ]
        return int(np.argmin(distances))

    def polynomial_bending(self) -> FloatArray:
        """Strain energy form of the polynomials by D; shape (polynomials, polynomials)."""
        nu, x, y = self.basis.geometry.poisson, self.basis.along_x, self.basis.along_y

        def product(x_left: int, x_right: int, y_left: int, y_right: int) -> FloatArray:
            by_x = x.gram(x_left, x_right)[np.ix_(self.degrees_x, self.degrees_x)]
            by_y = y.gram(y_left, y_right)[np.ix_(self.degrees_y, self.degrees_y)]
            return np.asarray(np.kron(by_x, by_y))

        cross = product(2, 0, 0, 2)
        bending = product(2, 2, 0, 0) + product(0, 0, 2, 2) + nu * (cross + cross.T)
        return np.asarray(bending + 2.0 * (1.0 - nu) * product(1, 1, 1, 1))

    def combine(self, circles: FloatArray) -> FloatArray:
        """Values of all circle functions, shape (points, all), as those of the class."""
        if len(self.parity.mirrors.images) == 1:
            return circles
        return np.asarray((self._combine @ circles.T).T)

    def subset(
        self, *, fewer_polynomials: tuple[int, int], fewer_orders: int, fewer_on_rims: int
    ) -> IntArray:
        """Indices of the class's functions without its finest: the basis of a coarser solution."""
        resolution = self.basis.resolution
        keep_x = self.degrees_x < resolution.nx - fewer_polynomials[0]
        keep_y = self.degrees_y < resolution.ny - fewer_polynomials[1]
        polynomials = np.flatnonzero(np.outer(keep_x, keep_y).ravel())
        members = []
        for k, member in enumerate(self.members):
            circle = self.basis.circles[member.circle]
            function, _ = circle.members[member.column]
            highest = circle.own.orders if function.outside else circle.own.bubbles
            # A point has one order only, and keeps it.
            is_rim = member.circle < len(self.basis.rims)
            fewer = fewer_on_rims if is_rim else fewer_orders
            if function.order == 0 or function.order <= highest - fewer:
                members.append(self.polynomials + k)
        return np.concatenate((polynomials, np.array(members, dtype=np.intp)))


def _mirror_sign(order: int, sine: bool, image: tuple[float, float]) -> float:
    """Sign of cos mθ or sin mθ under a mirror: x → −x is θ → π − θ, y → −y is θ → −θ."""
    sign = 1.0
    if image[0] < 0:
        sign *= (-1.0) ** order * (-1.0 if sine else 1.0)
    if image[1] < 0:
        sign *= -1.0 if sine else 1.0
    return sign
