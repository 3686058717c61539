"""What of a board was measured, how, and when: kept in its file beside the values themselves."""

from __future__ import annotations

from dataclasses import dataclass

from chladni.sim.board.quantity import quantity


@dataclass(frozen=True)
class MeasuredValue:
    """One value, with its interval of 95 %, over that of the board as it was drawn."""

    name: str
    ratio: float = quantity("ratio", 1.0, 0.0, 1e6)
    low: float = quantity("low", 1.0, 0.0, 1e6)
    high: float = quantity("high", 1.0, 0.0, 1e6)


@dataclass(frozen=True)
class Measured:
    """Where a board's values come from, if they were measured.

    Attributes
    ----------
    by
        What they were measured with, in words.
    date
        As 2026-11-26.
    values
        Those that the measurement tells; the others are as drawn.
    """

    by: str
    date: str
    values: tuple[MeasuredValue, ...] = ()
