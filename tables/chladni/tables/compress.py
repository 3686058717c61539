"""Choose the fewest bits for a board's drives, by what they really lose.

The gauge turns every drive so that its quadrature part is least. Then packings are tried from small
to large: each drive is rounded, and where that costs too much, single codes are moved by one as
long as SSIM gains and the field stays within its own limit. The first packing within all limits is
taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.tables import _kernel
from chladni.tables.packing import FULL_SCALE, MAX_BITS, Packing
from chladni.tables.scene import Scene
from chladni.tables.search import as_reals, every, in_phase
from chladni.tables.threads import in_threads

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SPARSE = 4
"""While codes are moved, the field is watched on every fourth image point each way."""
FIELD_MARGIN = 0.8
"""Share of the field's limit used up there; the rest is for the points between."""
HEADROOM = 24
"""The largest in-phase code stands for this little less than full scale (0.006 dB), so that a small
quadrature part fits beside it within the limit."""
SAMPLE = 3
"""Every third entry, rounded plainly, tells whether a packing is worth a closer look."""
HARDEST = 8
"""Entries that a packing is tried on before all others."""
LOOKED_AT = 6
"""Moves tried per turn, those that the gradient promises most of."""
HOPELESS = 3.0
"""No packing is tried where plain rounding costs the median this many times the limit, or the worst
twice as many times its own."""


@dataclass(frozen=True)
class LossLimits:
    """What a table may lose: a tenth of the amplitude JND, and SSIM nobody can see."""

    field_db: float = 0.25
    ssim_p99: float = 0.002
    ssim_max: float = 0.005


@dataclass(frozen=True)
class Entry:
    """One stored region: its drive in units of the largest gain, and what it is meant to do."""

    drive: ComplexArray
    image: NDArray[np.float32]


@dataclass(frozen=True)
class Packed:
    """Codes of all entries, shape (entries, actuators, 2), and what they lose."""

    packing: Packing
    codes: IntArray
    ssim_loss: FloatArray
    field_error_db: FloatArray


def least_quadrature(drive: ComplexArray) -> ComplexArray:
    """Turn a drive so that Σ Im² is least, its largest gain in phase rather than opposed."""
    turned = in_phase(drive)
    return np.asarray(turned if turned.real[np.abs(turned).argmax()] >= 0.0 else -turned)


def compress(
    scene: Scene,
    entries: Sequence[Entry],
    limits: LossLimits = LossLimits(),
    *,
    jobs: int | None = None,
) -> Packed:
    """The smallest packing within the limits, and every entry's codes in it."""

    def rounded(indices: NDArray[np.intp], packing: Packing) -> list[_Rounded]:
        def one(k: int) -> _Rounded:
            return _round(scene, entries[k], packing, limits)

        return list(in_threads(one, indices.tolist(), jobs=jobs))

    def losses(some: Sequence[Entry], packings: Sequence[Packing]) -> list[list[float]]:
        def one(entry: Entry) -> list[float]:
            return _plain_losses(scene, entry, packings)

        return list(in_threads(one, some, jobs=jobs))

    packings = _packings(entries)
    plain = np.array(losses(entries[::SAMPLE], packings))
    for packing, sample in zip(packings, plain.T, strict=True):
        last = packing.bits == (MAX_BITS, MAX_BITS)
        hopeless = (
            np.median(sample) > HOPELESS * limits.ssim_p99
            or sample.max() > 2.0 * HOPELESS * limits.ssim_max
        )
        if hopeless and not last:
            continue
        # The hardest are tried first: most packings fail on them, and soon.
        every_loss = np.array(losses(entries, [packing])).ravel()
        order = np.argsort(-every_loss, kind="stable")
        found = rounded(order[:HARDEST], packing)
        if not last and not _may_do(found, len(entries), limits):
            continue
        found += rounded(order[HARDEST:], packing)
        packed = _packed(packing, [found[k] for k in np.argsort(order, kind="stable")])
        if last or _within(packed, limits):
            return packed
    raise AssertionError("the last packing is always taken")


def lose(scene: Scene, entries: Sequence[Entry], packing: Packing, limits: LossLimits) -> Packed:
    """All entries in one packing, whatever that loses; codes are moved where `limits` ask."""
    return _packed(packing, list(in_threads(lambda e: _round(scene, e, packing, limits), entries)))


def _packed(packing: Packing, found: Sequence[_Rounded]) -> Packed:
    return Packed(
        packing,
        np.array([one.codes for one in found]),
        np.array([one.ssim_loss for one in found]),
        np.array([one.field_error_db for one in found]),
    )


def _may_do(found: Sequence[_Rounded], entries: int, limits: LossLimits) -> bool:
    """Whether the limits may still hold for all, seeing what some entries lose."""
    beyond = sum(one.ssim_loss > limits.ssim_p99 for one in found)
    return beyond <= 1 + entries // 100 and all(
        one.ssim_loss <= limits.ssim_max and one.field_error_db <= limits.field_db for one in found
    )


def scales_for(entries: Sequence[Entry]) -> tuple[int, int]:
    """What the largest codes stand for: nearly full scale, and the widest quadrature part."""
    largest = max((float(np.abs(entry.drive.imag).max()) for entry in entries), default=0.0)
    quadrature = max(1, min(FULL_SCALE, int(np.ceil(largest * FULL_SCALE))))
    return FULL_SCALE - HEADROOM, quadrature


def _packings(entries: Sequence[Entry]) -> list[Packing]:
    """From few bits to many; the quadrature part gets up to four fewer."""
    pairs = [(i, i - less) for i in range(6, 14) for less in range(5) if i - less >= 3]
    pairs.sort(key=lambda pair: (sum(pair), pair))
    scales = scales_for(entries)
    return [Packing(pair, scales) for pair in pairs] + [Packing((MAX_BITS, MAX_BITS))]


def _within(packed: Packed, limits: LossLimits) -> bool:
    return bool(
        packed.field_error_db.max() <= limits.field_db
        and np.percentile(packed.ssim_loss, 99) <= limits.ssim_p99
        and packed.ssim_loss.max() <= limits.ssim_max
    )


@dataclass(frozen=True)
class _Rounded:
    """One entry's codes, and what they lose."""

    codes: IntArray
    ssim_loss: float
    field_error_db: float


def _objective(scene: Scene, entry: Entry) -> _kernel.Objective:
    return scene.space.objective(scene.space.levels[-1], entry.image.astype(np.float64))


def _drive(packing: Packing, codes: IntArray) -> ComplexArray:
    values = packing.values(codes) / FULL_SCALE
    return np.asarray(values[:, 0] + 1j * values[:, 1])


class _Scale:
    """One entry under one packing: scores codes."""

    def __init__(self, scene: Scene, entry: Entry, packing: Packing) -> None:
        self._scene = scene
        self._packing = packing
        self._objective = _objective(scene, entry)
        self._best = scene.space.value(self._objective, entry.drive)

    def drive(self, codes: IntArray) -> ComplexArray:
        return _drive(self._packing, codes)

    def slope(self, codes: IntArray) -> ComplexArray:
        space = self._scene.space
        drive, gradient = self.drive(codes), np.zeros(2 * space.rank)
        self._objective.evaluate(as_reals(space.coordinates(drive)), gradient)
        return space.drive_gradient(drive, gradient)

    def loss(self, codes: IntArray) -> float:
        return self._best - self._scene.space.value(self._objective, self.drive(codes))


def _nearest(entry: Entry, packing: Packing) -> IntArray:
    """The nearest codes whose gains keep to the limit."""
    parts = np.stack((entry.drive.real, entry.drive.imag), axis=-1)
    codes = packing.codes(parts * FULL_SCALE)
    while (beyond := _is_too_loud(packing, codes)).any():
        codes[beyond, 0] -= np.sign(codes[beyond, 0])
    return codes


def _is_too_loud(packing: Packing, codes: IntArray) -> NDArray[np.bool_]:
    """Which actuators' gains are beyond full scale, for in-phase and quadrature together."""
    values = packing.values(codes).astype(np.int64)
    return np.asarray((values**2).sum(axis=-1) > FULL_SCALE**2)


def _plain_losses(scene: Scene, entry: Entry, packings: Sequence[Packing]) -> list[float]:
    """What one entry loses to plain rounding, under each packing."""
    objective = _objective(scene, entry)
    best = scene.space.value(objective, entry.drive)
    return [
        best - scene.space.value(objective, _drive(packing, _nearest(entry, packing)))
        for packing in packings
    ]


def _round(scene: Scene, entry: Entry, packing: Packing, limits: LossLimits) -> _Rounded:
    """The nearest codes of one entry, or better ones."""
    scale = _Scale(scene, entry, packing)
    codes = _nearest(entry, packing)
    loss = scale.loss(codes)
    fields = scene.fields.values
    rows, columns = (every(SPARSE, size) for size in fields.shape[1:])
    sparse = fields[:, rows][:, :, columns].reshape(len(fields), -1)
    watched = np.abs(entry.drive @ sparse)
    if loss > 0.75 * limits.ssim_p99:
        codes, loss = _improve(scale, codes, loss, packing, sparse, watched, limits)
    exact = np.abs(np.tensordot(entry.drive, fields, axes=1))
    decoded = np.abs(np.tensordot(scale.drive(codes), fields, axes=1))
    return _Rounded(codes, loss, _error_db(decoded, exact))


def _improve(
    scale: _Scale, codes: IntArray, loss: float, packing: Packing,
    sparse: ComplexArray, watched: FloatArray, limits: LossLimits,
) -> tuple[IntArray, float]:  # fmt: skip
    """Move single codes by one, the best of the most promising moves first, while it pays."""
    allowed = FIELD_MARGIN * limits.field_db
    steps = np.array(packing.scales) / (FULL_SCALE * packing.largest)
    while loss > 0.5 * limits.ssim_p99:
        slope = scale.slope(codes)
        promise = np.stack((slope.real, slope.imag), axis=-1) * steps
        order = np.argsort(-np.abs(promise), axis=None)[:LOOKED_AT]
        moves: list[tuple[float, int, IntArray]] = []
        for place in zip(*np.unravel_index(order, codes.shape), strict=True):
            moved = codes.copy()
            moved[place] += 1 if promise[place] > 0.0 else -1
            if abs(moved[place]) > packing.largest[place[1]]:
                continue
            if _is_too_loud(packing, moved).any():
                continue
            if _error_db(np.abs(scale.drive(moved) @ sparse), watched) <= allowed:
                moves.append((scale.loss(moved), len(moves), moved))
        if not moves or min(moves)[0] >= loss - 1e-6:
            break
        loss, _, codes = min(moves)
    return codes, loss


def _error_db(decoded: FloatArray, exact: FloatArray) -> float:
    largest = float(exact.max())
    error = float(np.abs(decoded - exact).max())
    return float(20.0 * np.log10(1.0 + error / largest)) if largest > 0.0 else 0.0
