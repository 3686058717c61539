"""What circles' functions lack to obey a held edge: a mirror image of each, off the plate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.ritz.circles.derivatives import (
    WIRTINGER,
    Derivative,
    Powers,
    Wirtinger,
    differentiate,
    vanishes,
)
from chladni.sim.ritz.circles.terms import RadialFunction

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class HeldEdge:
    """A held edge of the plate that a circle's functions are to obey.

    Parameters
    ----------
    axis
        Across which they are mirrored: 0 for an edge along y.
    at
        Its place along that axis, m.
    is_clamped
        Whether it holds the slope as well.
    """

    axis: int
    at: float
    is_clamped: bool


class MirrorImages:
    """What functions of a circle lack to obey a held edge, at points that are mirrored at it.

    On an endless edge a supported plate answers with −f at the mirrored place, a clamped one with
    −f − 2s f' − s² Δf there, s being the distance from the edge along its normal axis (R. Duffin,
    Continuation of biharmonic functions by reflection, Duke Math. J. 22, 1955): biharmonic like f,
    and singular only off the plate.

    Parameters
    ----------
    edge
        Its axis and what it holds.
    z, s
        Mirrored points and the edge's distance from them, in radii of the circle, of any shape.
    derivative
        By x and y, in radii as well.
    """

    def __init__(
        self, edge: HeldEdge, z: ComplexArray, s: FloatArray, derivative: Derivative
    ) -> None:
        self._answer = _answer(edge, derivative)
        # Complex, as what they weigh is: NumPy takes twice as long for both kinds in one product.
        self._weights = [(s**k).astype(complex) for k in range(1, len(self._answer))]
        # What is on the plate is mirrored to where no circle is.
        self._powers = Powers(z)

    def evaluate(self, function: RadialFunction) -> ComplexArray:
        """One function's image, of the points' shape."""
        values = differentiate(function.outside, self._powers, self._answer[0])
        for weight, operator in zip(self._weights, self._answer[1:], strict=True):
            # Every other function is harmonic.
            if not vanishes(function.outside, operator):
                values = values + weight * differentiate(function.outside, self._powers, operator)
        return values


def _answer(edge: HeldEdge, derivative: Derivative) -> list[Wirtinger]:
    """What acts on f at the mirrored place, by the power of s that it is multiplied with.

    By Leibniz s and s² are differentiated too, and a derivative across turns the sign.
    """
    n, along = derivative[edge.axis], derivative[1 - edge.axis]
    sign = (-1.0) ** n

    def by_place(across: int, factor: float) -> Wirtinger:
        operator = WIRTINGER[(across, along) if edge.axis == 0 else (along, across)]
        return tuple((j, k, factor * c) for j, k, c in operator)

    def laplacian(across: int, factor: float) -> Wirtinger:
        return tuple((j + 1, k + 1, 4.0 * c) for j, k, c in by_place(across, factor))

    if not edge.is_clamped:
        return [by_place(n, -sign)]
    answer = [
        by_place(n, sign * (2.0 * n - 1.0)),
        by_place(n + 1, -2.0 * sign),
        laplacian(n, -sign),
    ]
    # f'' and the derivatives along that come from Δf of one order less make Δf once more.
    if n >= 1:
        answer[1] += laplacian(n - 1, 2.0 * n * sign)
    if n >= 2:
        answer[0] += laplacian(n - 2, -n * (n - 1) * sign)
    return answer
