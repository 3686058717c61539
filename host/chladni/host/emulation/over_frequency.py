"""A board solved at many frequencies, closer where it resonates, so that splines join them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

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
