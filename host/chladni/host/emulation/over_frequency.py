"""A board solved at many frequencies, closer where it resonates, so that splines join them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.calibration.hidden import HiddenPlate
from chladni.drives.problem.problem import SolvedBoard, solved_board
from chladni.effects.low_pass import EDGE_HZ
from chladni.sim.board.board import Board
from chladni.sim.fields.driven import moved_coils

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]

GRID_HZ = (2.0, *np.arange(15.0, 315.0, 15.0).tolist(), 330.0, 360.0, 400.0, 450.0, 520.0, 600.0)
"""Frequencies at which every plate is solved. On `strip5` responses between them are right within
0.2 % up to 280 Hz, and within 2 % where they are 25 Hz apart."""
ROUGH, FINEST_HZ = 0.1, 2.0
"""Share by which splines without a frequency may miss it before both intervals beside it are
halved, and how wide one is at least. With it they miss what lies between by a tenth of that. Above
250 Hz four times as much an octave, for half of what the low-pass takes in decibels."""
BESIDE = 4
"""Frequencies on either side, of which a spline is to meet one."""


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


@dataclass(frozen=True)
class Plates:
    """The board that host and device know, and the plate that fingers are on, over frequency.

    Attributes
    ----------
    known
        The board `over_frequency`.
    hidden
        The plate; None where it is the board's own.
    below
        As `known`, of the hidden plate's board.
    """

    known: Sequence[SolvedBoard]
    hidden: HiddenPlate | None = None
    below: Sequence[SolvedBoard] | None = None

    def __post_init__(self) -> None:
        assert (self.hidden is None) == (self.below is None), "a hidden plate is solved, too"

    @classmethod
    def of(
        cls, board: Board, hidden: HiddenPlate | None = None, progress: Progress | None = None
    ) -> Plates:
        """Both are solved, with one progress."""
        if hidden is None:
            return cls(over_frequency(board, progress))
        tell = progress or (lambda done, count: None)
        tell(0, 2 * len(GRID_HZ))
        # It takes up to three times as long. Estimates that begin with it become shorter.
        below = over_frequency(hidden.board, lambda done, count: tell(done, count + len(GRID_HZ)))
        first = len(below)
        known = over_frequency(board, lambda done, count: tell(first + done, first + count))
        return cls(known, hidden, below)


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
