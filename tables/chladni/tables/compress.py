"""Find integers for drives that take the fewest bits, by what they really lose.

A drive may be off in many ways that nobody feels: its phase turned, its level a little lower, its
weak directions anywhere. So each region's integers are searched, not rounded: near the prediction
from its neighbours (tables/coding.py), the lattice of every step width is decoded for the point
that a quadratic model of the loss prefers (Babai's nearest plane: gain after gain, the rest
re-optimised each time), for several phases, levels and weights of the bits. Candidates are taken
cheapest first; the first whose true losses keep to the limits is moved by single steps for as long
as that saves bits and the limits hold, and stored.

References
----------
Babai, On Lovász' lattice reduction and the nearest lattice point problem, 1986.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from chladni.tables import _kernel
from chladni.tables.coding import FULL_SCALE, Rates, Visit, passes
from chladni.tables.entry import COARSE_STEP, Entry
from chladni.tables.meetings import Coded, Meeting, Uncoded, apart, as_drive
from chladni.tables.scene import Scene
from chladni.tables.search import as_reals
from chladni.tables.threads import in_threads

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LOUDEST = FULL_SCALE - 24
"""The largest integer gain, 0.006 dB below full scale: means of drives that keep to it stay within
full scale, however they are rounded."""
SSIM_MARGIN, FIELD_MARGIN = 0.73, 0.97
"""Shares of the limits that the search uses, on regions and half-way. Elsewhere between them drives
are further from the best, and the same error costs more SSIM; a field's error grows by rounding.
With 0.77 one place in fifty there loses more than the limit, with 0.73 fewer than one in a hundred,
measured on 450 random places of `prototype` per objective."""
SPARSE = 8
"""Candidates' fields are compared on every eighth image point each way before all points are."""
BETWEEN = 4
COARSE_SLACK = 0.0006
"""Half-way between regions a loss of SSIM on every fourth image point may be off by so much."""
COMPLEX = 2.0
"""A field's complex error may be so much larger than that of its amplitude: phases that vary over
the board are not felt in a region, but where its drive is mixed with a neighbour's."""
PROBE = 1e-3
"""Gains differ by this much in the model's difference quotients."""
PHASES = np.exp(1j * np.linspace(-0.15, 0.15, 17))
"""Turns by more than this would show between regions, where drives are interpolated."""
LEVELS_DB = (-0.2, -0.15, -0.1, -0.05, 0.0)
BIT_WEIGHTS = (0.0, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""What a step away from the prediction costs, in units of the whole allowed loss."""
FIELD_PEAK = 1.5
"""How far the largest error of a field exceeds its root mean square, for the model only."""
SHIFTS = ((12, 11, 10, 9, 8), (7,), (6,), (5,), (4,), (3,), (2,))
"""Step widths tried, in powers of two: the usual ones together, finer ones while nothing fits."""
SHORTLIST = 200
TRIES = 100


@dataclass(frozen=True)
class LossLimits:
    """What a table may lose: a tenth of the amplitude JND, and SSIM nobody can see."""

    field_db: float = 0.25
    ssim: float = 0.002

    def times(self, factor: float) -> LossLimits:
        """Looser or tighter alike."""
        return LossLimits(self.field_db * factor, self.ssim * factor)


LIMITS = LossLimits()
"""What a table keeps to unless somebody asks for something else."""


@dataclass(frozen=True)
class Losses:
    """What is lost against the unquantised drives, each of shape (entries,).

    SSIM; decibels of the field's worst point; decibels of the level in the target's disc.
    """

    ssim: FloatArray
    field_db: FloatArray
    level_db: FloatArray


def compress(
    scene: Scene, uncoded: Uncoded, limits: LossLimits = LIMITS, *, jobs: int | None = None
) -> NDArray[np.int16]:
    """Integers of all entries that take few bits as a stream and lose no more than the limits.

    Returns
    -------
    NDArray[np.int16]
        Shape (entries, actuators, 2).
    """
    sparse = _sample(scene, SPARSE)
    coded, entries = Coded(uncoded), uncoded.entries
    columns, rows = uncoded.folding.shape(uncoded.grid)
    rates = Rates(shift=SHIFTS[0][len(SHIFTS[0]) // 2])

    def fitted(visit: Visit) -> IntArray:
        trial = _Trial(scene, entries[visit.at], coded.meetings(visit.at), sparse, limits)
        return _fit(trial, coded.predictor.predict(visit), rates)

    for together in passes(columns, rows):
        ready = [visit for visit in together if coded.predictor.has_neighbours(visit)]
        for batch in apart(ready, columns):
            for visit, values in zip(batch, in_threads(fitted, batch, jobs=jobs), strict=True):
                coded.hold(visit, values)
        for visit in together:
            held = coded.held(visit)
            values = fitted(visit) if held is None else held
            _, rates = rates.best(values - coded.predictor.predict(visit))
            coded.put(visit, values)
    return coded.predictor.values.reshape(len(entries), -1, 2).astype(np.int16)


def losses(scene: Scene, entries: Sequence[Entry], drives: ComplexArray) -> Losses:
    """What drives (entries, actuators), in units of the largest gain, lose."""

    def one(case: tuple[Entry, ComplexArray]) -> tuple[float, float, float]:
        entry, drive = case
        exact, got = (
            np.abs(np.tensordot(c, scene.fields.values, axes=1)) for c in (entry.drive, drive)
        )
        levels = [float(np.sqrt(np.mean(field[entry.wanted.disc] ** 2))) for field in (exact, got)]
        level = 20.0 * np.log10(levels[1] / levels[0]) if min(levels) > 0.0 else 0.0
        value = scene.space.value(entry.ssim(scene), drive)
        return entry.best - value, _error_db(got, exact), float(level)

    found = np.array(list(in_threads(one, zip(entries, drives, strict=True))))
    return Losses(found[:, 0], found[:, 1], found[:, 2])


def _fit(trial: _Trial, prediction: IntArray, rates: Rates) -> IntArray:
    """Integers for one entry, in-phase and quadrature alternating."""
    if trial.suits(prediction):
        return prediction
    model = _Model(trial)
    for shifts in SHIFTS:
        steps, widths = model.candidates(prediction, shifts)
        options, bits = prediction + (steps << widths), rates.bits(steps, widths[:, 0])[0]
        for k in model.shortlist(options, bits):
            if trial.suits(options[k]):
                return _descended(trial, model, prediction, rates, steps[k], int(widths[k, 0]))
    return np.asarray(np.rint(_alternating(trial.entry.drive) * LOUDEST).astype(np.int64))


def _descended(
    trial: _Trial, model: _Model, prediction: IntArray, rates: Rates, steps: IntArray, width: int
) -> IntArray:
    """The same with fewer bits, while one or two steps of it can be moved and all limits hold.

    The model knows a field's mean error only; beside a drive that is known to suit, others do.
    """
    moves = _moves(steps.size)
    bits = rates.bits(steps[None], width)[0][0]
    while True:
        beside = steps + moves
        cost = rates.bits(beside, width)[0]
        beside, cost = beside[cost < bits], cost[cost < bits]
        options = prediction + (beside << width)
        better = next((k for k in model.shortlist(options, cost) if trial.suits(options[k])), None)
        if better is None:
            return np.asarray(prediction + (steps << width))
        steps, bits = beside[better], cost[better]


def _alternating(drive: ComplexArray) -> FloatArray:
    pairs = np.stack((drive.real, drive.imag), axis=-1)
    return pairs.reshape(*drive.shape[:-1], 2 * drive.shape[-1])


def _is_loud(values: IntArray) -> NDArray[np.bool_]:
    power = values[..., 0::2] ** 2 + values[..., 1::2] ** 2
    return np.asarray(np.any(power > LOUDEST**2, axis=-1))


class _Trial:
    """The true losses of integers for one entry."""

    def __init__(
        self, scene: Scene, entry: Entry, meetings: Sequence[Meeting], sparse: ComplexArray,
        limits: LossLimits,
    ) -> None:  # fmt: skip
        self.scene, self.entry, self.limits = scene, entry, limits
        self.objective, self.coarse = entry.ssim(scene), entry.ssim(scene, COARSE_STEP)
        self.sparse = sparse
        self._most_ssim = SSIM_MARGIN * limits.ssim
        self._least = entry.best - self._most_ssim
        # What the drive itself is short of the best counts on both images.
        short = entry.best - scene.space.value(self.objective, entry.drive)
        on_coarse = scene.space.value(self.coarse, entry.drive)
        self._least_coarse = on_coarse - (self._most_ssim - short) - COARSE_SLACK
        self._most_db = FIELD_MARGIN * limits.field_db
        self.own = entry.drive @ self.sparse
        self._exact = np.abs(np.tensordot(entry.drive, scene.fields.values, axes=1))
        self._meetings = meetings
        self._wanted = [
            meeting.share * (entry.drive @ meeting.mix + meeting.exact) for meeting in meetings
        ]
        self._best: dict[tuple[int, bool], float] = {}
        self._order = list(range(len(meetings)))

    def suits(self, values: IntArray) -> bool:
        """Whether the integers keep to the limits, here and half-way to what is stored."""
        drive = as_drive(values)
        space = self.scene.space
        if _is_loud(values) or not self._is_near(drive):
            return False
        if space.value(self.coarse, drive) < self._least_coarse or not self._are_met(drive):
            return False
        if space.value(self.objective, drive) < self._least:
            return False
        field = np.abs(np.tensordot(drive, self.scene.fields.values, axes=1))
        return _error_db(field, self._exact) <= self._most_db and self._are_met(drive, fine=True)

    def _is_near(self, drive: ComplexArray) -> bool:
        """Whether phases over the board keep near enough to be mixed with neighbours'."""
        got = drive @ self.sparse
        got *= np.exp(-1j * np.angle(np.vdot(self.own, got)))
        most = COMPLEX * (10.0 ** (self._most_db / 20.0) - 1.0)
        return bool(np.abs(got - self.own).max() <= most * np.abs(self.own).max())

    def _are_met(self, drive: ComplexArray, *, fine: bool = False) -> bool:
        """Whether the limits hold between regions: coarsely and somewhat wider first, then fine."""
        space = self.scene.space
        most = self._most_ssim + (0.0 if fine else COARSE_SLACK)
        for k in self._order:
            meeting, exact = self._meetings[k], self._wanted[k]
            objective = meeting.ssim[fine]
            if (k, fine) not in self._best:
                self._best[k, fine] = space.value(objective, exact)
            decoded = meeting.share * (drive @ meeting.mix + meeting.decoded)
            suits = self._best[k, fine] - space.value(objective, decoded) <= most
            if suits and not fine:
                fields = np.abs(decoded @ self.sparse), np.abs(exact @ self.sparse)
                suits = _error_db(*fields) <= self._most_db
            if not suits:
                # What was too much once will soon be again.
                self._order.remove(k)
                self._order.insert(0, k)
                return False
        return True


class _Model:
    """A quadratic model of one entry's losses, and the lattice points it prefers."""

    def __init__(self, trial: _Trial) -> None:
        scene, entry, limits = trial.scene, trial.entry, trial.limits
        self._drive = entry.drive
        self._ssim = limits.ssim
        space = scene.space
        self._sparse = trial.sparse
        field = trial.own
        self._exact = np.abs(field)
        self._most = (
            FIELD_MARGIN * float(self._exact.max()) * (10.0 ** (limits.field_db / 20.0) - 1.0)
        )

        def slope(objective: _kernel.Objective, reals: FloatArray) -> FloatArray:
            drive, gradient = reals[0::2] + 1j * reals[1::2], np.zeros(2 * space.rank)
            objective.evaluate(as_reals(space.coordinates(drive)), gradient)
            return _alternating(space.drive_gradient(drive, gradient))

        here = _alternating(entry.drive)
        coarse = trial.coarse
        probes = PROBE * np.eye(here.size)
        rise = np.array([slope(coarse, here + p) - slope(coarse, here - p) for p in probes])
        values, vectors = np.linalg.eigh(-(rise + rise.T) / (4.0 * PROBE))
        self._curvature = (vectors * np.maximum(values, 0.0)) @ vectors.T
        self._slope = slope(trial.objective, here)
        turned = self._sparse * np.exp(-1j * np.angle(field))
        # |W| moves by the real part of what a gain adds in the direction of W.
        jacobian = np.stack((turned.real, -turned.imag), axis=1).reshape(here.size, -1)
        gram = jacobian @ jacobian.T / jacobian.shape[1]
        self._metric = (
            self._curvature / (2.0 * limits.ssim)
            + np.outer(self._slope, self._slope) / limits.ssim**2
            + gram * (FIELD_PEAK / max(self._most, 1e-30)) ** 2
        )
        self._weight = self._sparse @ self._sparse.conj().T

    def candidates(self, prediction: IntArray, shifts: Sequence[int]) -> tuple[IntArray, IntArray]:
        """Steps from the prediction, (many, size), and their widths' logarithms, (many, 1).

        A step per target and weight of the bits; standing still is the first of each width.
        """
        levels = LOUDEST * 10.0 ** (np.array(LEVELS_DB) / 20.0)
        wanted = (levels[:, None, None] * PHASES[:, None] * self._drive).reshape(
            -1, self._drive.size
        )
        widths = np.exp2(shifts)[:, None, None]
        targets = (_alternating(wanted) - prediction) / widths
        metrics = self._metric * (widths / FULL_SCALE) ** 2
        near = _nearest_planes(metrics, targets, np.array(BIT_WEIGHTS)).astype(np.int64)
        still = np.zeros((1, prediction.size), dtype=np.int64)
        sets = [_distinct(np.concatenate((still, found))) for found in near]
        return np.concatenate(sets), np.repeat(shifts, [len(own) for own in sets])[:, None]

    def shortlist(self, options: IntArray, bits: IntArray) -> IntArray:
        """Which options the model lets pass, the cheapest first."""
        quiet = np.flatnonzero(~_is_loud(options))
        options, bits = options[quiet], bits[quiet]
        drives = as_drive(options)
        # The common phase is free: turned back, the rest of a difference is what counts.
        turn = np.angle(drives @ (self._weight @ self._drive.conj()))
        away = _alternating(drives * np.exp(-1j * turn)[:, None] - self._drive)
        loss = 0.5 * np.sum(away @ self._curvature * away, axis=1) - away @ self._slope
        promising = np.flatnonzero(loss < 1.5 * self._ssim)
        order = promising[np.lexsort((loss[promising], bits[promising]))]
        chosen: list[int] = []
        for first in range(0, order.size, SHORTLIST):
            some = order[first : first + SHORTLIST]
            error = np.abs(np.abs(drives[some] @ self._sparse) - self._exact).max(axis=1)
            chosen += some[error <= self._most].tolist()
            if len(chosen) >= TRIES:
                break
        return np.asarray(quiet[chosen[:TRIES]])


def _nearest_planes(metrics: FloatArray, targets: FloatArray, weights: FloatArray) -> FloatArray:
    """Whole numbers near targets in metrics, drawn to zero by weights.

    Parameters
    ----------
    metrics
        Shape (metrics, size, size), multiples of one another.
    targets
        Shape (metrics, targets, size).

    Returns
    -------
    FloatArray
        Shape (metrics, weights · targets, size).
    """
    size = metrics.shape[-1]
    totals = metrics[:, None] + (weights[:, None, None] + 1e-6) * np.eye(size)
    pulls = metrics @ np.swapaxes(targets, 1, 2)
    centres = np.swapaxes(np.linalg.solve(totals, pulls[:, None]), 2, 3)
    # The best determined coordinates are rounded last, when they can still make up for the others.
    order = np.argsort(-np.diag(metrics[0]), kind="stable")
    roots = np.swapaxes(np.linalg.cholesky(totals[..., order[:, None], order]), 2, 3)
    wanted, rounded = centres[..., order], np.empty_like(centres)
    for k in range(size - 1, -1, -1):
        left = wanted[..., k + 1 :] - rounded[..., k + 1 :]
        rest = (left @ roots[..., k, k + 1 :, None])[..., 0]
        rounded[..., k] = np.rint(wanted[..., k] + rest / roots[..., k, k, None])
    result = np.empty_like(rounded)
    result[..., order] = rounded
    return result.reshape(len(metrics), -1, size)


@cache
def _moves(size: int) -> IntArray:
    """One step along one or two coordinates, shape (moves, size)."""
    ones = np.eye(size, dtype=np.int64)
    single = np.concatenate((ones, -ones))
    pairs = [a + b for k, a in enumerate(single) for b in single[k + 1 :] if np.any(a + b)]
    return np.concatenate((single, pairs))


def _distinct(rows: IntArray) -> IntArray:
    """Every row once, in the order in which they first appear."""
    seen = dict.fromkeys(map(bytes, np.ascontiguousarray(rows)))
    return np.frombuffer(b"".join(seen), dtype=rows.dtype).reshape(-1, rows.shape[1])


def _sample(scene: Scene, step: int) -> ComplexArray:
    """Fields on every `step`-th image point and at the edges, where they peak: (actuators, n)."""
    fields = scene.fields.values
    rows, columns = (np.union1d(np.arange(0, n, step), n - 1) for n in fields.shape[1:])
    return np.asarray(fields[:, rows][:, :, columns].reshape(len(fields), -1))


def field_errors_db(scene: Scene, exact: ComplexArray, got: ComplexArray) -> FloatArray:
    """Errors of drives (places, actuators) on every `BETWEEN`-th image point each way, dB."""
    seen = _sample(scene, BETWEEN)
    cases = zip(exact, got, strict=True)
    return np.array([_error_db(np.abs(b @ seen), np.abs(a @ seen)) for a, b in cases])


def _error_db(decoded: FloatArray, exact: FloatArray) -> float:
    largest = float(exact.max())
    error = float(np.abs(decoded - exact).max())
    return float(20.0 * np.log10(1.0 + error / largest)) if largest > 0.0 else 0.0
