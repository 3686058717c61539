"""How good a layout looks on a plate that is solved once: figures by which layouts are ranked.

**For one finger** the drive of a place is what has the most mean under the finger for its mean
square from a second finger's distance on, Σ|W|² = gᴴRg: R⁻¹m, in closed form. The figure is the
loudest far place below the finger, dB.

**For several** two fingers stand for all. On the board as drawn five coils leave nothing of one
finger's signal under another, whatever the layout. What counts is what is left on a board that is
built: each coil's share of the field at the other finger, a, is off by a part ε of its own, which
comes to ε² Σ|a_k g_k|² on average. The drive is M⁻¹ā′ with a′ of the finger itself and
M = āaᵀ + ε² diag |a|²: the most of its own for that. Isolation and the displacement for a newton of
the loudest coil count by the SPEC's weights. Of 40 layouts of `feet5` this ranks as the search's
own score does (0.83 by Spearman); the figure for one finger has nothing in common with it (0.16).
A click is what the drives' real parts then leave at 200 Hz, off as much. Of 16 boards of `feet5`,
whose feet are soft or harder, this ranks as scores that weigh clicks (0.85); what tones keep ranks
the other way round (-0.68).

Of either the 10th percentile over places counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chladni.design.layouts.layouts import Place
from chladni.design.layouts.plain_plate import PlainPlate
from chladni.drives.fingers.silence import real_part
from chladni.drives.methods import SEED
from chladni.drives.scoring.several_fingers.finger_sets import finger_sets
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import Focus
from chladni.sim.image import metrics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SOUND = 1e-6
"""Of R's mean diagonal, added to it: drives of no use otherwise come out as the best."""
BAD_TAIL, TYPICAL = 0.1, 0.1
"""The percentile, and the share of the median in a focus's figure, which breaks ties."""
TOGETHER = 128
"""Places whose drives are found in one product: their memory is bounded on a large sheet."""
PAIRS = 96
"""Of fingers: the worst tenth is that of 192 places."""
OFF = 0.1
"""ε: of 0.02 to 0.2 all rank alike."""
ANYWHERE = 0.1
"""Share of the mean |a|² over all fingers that is added to each: a coil's field that vanishes at a
finger as drawn does not as built."""


class Rating(Protocol):
    """By what layouts are ranked."""

    def figure(self, chosen: Sequence[int]) -> float:
        """How good coils at these candidates look, dB; the larger the better."""


@dataclass(frozen=True)
class FocusRating:
    """How well one finger is kept from all else.

    Attributes
    ----------
    fingers
        Rows that take the mean under the finger at each place, shape (places, points).
    far
        1 at points that count as a second finger's, else 0, shape (places, points).
    """

    plain: PlainPlate
    fingers: FloatArray
    far: FloatArray

    @classmethod
    def of(cls, board: Board, plain: PlainPlate, places: Sequence[Place]) -> FocusRating:
        """At places, m."""
        asked = board.focus or Focus()
        grid = np.stack(np.meshgrid(plain.x, plain.y, indexing="ij"), axis=-1).reshape(-1, 2)
        # A disc that far away begins a finger's radius nearer.
        least = asked.silent_from - 0.5 * metrics.FINGERTIP_RADIUS
        far = [np.hypot(*(grid - place).T) >= least for place in places]
        return cls(plain, plain.fingers(places), np.array(far, float))

    def figure(self, chosen: Sequence[int]) -> float:
        """How well coils at these candidates focus, dB."""
        fields = self.plain.with_coils(chosen, self.plain.fields)
        means = self.fingers @ fields.T
        parts = [slice(first, first + TOGETHER) for first in range(0, len(means), TOGETHER)]
        levels = np.concatenate([_levels(fields, means[own], self.far[own]) for own in parts])
        if not levels.size:
            return 0.0
        return float(np.quantile(levels, BAD_TAIL) + TYPICAL * np.median(levels))


@dataclass(frozen=True)
class ApartRating:
    """How well two fingers are kept apart, and how much each gets.

    Attributes
    ----------
    under
        What a newton at each candidate does under the fingers, shape (coils, 2 · pairs), m/N: the
        first of all pairs, then the others.
    weights
        Of a decibel of isolation, of displacement, and of a click's isolation.
    click
        The plate as a click tells of it, and `under` of that; None where clicks do not count.
    """

    plain: PlainPlate
    under: ComplexArray
    weights: tuple[float, float, float]
    click: tuple[PlainPlate, ComplexArray] | None = None

    @classmethod
    def of(
        cls,
        board: Board,
        plain: PlainPlate,
        weights: tuple[float, float, float],
        click: PlainPlate | None = None,
    ) -> ApartRating:
        """Of pairs that are drawn over the active area.

        Raises
        ------
        ArgumentError
            Two fingers have no room on the board.
        """
        rng = np.random.default_rng(SEED)
        pairs = finger_sets(board, 2, PAIRS, board.fingers_apart, rng).swapaxes(0, 1).reshape(-1, 2)
        places = [(float(x), float(y)) for x, y in pairs]
        under = [own.fields @ own.fingers(places).T for own in (plain, click) if own is not None]
        return cls(plain, under[0], weights, (click, under[1]) if click else None)

    def figure(self, chosen: Sequence[int]) -> float:
        """How well coils at these candidates keep fingers apart, dB."""
        means = self.plain.with_coils(chosen, self.under).T
        own, other = means, np.roll(means, len(means) // 2, axis=0)
        off = _off(other)
        # M⁻¹ā′ of a rank-one change to a diagonal, by Sherman and Morrison.
        apart, drives = other.conj() / off, own.conj() / off
        share = np.sum(other * drives, axis=1) / (1.0 + np.sum(other * apart, axis=1))
        drives -= apart * share[:, None]
        kept = np.abs(np.sum(own * drives, axis=1))
        # |a′g|² over gᴴMg; for the best g that is a′M⁻¹ā′ itself.
        isolation = 10.0 * np.log10(np.maximum(kept, 1e-300))
        level = 20.0 * np.log10(np.maximum(kept / np.abs(drives).max(axis=1), 1e-300))
        clicks = self._clicks(chosen, drives)
        told = [
            weight * np.quantile(one, BAD_TAIL)
            for weight, one in zip(self.weights, (isolation, level, clicks), strict=True)
        ]
        return float(sum(told))

    def _clicks(self, chosen: Sequence[int], drives: ComplexArray) -> FloatArray:
        """What the real parts of drives keep of a click, dB; zeros where that does not count."""
        if self.click is None:
            return np.zeros(len(drives))
        plain, under = self.click
        own = plain.with_coils(chosen, under).T
        other = np.roll(own, len(own) // 2, axis=0)
        gains = np.array([real_part(drive) for drive in drives])
        left = np.abs(np.sum(other * gains, axis=1)) ** 2 + np.sum(_off(other) * gains**2, axis=1)
        kept = np.abs(np.sum(own * gains, axis=1)) ** 2
        return np.asarray(10.0 * np.log10(np.maximum(kept, 1e-300) / np.maximum(left, 1e-300)))


def _off(other: ComplexArray) -> FloatArray:
    """ε²|a|² of each coil at the other finger, shape (places, coils)."""
    squares = np.abs(other) ** 2
    return np.asarray(OFF**2 * (squares + ANYWHERE * squares.mean()))


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
