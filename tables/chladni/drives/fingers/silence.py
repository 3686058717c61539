"""The drive of each of several fingers: the loudest that leaves all the others still.

With h(p) what each coil does at a place, and the points of all fingers but A as rows of H,

    d_A = h̄_A* − Hᴴ (H Hᴴ + λ I)⁻¹ H h̄_A* = λ (Hᴴ H + λ I)⁻¹ h̄_A*

is the loudest drive for A but for what of it the others would feel: pressure matching with a target
of zero (Kirkeby and Nelson, J. Acoust. Soc. Am. 94, 1993, 2992-3000), and the limit of acoustic
contrast control (Choi and Kim, the same, 111, 2002, 1695-1700). Pantera, Hudin and others do so
with filters inverted from measured responses of glass (docs/fingers.md). The form on the right
needs a matrix of the coils' size alone, and its sum over all fingers' points is found once: for A
its own are left out.

Fingers are on the plate. Finger j pushes back with Z times its displacement u_j, and so

    u = (1 + Z g)⁻¹ h̄,   h′(p) = h(p) − Σ_j g(p, j) Z u_j,

where g(a, b) = h(a)ᵀ M h̄(b) between fingers (coupling.py) and the place's own compliance under one.

A signal that is no tone plays with real gains. Below a plate's first resonance that is no loss to
speak of: h is nearly real. ‖H d‖² is then dᵀ Re(Hᴴ H) d, and h̄* gives its real part, once the phase
θ that it has in common is taken out: 2θ = arg Σ h̄*², which leaves the largest real part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import ArgumentError
from chladni.sim.image.metrics import FINGERTIP_RADIUS

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Place = tuple[float, float]

MOST_FINGERS = 5
"""That have voices: so many a GT911 reports as it comes."""
MOST_LISTED = 10
"""That a GT911 can be set to list; those beyond the voices have a level of 0."""
RING_RADIUS, RING_POINTS = 5e-3, 6
"""m. A ring of six at 5 mm and the centre keep a disc of 6 mm still: four points at 4 mm lose
7 dB at the worst tenth of fingers on `quiet16` and 1 to 2 on other boards, eight gain 0.5 at most
(bench/several_fingers/fingers.py)."""
CENTRE_WEIGHT = 1.0 - 0.5 * (FINGERTIP_RADIUS / RING_RADIUS) ** 2
"""Of the centre in a disc's mean, the ring having the rest: exact for fields of second order, whose
mean over a disc of radius a is w(0) + a² ∇²w/8, and over the ring w(0) + r² ∇²w/4."""
REGULARISATION = 1e-3
"""λ over the mean square of a point's responses: a tenth of it isolates 1 to 2 dB more (5 on
`prototype`) and costs level, ten times as much 1 to 3 less (5), two fingers pressing
(bench/several_fingers/fingers.py)."""


class KnownPlate(Protocol):
    """What is known of a plate: from its model, or as a table has it."""

    @property
    def coupling(self) -> ComplexArray:
        """M, shape (actuators, actuators), N/m."""
        ...

    def at(self, places: FloatArray) -> ComplexArray:
        """What each coil does at places (k, 2), m; shape (k, actuators), m/N."""
        ...

    def own_at(self, places: FloatArray) -> ComplexArray:
        """A fingertip's own compliance at places (k, 2), m; shape (k,), m/N."""
        ...


@dataclass(frozen=True)
class FingerDrives:
    """A drive for each finger of a set, and what the plate that is known says of them.

    Attributes
    ----------
    drives
        complex128, shape (fingers, actuators), newtons; the largest of each is 1 times its level.
    means
        Mean displacement under each finger by each drive, with all fingers on the plate, m, shape
        (drives, fingers).
    shares
        RMS of the drive's displacement over each finger's points, m, shape (drives, fingers).
    below_loudest_db
        How far each drive's own displacement is below that of the loudest drive, dB, shape
        (fingers,); at most 0.
    """

    drives: ComplexArray
    means: ComplexArray
    shares: FloatArray
    below_loudest_db: FloatArray

    @property
    def isolation_db(self) -> FloatArray:
        """Own over the largest share at another finger, dB, (fingers,); alone 300, silent 0."""
        own = np.diag(self.shares)
        others = np.where(np.eye(len(own), dtype=bool), 0.0, self.shares).max(axis=1)
        ratio = np.maximum(own, 1e-300) / np.maximum(np.maximum(others, own * 1e-15), 1e-300)
        return np.asarray(20.0 * np.log10(ratio))


def drives_for(
    plate: KnownPlate,
    fingers: Sequence[Place],
    *,
    levels: Sequence[float] | FloatArray | None = None,
    stiffness: complex = 0.0,
    regularisation: float | Sequence[float] | FloatArray = REGULARISATION,
    real: bool | Sequence[bool] = False,
) -> FingerDrives:
    """A drive for each finger that leaves the others still.

    Parameters
    ----------
    plate
        What is known of the plate.
    fingers
        Middles of the fingertips, m from the plate's centre, one to five.
    levels
        Largest force of each drive, N; 1 each if left out.
    stiffness
        Force over displacement of each finger, N/m (`pressing_stiffness`); 0 for a free plate.
    regularisation
        λ over the mean square of a point's responses, positive; one for all, or one a finger.
    real
        Whether drives have real gains, for signals that are no tones; one for all, or one a finger.

    Returns
    -------
    FingerDrives

    Raises
    ------
    ArgumentError
        No finger or more than five, or a λ that is not positive.

    References
    ----------
    The module's equations; docs/fingers.md.
    """
    return PressedPoints.of(plate, fingers, stiffness, real).drives(levels, regularisation)


@dataclass(frozen=True)
class PressedPoints:
    """What coils do at all fingers' points, found once for drives of any λ.

    Attributes
    ----------
    points
        h′, complex128, shape (fingers, points, actuators), m/N.
    means
        h̄′, over each finger's disc, shape (fingers, actuators).
    others
        Hᴴ H of the points of all fingers but each, shape (fingers, actuators, actuators), m²/N².
    real
        Whose drives have real gains, bool, shape (fingers,).
    """

    points: ComplexArray
    means: ComplexArray
    others: ComplexArray
    real: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        plate: KnownPlate,
        fingers: Sequence[Place],
        stiffness: complex,
        real: bool | Sequence[bool] = False,
    ) -> PressedPoints:
        """Of fingers on a plate, as of `drives_for`."""
        centres = np.asarray(fingers, dtype=np.float64).reshape(-1, 2)
        if not 1 <= len(centres) <= MOST_LISTED:
            raise ArgumentError("fingers", len(centres), f"1 to {MOST_LISTED} of them")
        points = loaded_points(plate, centres, stiffness)
        grams = np.einsum("fpa,fpb->fab", points.conj(), points)
        means = np.einsum("p,fpa->fa", disc_weights(), points)
        whose = np.broadcast_to(np.asarray(real, dtype=np.bool_), (len(centres),))
        return cls(points, means, grams.sum(axis=0) - grams, whose)

    def drives(
        self,
        levels: Sequence[float] | FloatArray | None,
        regularisation: float | Sequence[float] | FloatArray,
    ) -> FingerDrives:
        """The fingers' drives, as of `drives_for`."""
        count = len(self.points)
        shares = np.broadcast_to(np.asarray(regularisation, dtype=np.float64), (count,))
        if not np.all((shares > 0.0) & np.isfinite(shares)):
            raise ArgumentError("regularisation", regularisation, "a positive number")
        sizes = np.ones(count) if levels is None else np.asarray(levels, dtype=np.float64)
        found = np.empty(self.means.shape, dtype=np.complex128)
        for own in range(count):
            gram, aim = self.others[own], self.means[own].conj()
            if self.real[own]:
                gram, aim = gram.real, real_part(aim)
            found[own] = _loudest_but(gram, aim, shares[own], count - 1)
            found[own] *= sizes[own] / max(float(np.abs(found[own]).max()), 1e-300)
        moved = np.einsum("da,fpa->dfp", found, self.points)
        means = np.einsum("da,fa->df", found, self.means)
        loudest = np.abs(self.means).sum(axis=1) * sizes
        reached = np.abs(np.diag(means)) / np.maximum(loudest, 1e-300)
        return FingerDrives(
            drives=found,
            means=means,
            shares=np.sqrt(np.einsum("p,dfp->df", disc_weights(), np.abs(moved) ** 2)),
            below_loudest_db=20.0 * np.log10(np.maximum(reached, 1e-300)),
        )


def loaded_points(plate: KnownPlate, centres: FloatArray, stiffness: complex) -> ComplexArray:
    """h′ at each finger's points, with all fingers on the plate; (fingers, points, actuators)."""
    count = len(centres)
    offsets = ring_offsets()
    free = plate.at((centres[:, None] + offsets).reshape(-1, 2)).reshape(count, len(offsets), -1)
    if not stiffness:
        return free
    means = np.einsum("p,fpa->fa", disc_weights(), free)
    between = np.einsum("fpa,ja->fpj", free, means @ plate.coupling)
    own = plate.own_at(centres)
    for k in range(count):
        between[k, :, k] = own[k]
    pairs = np.einsum("p,fpj->fj", disc_weights(), between)
    pushed = stiffness * np.linalg.solve(np.eye(count) + stiffness * pairs, means)
    return np.asarray(free - between @ pushed)


def ring_offsets() -> FloatArray:
    """From a finger's middle to its points, m, shape (7, 2): the centre and a ring."""
    turns = np.arange(RING_POINTS) * (2.0 * np.pi / RING_POINTS)
    ring = RING_RADIUS * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    return np.concatenate((np.zeros((1, 2)), ring))


def disc_weights() -> FloatArray:
    """Of a finger's points in the mean over its disc, shape (7,)."""
    ring = np.full(RING_POINTS, (1.0 - CENTRE_WEIGHT) / RING_POINTS)
    return np.concatenate(((CENTRE_WEIGHT,), ring))


def real_part(drive: ComplexArray) -> FloatArray:
    """Of a drive, once the phase is taken out that leaves the largest; shape (actuators,)."""
    phase = 0.5 * np.angle(np.sum(drive**2))
    return np.asarray((drive * np.exp(-1j * phase)).real)


def _loudest_but(
    gram: ComplexArray | FloatArray,
    aim: ComplexArray | FloatArray,
    regularisation: float,
    others: int,
) -> ComplexArray | FloatArray:
    """λ (Hᴴ H + λ I)⁻¹ h̄*; with no other finger the loudest drive itself."""
    if others == 0:
        return aim
    mean_square = float(np.trace(gram).real) / (others * (RING_POINTS + 1))
    raised = max(regularisation * mean_square, 1e-300)
    whole = gram + raised * np.eye(len(gram))
    return np.asarray(raised * np.linalg.solve(whole, aim))
