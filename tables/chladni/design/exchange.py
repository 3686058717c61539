"""Greedy exchange over a grid of candidate coils, on fields that are computed once.

The plate without coils is solved for a newton at each candidate. A magnet adds its mass there and
takes away the foam that its cut-out has, so with δ = −ω²m − k(1 + iη)πr² on the diagonal and Z the
plate's receptance among the chosen coils, their fields are H(1 + δZ)⁻¹: exact for masses and foam
at points. What magnets do besides, holding the plate flat where they are glued, needs the plate to
be solved again; so this only ranks layouts, and the search solves the best ones again.

The drive of a place is what has the most mean under the finger for its mean square from a second
finger's distance on, Σ|W|² = gᴴRg: R⁻¹m, in closed form. A layout's figure is the loudest far place
below the finger, dB, its 10th percentile over places.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from chladni.design.layouts import Candidate, Place, makeups
from chladni.drives.problem.threads import one_blas_thread
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import Focus
from chladni.sim.board.parts import Image
from chladni.sim.board.quantity import MM
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.transfer import disc_fields
from chladni.sim.image import metrics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

POINT = 2e-3
"""m between points of the fields; a finger covers 28."""
SOUND = 1e-6
"""Of R's mean diagonal, added to it: drives of no use otherwise come out as the best."""
BAD_TAIL, TYPICAL = 0.1, 0.1
"""The percentile, and the share of the median in a layout's figure, which breaks ties."""
SWEEPS = 4
"""Of exchanging every orbit; usual are 2 or 3."""
TOLERANCE = 2e-2
TOGETHER = 128
"""Places whose drives are found in one product: their memory is bounded on a large sheet."""
PACKINGS, PACKING_SEED = 200, 1
"""How often coils are thrown on the plate where choosing one after the other leaves no room."""


@dataclass(frozen=True)
class Plain:
    """A plate without coils, and what a newton at each candidate does to it.

    Attributes
    ----------
    fields
        Shape (orbits' coils, points), m/N.
    at_coils
        The same in the candidates' discs, shape (coils, coils).
    fingers
        Rows that take the mean under the finger at each place, shape (places, points).
    far
        1 at points that count as a second finger's, else 0, shape (places, points).
    delta
        What a coil adds to the plate where it stands, N/m.
    """

    fields: ComplexArray
    at_coils: ComplexArray
    fingers: FloatArray
    far: FloatArray
    delta: complex

    @classmethod
    def of(cls, board: Board, coils: Sequence[Place], places: Sequence[Place]) -> Plain:
        """Solve the plate of a board, whose own coils are left out."""
        plain = _without_coils(board)
        magnet = board.magnet
        radius = magnet.radius if magnet else 0.0
        with one_blas_thread():
            values = disc_fields(
                plain,
                [(x / MM, y / MM) for x, y in coils],
                radius,
                tolerance=TOLERANCE,
                model=plate_model(plain),
                allow_unmet=True,
            ).values
        flat = values.reshape(len(coils), -1)
        grid = np.stack(np.meshgrid(plain.x, plain.y, indexing="ij"), axis=-1).reshape(-1, 2)
        under = [
            metrics.disc_mask(plain.x, plain.y, one, max(radius, POINT)).ravel() for one in coils
        ]
        asked = board.focus or Focus()
        fingers, far = [], []
        for place in places:
            disc = metrics.disc_mask(plain.x, plain.y, place, metrics.FINGERTIP_RADIUS).ravel()
            fingers.append(disc / disc.sum())
            distance = np.hypot(*(grid - place).T)
            # A disc that far away begins a finger's radius nearer.
            far.append(distance >= asked.silent_from - 0.5 * metrics.FINGERTIP_RADIUS)
        at_coils = flat @ np.array([disc / disc.sum() for disc in under]).T
        return cls(flat, at_coils, np.array(fingers), np.array(far, float), _added(board))

    def figure(self, chosen: Sequence[int]) -> float:
        """How well coils at these candidates focus, dB."""
        own = list(chosen)
        coupling = np.eye(len(own)) + self.delta * self.at_coils[np.ix_(own, own)]
        fields = np.asarray(np.linalg.solve(coupling.T, self.fields[own]), complex)
        means = self.fingers @ fields.T
        parts = [slice(first, first + TOGETHER) for first in range(0, len(means), TOGETHER)]
        levels = np.concatenate([_levels(fields, means[own], self.far[own]) for own in parts])
        if not levels.size:
            return 0.0
        return float(np.quantile(levels, BAD_TAIL) + TYPICAL * np.median(levels))


def _levels(fields: ComplexArray, means: ComplexArray, far: FloatArray) -> FloatArray:
    """The loudest far point below the finger at each place that has any, dB.

    All places in one product: a figure takes a quarter of the time that place by place takes.
    """
    has_far = far.any(axis=1)
    means, far, coils = means[has_far], far[has_far], len(fields)
    forms = np.empty((len(far), coils, coils), complex)
    for row, own in enumerate(fields.conj()):
        pairs = (own * fields).T
        forms[:, row] = far @ pairs.real + 1j * (far @ pairs.imag)
    traces = np.trace(forms, axis1=1, axis2=2).real / coils
    forms += SOUND * traces[:, None, None] * np.eye(coils)
    drives = np.linalg.solve(forms, means.conj()[..., None])[..., 0]
    made = drives @ fields
    loudest = np.max((made.real**2 + made.imag**2) * far, axis=1, initial=1e-300)
    under = np.abs(np.sum(drives * means, axis=1)) ** 2
    return np.asarray(10.0 * np.log10(under / loudest))


def best_layouts(
    plain: Plain, offered: Sequence[Candidate], count: int, least: float
) -> list[tuple[float, list[Candidate]]]:
    """The best layout of each make-up of so many coils, the best make-up first.

    Parameters
    ----------
    plain
        With a row for each image of each candidate, in their order.
    least
        Distance of two coils, m.
    """
    first = np.cumsum([0, *(len(one.images) for one in offered)])
    rows = [list(range(*ends)) for ends in pairwise(first.tolist())]
    offers = Counter(len(one.images) for one in offered)
    found = []
    for makeup in makeups(count, offers):
        picked = _exchanged(plain, offered, rows, makeup, least)
        if picked is not None:
            level, chosen = picked
            found.append((level, [offered[k] for k in chosen]))
    return sorted(found, key=lambda one: -one[0])


def _exchanged(
    plain: Plain,
    offered: Sequence[Candidate],
    rows: Sequence[list[int]],
    makeup: Sequence[int],
    least: float,
) -> tuple[float, list[int]] | None:
    """One orbit after the other where it does best; then each again while that gains anything."""
    chosen: list[int] = []
    level = -np.inf

    def best(others: list[int], size: int) -> tuple[float, int] | None:
        places = [place for k in others for place in offered[k].images]
        tried = []
        for k, one in enumerate(offered):
            if len(one.images) == size and _fits(one, places, least):
                taken = [row for other in (*others, k) for row in rows[other]]
                tried.append((plain.figure(taken), k))
        return max(tried, default=None)

    for size in makeup:
        found = best(chosen, size)
        if found is None:
            # Those before it left no room: begin with any that have it.
            chosen = _packed(offered, makeup, least)
            if not chosen:
                return None
            break
        level = found[0]
        chosen.append(found[1])
    level = plain.figure([row for k in chosen for row in rows[k]])
    for _ in range(SWEEPS):
        before = level
        for slot, size in enumerate(makeup):
            others = chosen[:slot] + chosen[slot + 1 :]
            found = best(others, size)
            if found is not None and found[0] > level:
                level, chosen[slot] = found
        if level <= before + 1e-3:
            break
    return level, chosen


def _packed(offered: Sequence[Candidate], makeup: Sequence[int], least: float) -> list[int]:
    """Orbits drawn at random that fit beside each other; none if that was not seen to be."""
    rng = np.random.default_rng(PACKING_SEED)
    for _ in range(PACKINGS):
        chosen: list[int] = []
        for size in makeup:
            places = [place for k in chosen for place in offered[k].images]
            room = [
                k
                for k, one in enumerate(offered)
                if len(one.images) == size and _fits(one, places, least)
            ]
            if not room:
                break
            chosen.append(int(rng.choice(room)))
        else:
            return chosen
    return []


def _fits(one: Candidate, places: Sequence[Place], least: float) -> bool:
    return all(
        (x - u) ** 2 + (y - v) ** 2 >= (least - 1e-9) ** 2 for x, y in one.images for u, v in places
    )


def _without_coils(board: Board) -> Board:
    """The plate as it is before coils are on it, with fewer image points."""
    foundation = board.foundation
    if foundation is not None:
        foundation = replace(foundation, coil_cut_out=0.0)
    points = tuple(max(7, round(side / POINT) + 1) for side in board.plate.size)
    return replace(
        board, magnet=None, coil=None, foundation=foundation, image=Image((points[0], points[1]))
    )


def _added(board: Board) -> complex:
    """Dynamic stiffness that a coil adds at its place: its magnet's mass, less the foam's."""
    omega = 2.0 * np.pi * board.drive.frequency_hz
    magnet, foundation = board.magnet, board.foundation
    added = 0.0 + 0.0j
    if magnet is not None:
        added -= omega**2 * magnet.areal_mass * np.pi * magnet.radius**2
    if foundation is not None:
        area = np.pi * foundation.coil_cut_out**2
        loss = 1.0 + 1j * foundation.total_loss_factor
        added -= foundation.total_stiffness * loss * area
    return added
