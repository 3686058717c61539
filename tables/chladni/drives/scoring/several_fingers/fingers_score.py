"""How well a board keeps several fingers apart: drawn sets of them, all pressing, all voices on.

Every finger of a set has a drive of its own that knows the board as drawn, or comes from a device.
What each finger then gets of its own signal and of the others' is found with the plate solved again
under the fingers (finger_sets.py), on the board as drawn and on boards within its tolerances.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers import KnownPlate, responses_at
from chladni.drives.fingers.choice import chosen_drives
from chladni.drives.fingers.silence import (
    MOST_FINGERS,
    REGULARISATION,
    drives_for,
)
from chladni.drives.methods import SEED, Progress
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.kept_focus import CLICK_HZ, CLICK_PEAK
from chladni.drives.scoring.progress_steps import StepCounter
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet, finger_sets
from chladni.drives.scoring.several_fingers.kept_apart import (
    KeptApart,
    kept_apart,
    most_newtons,
    rows_of,
)
from chladni.drives.scoring.survey import SAMPLES
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE, Drawn, drawn_boards
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_newtons
from chladni.sim.errors import ArgumentError
from chladni.sim.image.finger import PRESS, pressing_stiffness, threshold_um

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Solve = Callable[[FloatArray], ComplexArray]

SETS = 200
"""Of each number of fingers: the worst tenth is then known to 2 dB."""
MOST_SETS = 100_000
EXPECTED_TO_REAL = 0.25
"""Of a threshold, that a share may have by the plate as it is known: on the plate itself shares
come out up to 12 dB larger, by what one finger does to another and by tolerances."""


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
    places, drives
        Of the sets, for figures: m, shape (sets, fingers, 2), and shape (sets, fingers, actuators).
    rows
        isolation_db, level_db, finger_um and the others' largest share in µm, shape
        (sets · fingers, 4), a set's fingers one after the other; for figures.
    """

    fingers: int
    sets: int
    perturbed: PerturbedFingers | None
    places: FloatArray
    drives: ComplexArray
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
    apart: float | None = None,
    sets: int = SETS,
    regularisation: float | None = None,
    newtons: float = PRESS,
    beside: float = 0.0,
    samples: int = SAMPLES,
    seed: int = SEED,
    plate: KnownPlate | None = None,
    solve: Solve | None = None,
    clicks: bool = False,
    on: Drawn | None = None,
    progress: Progress | None = None,
) -> FingersScore:
    """Score a board with several fingers on it.

    Parameters
    ----------
    counts
        Numbers of fingers, 1 to 5. One alone has no other to be kept from: its isolation is 300 dB.
    apart
        Least distance between two middles, m; the board's own if left out.
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
        Finds the tones' drives in another way, and needs neither plate nor λ: of fingers at
        (fingers, 2), m, drives of shape (fingers, actuators), of any common scale.
    clicks
        Tell what a click keeps, too (`CLICK_HZ`), by drives of the plate with real gains.
    on
        The board that there is, of which drives know nothing; `board` itself if left out. Takes
        `samples` of 0.
    progress
        Called with (done, all) of the sets.

    Raises
    ------
    ArgumentError
        A number of fingers is not 1 to 5, or the board has no room for the first of them.
    """
    started = time.perf_counter()
    for count in counts:
        if not 1 <= count <= MOST_FINGERS:
            raise ArgumentError("fingers", count, f"1 to {MOST_FINGERS}")
    apart = board.fingers_apart if apart is None else apart
    solved = solved_board(board)
    with one_blas_thread():
        known = responses_at(solved) if plate is None else plate
    solve = solve or solver_of(board, known, regularisation)
    of_clicks = solver_of(board, known, regularisation, real=True) if clicks else None
    groups = drawn_sets(board, counts, sets, apart, seed)
    steps = sum(map(len, groups)) * (3 if samples else 2)
    counter = StepCounter(progress, 2 * steps if clicks else steps)
    drawn = [
        _Drawn(
            _moved(board, group, beside, seed),
            found_drives(solve, group, counter),
            found_drives(of_clicks, group, counter) if of_clicks else [],
        )
        for group in groups
    ]
    everything, forces = slice(None), np.ones(len(board.actuators))
    if on is not None:
        solved, forces = solved_board(on.board), on.forces
    with one_blas_thread():
        found = [_got(board, solved, own, everything, forces, newtons, counter) for own in drawn]
        off = _perturbed(board, drawn, newtons, samples, seed, counter)
    scores = tuple(
        CountScore(
            **vars(kept_apart(board, own.rows, own.clicks)),
            fingers=one.places.shape[1],
            sets=len(one.places),
            perturbed=None
            if others is None
            else PerturbedFingers(
                **vars(kept_apart(board, others.rows, others.clicks)),
                samples=samples,
                seed=seed,
            ),
            places=one.places,
            drives=np.stack(one.drives),
            rows=own.rows,
            perturbed_rows=None if others is None else others.rows,
        )
        for one, own, others in zip(drawn, found, off, strict=True)
    )
    return FingersScore(apart / MM, newtons, scores, time.perf_counter() - started)


def solver_of(
    board: Board, plate: KnownPlate, regularisation: float | None, *, real: bool = False
) -> Solve:
    """What finds a set's drives from a plate as it is known; λ as of `score_fingers`.

    With `real` gains, for signals that are no tones. Each finger chooses λ as on a device, which
    does not know who plays: as if it had all that coils can push to itself.
    """
    stiffness = pressing_stiffness(PRESS, board.drive.frequency_hz)
    threshold = threshold_um(board.drive.frequency_hz)
    newtons = full_newtons(board, board.drive.frequency_hz)
    fixed = REGULARISATION if regularisation is None else regularisation

    def solve(places: FloatArray) -> ComplexArray:
        fingers = places.tolist()
        how: dict[str, Any] = {"stiffness": stiffness, "real": real}
        if regularisation is not None or threshold is None or newtons is None:
            return drives_for(plate, fingers, regularisation=fixed, **how).drives
        felt = np.full(len(fingers), threshold * MICROMETRE * EXPECTED_TO_REAL)
        levels = np.full(len(fingers), newtons)
        return chosen_drives(
            plate, fingers, thresholds=felt.tolist(), levels=levels.tolist(), **how
        ).found.drives

    return solve


def found_drives(solve: Solve, places: FloatArray, counter: StepCounter) -> list[ComplexArray]:
    """Drives of sets of places (sets, fingers, 2), m."""
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


def drawn_sets(
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


@dataclass(frozen=True)
class _Drawn:
    """Where sets of one number of fingers lie, m, and what each plays: a tone, or a click.

    `of_clicks` is empty where those are not asked for.
    """

    places: FloatArray
    drives: list[ComplexArray]
    of_clicks: list[ComplexArray]


@dataclass(frozen=True)
class _Got:
    """What fingers of some sets have of their tones (rows_of), and of clicks, dB and µm."""

    rows: FloatArray
    clicks: FloatArray | None

    @classmethod
    def joined(cls, parts: Sequence[_Got]) -> _Got:
        clicks = [own.clicks for own in parts if own.clicks is not None]
        rows = np.concatenate([own.rows for own in parts])
        return cls(rows, np.concatenate(clicks) if clicks else None)


def _got(
    board: Board,
    solved: SolvedBoard,
    drawn: _Drawn,
    which: slice,
    forces: FloatArray,
    newtons: float,
    counter: StepCounter,
) -> _Got:
    """Of some of the sets on a plate with coils of some forces."""
    places, rows, um = drawn.places[which], [], []
    of_clicks = drawn.of_clicks[which]
    sets = FingerSet.of_all(solved, places, _stiffness(solved, newtons))
    for number, (fingers, known) in enumerate(zip(sets, drawn.drives[which], strict=True)):
        rows.append(rows_of(board, fingers, known, forces))
        um += _click_um(board, fingers, of_clicks[number], forces) if of_clicks else []
        counter.step()
    if not of_clicks or places.shape[1] == 1:  # alone
        return _Got(np.concatenate(rows), None)
    solved = solved.at_frequency(CLICK_HZ)
    sets, kept = FingerSet.of_all(solved, places, _stiffness(solved, newtons)), []
    for fingers, known in zip(sets, of_clicks, strict=True):
        kept.append(fingers.isolation_db(known * forces))
        counter.step()
    return _Got(np.concatenate(rows), np.stack((np.concatenate(kept), um), axis=1))


def _click_um(
    board: Board, fingers: FingerSet, drives: ComplexArray, forces: FloatArray
) -> list[float]:
    """Peak of each finger's click where the others rest; NaN without a coil."""
    own = np.abs(np.diag(fingers.means(drives * forces))) * CLICK_PEAK / MICROMETRE
    most = [most_newtons(board, drive[None]) for drive in drives]
    return [float(um * (np.nan if one is None else one)) for um, one in zip(own, most, strict=True)]


def _stiffness(solved: SolvedBoard, newtons: float) -> complex:
    return pressing_stiffness(newtons, solved.board.drive.frequency_hz)


def _perturbed(
    board: Board,
    drawn: Sequence[_Drawn],
    newtons: float,
    samples: int,
    seed: int,
    counter: StepCounter,
) -> list[_Got | None]:
    """The same sets, each on one of the random boards."""
    if not samples:
        return [None] * len(drawn)
    found: list[list[_Got]] = [[] for _ in drawn]
    for number, other in enumerate(drawn_boards(board, samples, seed)):
        solved = SolvedBoard.of(other.board, DRAWN_TOLERANCE)
        which = slice(number, None, samples)
        for own, group in zip(found, drawn, strict=True):
            if len(group.places[which]):
                own.append(_got(board, solved, group, which, other.forces, newtons, counter))
    return [_Got.joined(own) for own in found]
