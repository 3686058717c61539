"""A focus for a hand: quiet beside the finger, as silent as can be from the next fingertip on.

With g the forces of the coils per metre that the finger moves, m the row that takes the mean of W
under the finger's disc, and R_j the form of the mean |W|² over another disc of that radius,

    minimise t   subject to   m·g = 1,
                              gᴴR_j g ≤ t²                    discs `silent_from` or more away,
                              gᴴR_j g ≤ 10^(−quieter_db/10)   discs from `quieter_from` to there,
                              |gₙ| ≤ F/floor                  F the most a coil can push,

which is convex: the drive's common phase is free, so the mean may be asked to be real. The mean
under the finger is at most its RMS there (Cauchy and Schwarz), so the second finger of a scorecard,
RMS over RMS, comes out as good or better. The finger moves by `floor` or more once the loudest coil
is at its limit. Norms under linear constraints: Lebret and Boyd, "Antenna array pattern synthesis
via convex optimization", IEEE Trans. Signal Process. 45 (1997), 526-532.

Discs are taken into the problem as they come to be too loud (cutting planes: Kelley, J. SIAM 8,
1960, 703-712), until the loudest of all is within `GAP_DB` of what the multipliers prove.

Where not all of it can be had, silence gives way first, then the margin, then the floor. Silence
has no level that it must reach. The margin becomes the largest that a drive can have over every
disc from `quieter_from` on, far ones among them. A drive with that margin leaves nothing for
silence, so a board may have `reserve_db` of it kept back: the margin then is at most the largest
less that, but no less than `reserve_db` itself where there is so much. The floor becomes `SHARE` of
the most that all coils together can do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.base import Found, Options
from chladni.drives.methods.minimax import SILENT, Minimum, minimax
from chladni.drives.problem.problem import Problem, SolvedBoard
from chladni.drives.problem.second_fingers import SecondFingers
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import Focus
from chladni.sim.coil.full_drive import full_drive, untrimmed

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IndexArray = NDArray[np.intp]
Place = tuple[float, float]

GAP_DB = 0.05
"""Between the drive and its bound, at most: a fortieth of what a finger tells apart."""
INNER = 2e-3
"""Relative gap of a problem of few discs: 0.01 dB."""
FIRST_GAP = 2e-2
"""The same in the first round."""
ROUNDS = 16
"""Of taking discs in; usual are 3 to 6."""
FIRST = 23
"""A problem begins with every 23rd disc, about 5 mm apart."""
APART = 3e-3
"""m; of discs that are too loud, those taken in at once are so far apart: one a maximum."""
TOGETHER = 12
"""At most so many are taken in at once: further ones go when these do."""
ENOUGH = 0.95
"""Share of the margin's level to which a start is brought: 0.2 dB of room for the next search."""
GIVEN_WAY = 1.01
"""The largest margin there is, less 0.04 dB for a search of the drive with most silence."""
SHARE = 0.8
"""Of the most displacement that the coils can make at a place: 2 dB less, which a finger hardly
tells apart (2.3 dB), leave the phases free to focus."""
SUPPLY_TURNS = 6
"""In which the limit of a supply that many coils share is found."""
LEAST_FLOOR = 1e-12
"""m; less under the finger is no floor, and coils could push without bound for it."""
NO_COIL_GAIN = 30.0
"""On a board without a coil there is no floor; there the loudest force is at most so many times the
least that moves the finger alike."""


@dataclass(frozen=True)
class Focused:
    """A drive for one place, and what is proved of it.

    Attributes
    ----------
    drive
        complex128, shape (actuators,), N for a mean of one metre under the finger.
    ratio_db
        Mean under the finger over the RMS of the loudest silent disc, dB.
    bound_db
        No drive with this margin has a higher ratio, as long as no coil pushes more than F/floor.
        Where a supply that coils share is what limits them, F is what it gave the drive before.
    margin_db
        The same over the loudest disc of those that are merely quieter; infinite without any.
    floor_um
        What was asked for under the finger, after it was lowered to what can be had; 0 on a board
        without a coil.
    rounds, turns
        How often discs were taken in, and Newton steps.
    """

    drive: ComplexArray
    ratio_db: float
    bound_db: float
    margin_db: float
    floor_um: float
    rounds: int
    turns: int

    @property
    def gap_db(self) -> float:
        """What is left to prove."""
        return self.bound_db - self.ratio_db

    @property
    def details(self) -> dict[str, float]:
        """The certificate, and what was had of what was asked for."""
        return {
            "ratio_db": self.ratio_db,
            "bound_db": self.bound_db,
            "gap_db": self.gap_db,
            "margin_db": self.margin_db,
            "floor_um": self.floor_um,
        }


def shortfall(asked: Focus, details: dict[str, float]) -> str | None:
    """A sentence for what had to give way, by a drive's details; None where all was had."""
    margin, floor = details.get("margin_db", np.inf), details.get("floor_um", 0.0)
    lost = []
    if margin < asked.quieter_db - 2.0 * GAP_DB:
        lost.append(f"a margin of {margin:.1f} dB instead of {asked.quieter_db:g}")
    if 0.0 < floor < asked.floor_um * (1.0 - 1e-9):
        lost.append(f"a floor of {floor:.2g} µm instead of {asked.floor_um:g}")
    if not lost:
        return None
    is_less = asked.reserve_db > 0.0 and margin < asked.quieter_db
    kept_back = f" (up to {asked.reserve_db:g} dB more is kept back for silence)" * is_less
    return f"the most that these coils can do here is {' and '.join(lost)}{kept_back}"


def focus(problem: Problem, options: Options) -> Found:
    """The drive, and its certificate in `details`."""
    del options
    solved, fields = problem.solved.for_focus, problem.transfer
    if solved is not problem.solved:
        fields = solved.fields.values
    found = focus_at(solved, problem.place, fields[:, problem.disc].mean(axis=1))
    if found is None:
        # Nothing moves the finger, so no drive is better than another.
        return Found(np.ones(len(problem.transfer), dtype=np.complex128))
    return Found(found.drive, evaluations=found.turns, details=found.details)


def focus_at(solved: SolvedBoard, place: Place, mean: ComplexArray) -> Focused | None:
    """The drive for a finger at a place (m).

    Parameters
    ----------
    mean
        Mean displacement under the finger per newton of each actuator, shape (actuators,), m/N.

    Returns
    -------
    Focused | None
        None where no actuator moves the finger.
    """
    board, discs = solved.board, solved.second_fingers
    asked = board.focus or Focus()
    reach = float(np.abs(mean).sum())
    if not reach > 1e-12 * np.sqrt(np.abs(discs.forms).max()):
        return None
    far, near = _zones(discs.distances(place), asked)
    if not far.size:
        # All of the board is in the finger's own neighbourhood: what moves it most will do.
        drive = mean.conj() / float(np.vdot(mean, mean).real)
        return Focused(drive, np.inf, np.inf, np.inf, 0.0, 0, 0)
    frequency = solved.fields.frequency_hz
    newtons = _force(board, np.eye(mean.size)[0].astype(np.complex128), frequency)
    for _ in range(SUPPLY_TURNS):
        found = _within(discs, (far, near), mean, asked, newtons)
        own = _force(board, found.drive, frequency)
        largest = float(np.abs(found.drive).max())
        if newtons is None or own is None or own >= 0.999e-6 * largest * found.floor_um:
            break
        # The supply gives the loudest coil less than it could take, the less the more play along.
        newtons, found = own, replace(found, floor_um=1e6 * own / largest)
    return found


def _force(board: Board, drive: ComplexArray, frequency_hz: float) -> float | None:
    """The most the loudest coil of a drive can push, N; None on a board without a coil.

    Tables do not depend on trims, so neither does what is found.
    """
    full = full_drive(untrimmed(board), drive, frequency_hz)
    return full.newtons if full else None


def _zones(distance: FloatArray, asked: Focus) -> tuple[IndexArray, IndexArray]:
    """Numbers of the discs that are to be silent, and of those merely quieter."""
    far = np.flatnonzero(distance >= asked.silent_from)
    near = np.flatnonzero((distance >= asked.quieter_from) & (distance < asked.silent_from))
    return (far, near) if far.size else (near, far)


def _within(
    discs: SecondFingers,
    zones: tuple[IndexArray, IndexArray],
    mean: ComplexArray,
    asked: Focus,
    newtons: float | None,
) -> Focused:
    """The drive of coils that push so many newtons at most."""
    reach = float(np.abs(mean).sum())
    floor, limit = 0.0, NO_COIL_GAIN / reach
    if newtons:
        floor = min(asked.floor_um * 1e-6, SHARE * newtons * reach)
        limit = newtons / floor if floor > LEAST_FLOOR else limit
    search = _Search(discs, limit, mean * limit)
    (far, near), cap, start = zones, 10.0 ** (-asked.quieter_db / 10.0), None
    if near.size:
        every = np.concatenate(zones)
        kept_back = 10.0 ** (asked.reserve_db / 10.0)
        first = search.least(every, every[:0], cap, enough=cap / kept_back)
        least = GIVEN_WAY * first.level
        cap = max(cap, least, min(kept_back * least, 1.0 / kept_back))
        start = first.drive
    found = search.least(far, near, cap, start=start)
    drive = found.drive * limit
    squares = discs.mean_squares(drive)
    level, beside = (float(squares[zone].max(initial=0.0)) for zone in zones)
    return Focused(
        drive=drive,
        ratio_db=_decibel(level),
        bound_db=_decibel(found.bound),
        margin_db=_decibel(beside) if near.size else np.inf,
        floor_um=floor * 1e6,
        rounds=search.rounds,
        turns=search.turns,
    )


class _Search:
    """Cutting planes over a board's discs, drives in units of the coils' limit.

    Parameters
    ----------
    limit
        N per metre under the finger.
    mean
        m in those units.
    """

    def __init__(self, discs: SecondFingers, limit: float, mean: ComplexArray) -> None:
        self._discs, self._limit, self._mean = discs, limit, mean
        self.rounds = self.turns = 0

    def least(
        self,
        far: IndexArray,
        near: IndexArray,
        cap: float,
        *,
        start: ComplexArray | None = None,
        enough: float = 0.0,
    ) -> Minimum:
        """The drive whose loudest far disc is least; its level and bound are of all discs.

        Parameters
        ----------
        far, near
            Numbers of discs.
        cap
            Of the near ones.
        start
            A drive that keeps to it.
        enough
            A level at which it ends.
        """
        chosen = [zone[::FIRST] for zone in (far, near)]
        certain = 10.0 ** (GAP_DB / 10.0)
        for number in range(ROUNDS):
            forms = [self._limit**2 * self._discs.forms[own] for own in chosen]
            # The first drive only shows where discs are lacking.
            found = minimax(
                self._mean,
                forms[0],
                forms[1],
                cap,
                tolerance=INNER if number else FIRST_GAP,
                start=start,
                enough=ENOUGH * enough,
            )
            self.rounds, self.turns = self.rounds + 1, self.turns + found.turns
            squares = self._discs.mean_squares(found.drive * self._limit)
            level = float(squares[far].max())
            limits = max(certain * max(found.bound, SILENT), enough), certain * cap
            louder = [
                _louder(self._discs, zone, squares, own)
                for zone, own in zip((far, near), limits, strict=True)
            ]
            if not any(more.size for more in louder):
                break
            chosen = [np.union1d(own, more) for own, more in zip(chosen, louder, strict=True)]
        return replace(found, level=level)


def _louder(
    discs: SecondFingers, zone: IndexArray, squares: FloatArray, level: float
) -> IndexArray:
    """Discs of a zone that are louder than a level, the loudest of each neighbourhood."""
    over = zone[squares[zone] > level]
    over = over[np.argsort(-squares[over], kind="stable")]
    kept: list[int] = []
    for one in over.tolist():
        apart = np.hypot(*(discs.centres[kept] - discs.centres[one]).T)
        if np.all(apart >= APART):
            kept.append(one)
        if len(kept) == TOGETHER:
            break
    return np.array(kept, dtype=np.intp)


def _decibel(power: float) -> float:
    """Of the finger's mean, 1, over a power."""
    return float(-10.0 * np.log10(max(power, 1e-30)))
