"""How long the boards of a search take, and so for how many there is time."""

from __future__ import annotations

import time

import numpy as np

from chladni.design.last_boards import (
    RECENT,
    USUAL,
    boards_in,
    boards_more,
    draws_in,
    expected_s,
)
from chladni.design.spec import Spec

AT_THE_END = 0.4
"""Share of a search's time that is kept back to compare the last few, at most."""
KNOWN_S = 10.0
"""Boards of so many seconds together tell what others take. The first one loads libraries."""
DIFFERENT = 0.2
"""Share by which the number of boards changes before it is told again: an estimate of what is left
begins again with it."""


class Pace:
    """The time of a search, and what its boards took of it.

    Parameters
    ----------
    samples
        Random boards by which the last few are compared.
    asked
        The most boards that the search looks at.
    started, ends
        Readings of the clock, s.
    """

    def __init__(
        self, spec: Spec, samples: int, jobs: int, asked: int, started: float, ends: float
    ) -> None:
        self._spec, self._samples, self._jobs, self._asked = spec, samples, jobs, asked
        self.started, self.ends = started, ends
        self._seconds: list[float] = []
        self._told, self._more = asked, boards_more(spec, samples)

    def add(self, seconds: float) -> None:
        """Count a board that took so long."""
        self._seconds.append(seconds)

    @property
    def is_known(self) -> bool:
        """Whether boards took long enough to tell what others take."""
        return sum(self._seconds) >= KNOWN_S

    @property
    def seconds(self) -> float:
        """Between two boards; 0 before the first one."""
        return float(np.median(self._seconds[-RECENT:] or [0.0])) / self._jobs

    @property
    def first_end(self) -> float:
        """Reading of the clock when the last boards are to be compared, s."""
        at_most = AT_THE_END * (self.ends - self.started)
        return self.ends - min(self.seconds_to_compare(USUAL), at_most)

    def room(self, until: float) -> int | None:
        """Boards for which there is time, as of `boards_in`."""
        return boards_in(until - time.perf_counter(), self._seconds, self._jobs)

    def boards(self, before: int) -> int:
        """Boards that the search comes to.

        Parameters
        ----------
        before
            Boards that it looked at, or has in its checkpoint.
        """
        room = self.room(self.first_end)
        return self._asked if room is None else min(max(before + room, 1), self._asked)

    def told(self, before: int) -> tuple[int, int]:
        """As `boards`, for its progress, and as how many of them its end counts."""
        boards = self.boards(before)
        if abs(boards - self._told) > DIFFERENT * self._told:
            end = boards_in(self.ends - self.first_end, self._seconds, self._jobs) or 1
            self._more = min(boards_more(self._spec, self._samples), end)
            self._told = boards
        return max(self._told, min(before, self._asked)), self._more

    def seconds_to_compare(self, count: int, draws: int | None = None) -> float:
        """How long so many last boards may take, by what boards took so far."""
        samples = self._samples if draws is None else draws
        return expected_s(self._spec, samples, count, self._seconds, self._jobs)

    def draws(self, count: int) -> int:
        """Random boards of each of so many last boards, for which there is time."""
        own = (self._spec, self._samples, count, self._seconds, self._jobs)
        return draws_in(self.ends - time.perf_counter(), *own)
