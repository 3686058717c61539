"""How well a board keeps several fingers apart: drawn sets of them, all pressing, all voices on.

Every finger of a set has a drive of its own that knows the board as drawn, or comes from a device.
What each finger then gets of its own signal and of the others' is found with the plate solved again
under the fingers (finger_sets.py), on the board as drawn and on boards within its tolerances.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers import KnownPlate, responses_at
from chladni.drives.fingers.choice import chosen_drives
from chladni.drives.fingers.coupling import LEAST_APART
from chladni.drives.fingers.silence import (
    MOST_FINGERS,
    REGULARISATION,
    drives_for,
)
from chladni.drives.methods import SEED, Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.as_built import PRESS
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.finger_sets import FingerSet, finger_sets
from chladni.drives.scoring.progress_steps import StepCounter
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import SAMPLES
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE, drawn_boards
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.errors import ArgumentError
from chladni.sim.image.finger import pressing_stiffness, threshold_um

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Solve = Callable[[FloatArray], ComplexArray]

SETS = 200
"""Of each number of fingers: the worst tenth is then known to 2 dB."""
MOST_SETS = 100_000
EXPECTED_TO_REAL = 0.25
"""Of a threshold, that a share may have by the plate as it is known: on the plate itself shares
come out up to 12 dB larger, by what one finger does to another and by tolerances."""
PRESSING_THRESHOLD_DB = 15.0
"""By which a pressing finger's threshold lies below that of a resting one: about the middle of the
10 to 30 dB of S. Papetti and others (IEEE Trans. Haptics 10, 2017, 113-122)."""


@dataclass(frozen=True)
class KeptApart:
    """What fingers of drawn sets get; each finger of each set counts once, p10 is the bad tail.

    Attributes
    ----------
    isolation_db
        RMS over the finger's disc of its own signal, over the largest RMS of that signal in another
        finger's disc.
    level_db
        Its own signal against the loudest that the coils' limits allow at that place.
    finger_um
        Peak of its own signal with all voices on, limits kept for their sum; None without a coil.
    unfelt
        Share of fingers under which each other finger's signal stays below what a resting finger
        feels (RMS over the disc, peak in time); None without a coil, or outside 40 to 800 Hz.
    unfelt_pressing
        The same 15 dB below that.
    """

    isolation_db: Spread
    level_db: Spread
    finger_um: Spread | None
    unfelt: float | None
    unfelt_pressing: float | None


@dataclass(frozen=True)
class PerturbedFingers(KeptApart):
    """The same drives on boards that are all off at once (tolerances.py)."""

    samples: int
    seed: int


@dataclass(frozen=True)
class CountScore(KeptApart):
    """Of one number of fingers.

    Attributes
    ----------
    rows
        isolation_db, level_db, finger_um and the others' largest share in µm, shape
        (sets · fingers, 4), for figures.
    """

    fingers: int
    sets: int
    perturbed: PerturbedFingers | None
    rows: FloatArray
    perturbed_rows: FloatArray | None


@dataclass(frozen=True)
class FingersScore:
    """Of each number of fingers that the board has room for."""

    apart_mm: float
    newtons: float
    counts: tuple[CountScore, ...]
    seconds: float


def score_fingers(
    board: Board,
    counts: Sequence[int] = (2, 3, 4, 5),
    *,
    apart: float = LEAST_APART,
    sets: int = SETS,
    regularisation: float | None = None,
    newtons: float = PRESS,
    beside: float = 0.0,
    samples: int = SAMPLES,
    seed: int = SEED,
    plate: KnownPlate | None = None,
    solve: Solve | None = None,
    progress: Progress | None = None,
) -> FingersScore:
    """Score a board with several fingers on it.

    Parameters
    ----------
    counts
        Numbers of fingers, 2 to 5.
    apart
        Least distance between two middles, m.
    sets
        Drawn of each number.
    regularisation
        λ of all drives (silence.py); chosen for each finger if left out (choice.py).
    newtons
        How hard every finger presses; drives reckon with 1 N whatever it is.
    beside
        How far each finger lies from where its drive has it, in a direction of its own, m.
    samples
        Boards drawn within the tolerances, the sets shared out among them; 0 leaves them out.
    plate
        What drives are found from; the board's own responses if left out.
    solve
        Finds drives in another way, and needs neither plate nor λ: of fingers at (fingers, 2), m,
        drives of shape (fingers, actuators), of any common scale.
    progress
        Called with (done, all) of the sets.

    Raises
    ------
    ArgumentError
        A number of fingers is not 2 to 5, or the board has no room for the first of them.
    """
    started = time.perf_counter()
    for count in counts:
        if not 2 <= count <= MOST_FINGERS:
            raise ArgumentError("fingers", count, f"2 to {MOST_FINGERS}")
    solved = solved_board(board)
    if solve is None:
        with one_blas_thread():
            known = responses_at(solved) if plate is None else plate
        solve = _solver(board, known, regularisation)
    places = _drawn_sets(board, counts, sets, apart, seed)
    counter = StepCounter(progress, sum(map(len, places)) * (3 if samples else 2))
    drives = [_found(solve, group, counter) for group in places]
    places = [_moved(board, group, beside, seed) for group in places]
    stiffness = pressing_stiffness(newtons, board.drive.frequency_hz)
    with one_blas_thread():
        rows = [
            _nominal(solved, group, own, stiffness, counter)
            for group, own in zip(places, drives, strict=True)
        ]
        off = _perturbed(board, places, drives, stiffness, samples, seed, counter)
    found = tuple(
        CountScore(
            **vars(_kept(board, own)),
            fingers=group.shape[1],
            sets=len(group),
            perturbed=None
            if others is None
            else PerturbedFingers(**vars(_kept(board, others)), samples=samples, seed=seed),
            rows=own,
            perturbed_rows=others,
        )
        for group, own, others in zip(places, rows, off, strict=True)
    )
    return FingersScore(apart / MM, newtons, found, time.perf_counter() - started)


def most_newtons(board: Board, drives: ComplexArray) -> float | None:
    """Newtons for each unit of drives (drives, actuators) that are on at once; None without a coil.

    Amplitudes of one coil are added as if all were in phase: that keeps every limit whatever the
    signals are.
    """
    sums = np.abs(drives).sum(axis=0).astype(np.complex128)
    full = full_drive(board, sums, board.drive.frequency_hz)
    return None if full is None else full.newtons / float(sums.real.max())


def _solver(board: Board, plate: KnownPlate, regularisation: float | None) -> Solve:
    stiffness = pressing_stiffness(PRESS, board.drive.frequency_hz)
    threshold = threshold_um(board.drive.frequency_hz)
    fixed = REGULARISATION if regularisation is None else regularisation

    def solve(places: FloatArray) -> ComplexArray:
        fingers = places.tolist()
        first = drives_for(plate, fingers, stiffness=stiffness, regularisation=fixed).drives
        newtons = most_newtons(board, first)
        if regularisation is not None or threshold is None or newtons is None:
            return first
        felt = np.full(len(fingers), threshold * MICROMETRE * EXPECTED_TO_REAL)
        levels = np.full(len(fingers), newtons)
        return chosen_drives(
            plate, fingers, thresholds=felt.tolist(), levels=levels.tolist(), stiffness=stiffness
        ).found.drives

    return solve


def _found(solve: Solve, places: FloatArray, counter: StepCounter) -> list[ComplexArray]:
    drives = []
    for own in places:
        drives.append(solve(own))
        counter.step()
    return drives


def _moved(board: Board, places: FloatArray, beside: float, seed: int) -> FloatArray:
    """Places of fingers that lie `beside` them, m, on the board."""
    turns = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, places.shape[:-1])
    half = np.array(board.plate.size) / 2.0
    moved = places + beside * np.stack((np.cos(turns), np.sin(turns)), axis=-1)
    return np.asarray(np.clip(moved, -half, half))


def _drawn_sets(
    board: Board, counts: Sequence[int], sets: int, apart: float, seed: int
) -> list[FloatArray]:
    """Sets of each number of fingers that there is room for; the first must have it."""
    found: list[FloatArray] = []
    for count in counts:
        try:
            found.append(finger_sets(board, count, sets, apart, np.random.default_rng(seed)))
        except ArgumentError:
            if not found:
                raise
    return found


def _nominal(
    solved: SolvedBoard,
    places: FloatArray,
    drives: Sequence[ComplexArray],
    stiffness: complex,
    counter: StepCounter,
) -> FloatArray:
    rows = []
    for own, known in zip(FingerSet.of_all(solved, places, stiffness), drives, strict=True):
        rows.append(_rows(solved.board, own, known, np.ones(known.shape[1])))
        counter.step()
    return np.concatenate(rows)


def _perturbed(
    board: Board,
    places: Sequence[FloatArray],
    drives: Sequence[Sequence[ComplexArray]],
    stiffness: complex,
    samples: int,
    seed: int,
    counter: StepCounter,
) -> list[FloatArray | None]:
    """Rows of the same sets, each on one of the drawn boards."""
    if not samples:
        return [None] * len(places)
    rows: list[list[FloatArray]] = [[] for _ in places]
    for number, drawn in enumerate(drawn_boards(board, samples, seed)):
        solved = SolvedBoard.of(drawn.board, DRAWN_TOLERANCE)
        for own, group, known in zip(rows, places, drives, strict=True):
            mine = range(number, len(group), samples)
            found = FingerSet.of_all(solved, group[number::samples], stiffness)
            for k, fingers in zip(mine, found, strict=True):
                own.append(_rows(board, fingers, known[k], drawn.forces))
                counter.step()
    return [np.concatenate(own) for own in rows]


def _rows(board: Board, fingers: FingerSet, drives: ComplexArray, forces: FloatArray) -> FloatArray:
    """Isolation (dB), level (dB), own µm, and the largest share of another's signal (µm)."""
    newtons = most_newtons(board, drives)
    unit = np.nan if newtons is None else newtons / MICROMETRE
    played = drives * forces
    shares = fingers.shares(played)
    strangers = np.where(np.eye(len(drives), dtype=bool), 0.0, shares).max(axis=0)
    own = np.abs(np.diag(fingers.means(played)))
    return np.stack(
        (
            fingers.isolation_db(played),
            20.0 * np.log10(np.maximum(own * (newtons or 1.0), 1e-300) / _loudest(board, fingers)),
            own * unit,
            strangers * unit,
        ),
        axis=1,
    )


def _loudest(board: Board, fingers: FingerSet) -> FloatArray:
    """The most that any drive's own displacement is under each finger at the coils' limits, m.

    By two drives: all coils full and in phase there, and each in proportion to what it does, which
    draws least. Without a coil one newton is the most.
    """
    means = np.stack([disc.mean(axis=0) for disc in fingers.discs])
    most = np.zeros(len(means))
    for sizes in (np.ones(means.shape), np.abs(means)):
        for k, size in enumerate(sizes):
            drive = size / max(float(size.max()), 1e-300)
            newtons = most_newtons(board, drive[None].astype(np.complex128))
            moved = float((np.abs(means[k]) * drive).sum()) * (1.0 if newtons is None else newtons)
            most[k] = max(most[k], moved)
    return np.maximum(most, 1e-300)


def _kept(board: Board, rows: FloatArray) -> KeptApart:
    threshold = threshold_um(board.drive.frequency_hz)
    has_coil = bool(np.all(np.isfinite(rows[:, 2])))
    can_tell = has_coil and threshold is not None
    limit = threshold or 0.0
    pressing = limit * 10.0 ** (-PRESSING_THRESHOLD_DB / 20.0)
    return KeptApart(
        isolation_db=Spread.of(rows[:, 0].tolist()),
        level_db=Spread.of(rows[:, 1].tolist()),
        finger_um=Spread.of(rows[:, 2].tolist()) if has_coil else None,
        unfelt=float(np.mean(rows[:, 3] < limit)) if can_tell else None,
        unfelt_pressing=float(np.mean(rows[:, 3] < pressing)) if can_tell else None,
    )
