"""What fingers feel over time of whatever the pins play: from duties to displacement.

A coil's force follows the mean current of each carrier period. What that does under a finger is a
filter, the plate's response with all fingers on it, known at some frequencies and joined by cubic
splines: below a plate's first resonance it is smooth, and near resonances they lie closer. Beyond
the last of them nothing is left of signals that were low-passed at 250 Hz.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.drives.fingers.silence import real_part
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.scorecard import FAR_FINGER
from chladni.drives.scoring.several_fingers.finger_sets import finger_discs, pushed_back
from chladni.effects.low_pass import EDGE_HZ
from chladni.host.emulation.emulator import Recording
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.circuit import circuit_of
from chladni.sim.coil.full_drive import strengths
from chladni.sim.errors import MissingError
from chladni.sim.fields.driven import moved_coils
from chladni.sim.image.finger import pressing_stiffness

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

RATE_HZ = 80e6 / 2**14
"""Of displacements: carrier periods' means, 4883 a second."""
GRID_HZ = (2.0, *np.arange(15.0, 315.0, 15.0).tolist(), 330.0, 360.0, 400.0, 450.0, 520.0, 600.0)
"""Frequencies at which every plate is solved. On `strip5` responses between them are right within
0.2 % up to 280 Hz, and within 2 % where they are 25 Hz apart."""
ROUGH, FINEST_HZ = 0.1, 2.0
"""Share by which splines without a frequency may miss it before both intervals beside it are
halved, and how wide one is at least. With it they miss what lies between by a tenth of that. Above
250 Hz four times as much an octave, for half of what the low-pass takes in decibels."""
BESIDE = 4
"""Frequencies on either side, of which a spline is to meet one."""
FELT_FROM_HZ = 40.0
"""A finger feels little below; a second-order Butterworth high-pass."""
AWAY_PITCH = 6e-3
"""m between places of a second finger: half a fingertip."""
PAD_S = 0.25
"""Of rest before and after, for what rings on."""
ENVELOPE_POINTS = 200
LATEST_S = 2e-3
"""By which a point of an envelope may be late or early, the low-pass's own delay apart."""
Progress = Callable[[int, int], None]


def over_frequency(board: Board, progress: Progress | None = None) -> list[SolvedBoard]:
    """A board solved at `GRID_HZ`, and closer where it resonates, for any number of `FingerPlate`s.

    In the order of their frequencies.
    """
    solved = solved_board(board)
    found: dict[float, SolvedBoard] = {}
    wanted = list(GRID_HZ)
    while wanted:
        count = len(found) + len(wanted)
        for hz in wanted:
            found[hz] = solved.at_frequency(hz)
            if progress is not None:
                progress(len(found), count)
        wanted = _between(found)
    return [found[hz] for hz in sorted(found)]


def plates_over_frequency(
    board: Board, hidden: Board | None, progress: Progress
) -> tuple[list[SolvedBoard], list[SolvedBoard] | None]:
    """A board `over_frequency`, and the hidden plate that fingers are on: one progress of both."""
    if hidden is None:
        return over_frequency(board, progress), None
    progress(0, 2 * len(GRID_HZ))
    # It takes up to three times as long. Estimates that begin with it become shorter.
    solved = over_frequency(hidden, lambda done, count: progress(done, count + len(GRID_HZ)))
    first = len(solved)
    own = over_frequency(board, lambda done, count: progress(first + done, first + count))
    return own, solved


def frequencies_of(solved: Sequence[SolvedBoard]) -> FloatArray:
    """Hz at which a board was solved."""
    return np.array([own.board.drive.frequency_hz for own in solved])


def _between(found: dict[float, SolvedBoard]) -> list[float]:
    """Middles of intervals beside a frequency that a spline of the others misses."""
    hz = np.array(sorted(found))
    solved = [found[own] for own in hz.tolist()]
    # What each coil does at each: a few of all places.
    values = np.array([moved_coils(own.board, np.asarray(own.fields.values)) for own in solved])
    middles = set()
    for k in range(1, len(hz) - 1):
        near = [i for i in range(max(0, k - BESIDE), min(len(hz), k + BESIDE + 1)) if i != k]
        off = np.abs(scipy.interpolate.CubicSpline(hz[near], values[near])(hz[k]) - values[k]).max()
        if off > ROUGH * max(1.0, hz[k] / EDGE_HZ) ** 2 * np.abs(values[k]).max():
            beside = ((hz[k - 1], hz[k]), (hz[k], hz[k + 1]))
            middles |= {(a + b) / 2.0 for a, b in beside if b - a > 2.0 * FINEST_HZ}
    return sorted(middles)


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
        return cls(frequencies_of(solved), *_discs(solved, places, unpressed), newtons)

    @classmethod
    def each_alone(
        cls, solved: Sequence[SolvedBoard], places: FloatArray, newtons: float
    ) -> list[FingerPlate]:
        """The same with one finger each, all solved for together."""
        hz = frequencies_of(solved)
        return [
            cls(hz, (free,), (pushes[:, :, finger, None],), newtons)
            for finger, (free, pushes) in enumerate(zip(*_discs(solved, places, None), strict=True))
        ]

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


def felt_of(moved: FloatArray) -> FloatArray:
    """What moves above 40 Hz of anything at `RATE_HZ`, shape (…, times)."""
    sections = scipy.signal.butter(2, FELT_FROM_HZ, "highpass", fs=RATE_HZ, output="sos")
    return np.asarray(scipy.signal.sosfilt(sections, moved, axis=-1))


def _discs(
    solved: Sequence[SolvedBoard], places: FloatArray, unpressed: FloatArray | None
) -> tuple[tuple[ComplexArray, ...], tuple[ComplexArray, ...]]:
    """`free` and `pushes` of a `FingerPlate` with fingers at places (fingers, 2), m."""
    every = places if unpressed is None else np.concatenate((places, unpressed))
    masks = finger_discs(solved[0].board, every)
    targets = [(x / MM, y / MM) for x, y in places.tolist()]
    free: list[list[ComplexArray]] = [[] for _ in masks]
    pushes: list[list[ComplexArray]] = [[] for _ in masks]
    for own in solved:
        answers = own.under_finger(targets)
        for finger, mask in enumerate(masks):
            free[finger].append(own.fields.values[:, mask].T)
            pushes[finger].append(answers[:, mask].T)
    return tuple(map(np.stack, free)), tuple(map(np.stack, pushes))


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
