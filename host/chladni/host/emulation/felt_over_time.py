"""What fingers feel over time of whatever the pins play: from duties to displacement.

A coil's force follows the mean current of each carrier period. What that does under a finger is a
filter, the plate's response with all fingers on it, known at some frequencies and joined by cubic
splines: below a plate's first resonance it is smooth, and near resonances they lie closer. Beyond
the last of them nothing is left of signals that were low-passed at 250 Hz.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.drives.fingers.silence import real_part
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.scorecard import FAR_FINGER
from chladni.drives.scoring.several_fingers.finger_sets import (
    finger_discs,
    finger_sets,
    pushed_back,
)
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.host.emulation.emulator import Recording
from chladni.host.emulation.over_frequency import Plates, Progress, frequencies_of, over_frequency
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.circuit import circuit_of
from chladni.sim.coil.full_drive import strengths
from chladni.sim.errors import MissingError
from chladni.sim.image.finger import PRESS, pressing_stiffness

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

RATE_HZ = 80e6 / 2**14
"""Of displacements: carrier periods' means, 4883 a second."""
FELT_FROM_HZ = 40.0
"""A finger feels little below; a second-order Butterworth high-pass."""
AWAY_PITCH = 6e-3
"""m between places of a second finger: half a fingertip."""
PAD_S = 0.25
"""Of rest before and after, for what rings on."""
ENVELOPE_POINTS = 200
LATEST_S = 2e-3
"""By which a point of an envelope may be late or early, the low-pass's own delay apart."""
LEVEL_PLACES, LEVEL_SEED = 16, 3
TOGETHER = 8
"""Sets of fingers: with more of them a pair takes little less, and the first one waits longer."""
Fingers = tuple[FloatArray, FloatArray | None]
"""Places of those that press, (fingers, 2), m, and of others, (places, 2)."""


@dataclass(frozen=True)
class FingerPlate:
    """A board with fingers on it, as a filter from each coil's force to each finger's disc.

    The plate itself is interpolated, which is smooth; the fingers, which are not (a pulp before its
    bone swings at 70 Hz), are put on it at every frequency.

    Attributes
    ----------
    hz
        At which it was solved, shape (frequencies,).
    free
        For each finger what each coil does at each point of its disc without fingers, complex128,
        shape (frequencies, points, actuators), m/N; then the same of discs on which none presses.
    pushes
        The same of a newton of each finger, shape (frequencies, points, fingers).
    newtons
        How hard each finger presses.
    """

    hz: FloatArray
    free: tuple[ComplexArray, ...]
    pushes: tuple[ComplexArray, ...]
    newtons: float

    @classmethod
    def of(
        cls,
        solved: Sequence[SolvedBoard],
        places: FloatArray,
        newtons: float,
        unpressed: FloatArray | None = None,
    ) -> FingerPlate:
        """Fingers at places (fingers, 2), m, on a board `over_frequency`, pressing with newtons.

        The discs at `unpressed` places (places, 2), m, come after the fingers'.
        """
        return next(cls.of_each(solved, [(places, unpressed)], newtons))

    @classmethod
    def of_each(
        cls, solved: Sequence[SolvedBoard], sets: Sequence[Fingers], newtons: float
    ) -> Iterator[FingerPlate]:
        """The same of each of many sets: their places and unpressed ones.

        `TOGETHER` of them are solved for together: a plate whose feet have a loss of their own is
        factored at each frequency, which takes longer than what follows. With unpressed places they
        go one by one: their discs take hundreds of megabytes.
        """
        hz = frequencies_of(solved)
        count = TOGETHER if all(beside is None for _, beside in sets) else 1
        for first in range(0, len(sets), count):
            found = _discs(solved, sets[first : first + count])
            # One that was given away is not held beside the next ones.
            while found:
                yield cls(hz, *found.pop(0), newtons)

    def level(self, finger: int, reference_hz: float) -> FloatArray:
        """What a finger gets of the loudest real drive at each of `hz`, m/N."""
        hz = self.hz
        pushes = self.pushes[finger].mean(axis=1)
        means = self.free[finger].mean(axis=1) - np.einsum("fj,fja->fa", pushes, self._pushed(hz))
        nearest = int(np.argmin(np.abs(hz - reference_hz)))
        return np.asarray(np.abs(means @ real_part(means[nearest].conj())))

    def _pushed(self, hz: FloatArray) -> ComplexArray:
        """What each finger pushes back with for a newton of each coil; (hz, fingers, actuators)."""
        stiffness = np.array([pressing_stiffness(self.newtons, one) for one in hz.tolist()])
        fingers = self.pushes[0].shape[2]
        free, pushes = (
            [
                scipy.interpolate.CubicSpline(self.hz, own.mean(axis=1))(hz)
                for own in discs[:fingers]
            ]
            for discs in (self.free, self.pushes)
        )
        return pushed_back(free, pushes, stiffness[:, None, None])

    def moved(self, forces: FloatArray, finger: int) -> FloatArray:
        """Displacement of each point of a finger's disc, m, shape (points, times).

        `forces` has newtons at `RATE_HZ`, shape (times, actuators), from rest and to rest.
        """
        return next(self.each_moved(forces, finger))

    def each_moved(self, forces: FloatArray, first: int = 0) -> Iterator[FloatArray]:
        """`moved` of each disc from the first on."""
        pad = round(PAD_S * RATE_HZ)
        begin, end = forces[:1], forces[-1:]
        # Of some lengths a transform takes many times as long as of others.
        count = int(scipy.fft.next_fast_len(len(forces) + 2 * pad, real=True))
        after = np.repeat(end, count - len(forces) - pad, 0)
        padded = np.concatenate((np.repeat(begin, pad, 0), forces, after))
        spectrum = scipy.fft.rfft(padded - begin, axis=0)
        frequencies = np.fft.rfftfreq(count, 1.0 / RATE_HZ)
        is_known = frequencies <= self.hz[-1]
        hz = np.maximum(frequencies[is_known], self.hz[0])
        known = spectrum[is_known]
        back = np.einsum("fja,fa->fj", self._pushed(hz), known)
        # A spline is linear in its values: of all discs' points it is one matrix.
        between = scipy.interpolate.CubicSpline(self.hz, np.eye(len(self.hz)))(hz)
        for free, pushes in zip(self.free[first:], self.pushes[first:], strict=True):
            answer = np.zeros((free.shape[1], len(frequencies)), dtype=np.complex128)
            for values, driven in ((free, known), (pushes, -back)):
                own = np.tensordot(between, values, axes=1)
                answer[:, is_known] += np.einsum("fpa,fa->pf", own, driven)
            yield np.asarray(scipy.fft.irfft(answer, count, axis=1)[:, pad : pad + len(forces)])

    def felt_um(self, forces: FloatArray, finger: int) -> FloatArray:
        """As `moved`, of what moves it above 40 Hz, µm."""
        return felt_of(self.moved(forces, finger)) / MICROMETRE


def fingers_on(
    plates: Plates, sets: Sequence[Fingers], newtons: float
) -> Iterator[tuple[FingerPlate, FingerPlate]]:
    """`FingerPlate.of_each` of both plates; the same one twice where none is hidden."""
    known = FingerPlate.of_each(plates.known, sets, newtons)
    there = plates.below and FingerPlate.of_each(plates.below, sets, newtons)
    for _ in sets:
        yield (own := next(known)), next(there) if there else own
        del own  # not held beside the next one


def felt_of(moved: FloatArray) -> FloatArray:
    """What moves above 40 Hz of anything at `RATE_HZ`, shape (…, times)."""
    sections = scipy.signal.butter(2, FELT_FROM_HZ, "highpass", fs=RATE_HZ, output="sos")
    return np.asarray(scipy.signal.sosfilt(sections, moved, axis=-1))


def _discs(
    solved: Sequence[SolvedBoard], sets: Sequence[Fingers]
) -> list[tuple[tuple[ComplexArray, ...], tuple[ComplexArray, ...]]]:
    """`free` and `pushes` of the `FingerPlate` of each set."""
    of_set = np.repeat(range(len(sets)), [len(places) for places, _ in sets])
    targets = [(x / MM, y / MM) for places, _ in sets for x, y in places.tolist()]
    masks = [
        finger_discs(solved[0].board, np.concatenate([own for own in one if own is not None]))
        for one in sets
    ]
    pushes: list[list[list[ComplexArray]]] = [[[] for _ in own] for own in masks]
    for own in solved:
        answers = own.under_finger(targets)
        for k, discs in enumerate(pushes):
            mine = answers[of_set == k]
            for kept, mask in zip(discs, masks[k], strict=True):
                kept.append(mine[:, mask].T)
    free = [
        tuple(np.stack([one.fields.values[:, mask].T for one in solved]) for mask in own)
        for own in masks
    ]
    return [(own, tuple(map(np.stack, discs))) for own, discs in zip(free, pushes, strict=True)]


def rms(felt: FloatArray) -> FloatArray:
    """Over a disc's points, of shape (points, times); shape (times,)."""
    return np.asarray(np.sqrt((felt**2).mean(axis=0)))


def places_away(board: Board, at_mm: tuple[float, float]) -> FloatArray | None:
    """Where a second finger may lie, m, shape (places, 2): all over the plate, as scores look."""
    axes = [
        np.linspace(-0.5, 0.5, max(1, round(side / AWAY_PITCH)) + 1) * side
        for side in board.plate.size
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    apart = np.hypot(*(places - np.array(at_mm) * MM).T)
    far = places[apart >= FAR_FINGER]
    return far if len(far) else None


def loudest_away(
    plate: FingerPlate, forces: FloatArray, away: FloatArray, first: int
) -> tuple[FloatArray, FloatArray]:
    """The place of a plate's unpressed ones, `away`, that moves most, and its RMS over time, µm.

    `first`: of the times, from which on it counts.
    """
    found, most = away[0], np.zeros(1)
    fingers = plate.pushes[0].shape[2]
    for place, moved in zip(away, plate.each_moved(forces, fingers), strict=True):
        own = rms(felt_of(moved)[:, first:]) / MICROMETRE
        if own.max() > most.max():
            found, most = place, own
    return found, most


def forces_of(board: Board, recording: Recording) -> FloatArray:
    """Newtons of each coil by the mean currents of carrier periods, shape (times, actuators).

    At `RATE_HZ`.

    Raises
    ------
    MissingError
        The board has no coil.
    """
    circuit = circuit_of(board)
    if circuit is None or board.coil is None:
        raise MissingError("coil", "a block [coil]", hint="there is no force without one")
    currents = circuit.mean_current(recording.duty)
    periods = round(recording.carrier_hz / RATE_HZ)
    whole = len(currents) // periods * periods
    means = currents[:whole].reshape(-1, periods, currents.shape[1]).mean(axis=1)
    return np.asarray(board.coil.force_factor * means * strengths(board))


def aligned(
    asked: FloatArray, sent: FloatArray, forces: FloatArray, latest_s: float
) -> tuple[FloatArray, slice]:
    """What a finger would feel of the asked samples, and when an answer to them lasts.

    At `RATE_HZ`, as late as coils get them, on a plate that does just that. `sent` is what the
    device makes of them, found in steps of forces, as those have no bias. A plate's answer may
    begin earlier or later by its phase, and the first duty comes late: an effect begins softly.
    """
    count = len(forces)
    shape, steps = np.diff(_at_rate(sent, count), append=0.0), np.diff(forces, axis=0, append=0.0)
    most = min(round(latest_s * RATE_HZ), count - 1)
    late = [float(np.linalg.norm(shape[: count - k] @ steps[k:])) for k in range(most + 1)]
    begin = int(np.argmax(late))
    lasts = round((len(asked) / SIGNAL_HZ + LATEST_S) * RATE_HZ)
    moved = np.concatenate((np.zeros(begin), _at_rate(asked, count)[: count - begin]))
    return felt_of(moved), slice(begin, min(begin + lasts, count))


def _at_rate(samples: FloatArray, count: int) -> FloatArray:
    """Samples at `RATE_HZ`, with zeros after them, shape (count,)."""
    times, own = np.arange(count) / RATE_HZ, np.arange(len(samples)) / SIGNAL_HZ
    return np.asarray(np.interp(times, own, samples, right=0.0))


def common_level(
    board: Board,
    *,
    solved: Sequence[SolvedBoard] | None = None,
    progress: Progress | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Hz, and the median over drawn places of the level under a pressing finger, 1 at the drive's.

    Parameters
    ----------
    solved
        The board `over_frequency`, if it is at hand.
    """
    solved = over_frequency(board, progress) if solved is None else solved
    rng = np.random.default_rng(LEVEL_SEED)
    places = finger_sets(board, 2, LEVEL_PLACES // 2, board.fingers_apart, rng).reshape(-1, 2)
    hz, own = frequencies_of(solved), board.drive.frequency_hz
    levels = []
    for plate in FingerPlate.of_each(solved, [(place[None], None) for place in places], PRESS):
        level = plate.level(0, own)
        levels.append(level / np.interp(own, hz, level))
    return hz, np.asarray(np.median(levels, axis=0))


def envelope_error_db(asked: FloatArray, played: FloatArray) -> float:
    """How far a played envelope is from the asked one, dB: 95th percentile of 200 points.

    Points are drawn where the asked one is within 20 dB of its largest, and both have one median
    there. Each takes the nearest that was played within 2 ms.
    """
    wanted, found = _envelope(asked), _envelope(played)
    is_loud = wanted >= 0.1 * wanted.max()
    scale = float(np.median(found[is_loud] / wanted[is_loud]))
    at = np.flatnonzero(is_loud)
    at = at[np.linspace(0, len(at) - 1, ENVELOPE_POINTS).round().astype(int)]
    reach = round(LATEST_S * RATE_HZ)
    errors = []
    for k in at:
        near = found[max(0, k - reach) : k + reach + 1] / (scale * wanted[k])
        errors.append(float(np.abs(20.0 * np.log10(np.maximum(near, 1e-6))).min()))
    return float(np.percentile(errors, 95.0))


def _envelope(wave: FloatArray) -> FloatArray:
    """Of what oscillates: the magnitude of the analytic signal."""
    return np.asarray(np.abs(scipy.signal.hilbert(wave)))
