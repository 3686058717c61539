"""What a computation costs, reported before it begins: memory, time, what would lower them."""

from __future__ import annotations

import logging
from dataclasses import dataclass

from chladni.sim.errors import TooLargeError

MOST_BYTES = 2e9
"""What needs more is refused, unless it is allowed."""
ANNOUNCED_SECONDS, ANNOUNCED_BYTES = 1.0, 0.5e9
"""What takes longer or needs more is announced."""

log = logging.getLogger("chladni")


@dataclass(frozen=True)
class Cost:
    """An estimate, by shares fitted to what was measured on one core.

    Attributes
    ----------
    what
        What is computed, for people.
    bytes
        At the peak.
    seconds
        On one core, within a factor of two or so.
    lower
        What of the board or the question to lower for less.
    """

    what: str
    bytes: float
    seconds: float
    lower: str

    def __str__(self) -> str:
        seconds = f"{self.seconds:.0f} s and " if self.seconds > ANNOUNCED_SECONDS else ""
        return f"{self.what}: about {seconds}{self.bytes / 1e9:.1f} GB"


class _Permission:
    """Whether a large computation may begin; one for the process, as memory is."""

    is_given = False


def allow_large_cost(allowed: bool) -> None:
    """Let computations of more than `MOST_BYTES` begin, or refuse them again."""
    _Permission.is_given = allowed


def is_too_large(cost: Cost) -> bool:
    """Whether a computation needs more memory than it is allowed."""
    return cost.bytes > MOST_BYTES and not _Permission.is_given


def begin(cost: Cost) -> None:
    """Refuse a computation that is too large, and announce one that takes time or memory.

    Raises
    ------
    TooLargeError
        Names what to lower.
    """
    if is_too_large(cost):
        raise TooLargeError(cost.what, cost.bytes, MOST_BYTES, cost.lower)
    if cost.seconds > ANNOUNCED_SECONDS or cost.bytes > ANNOUNCED_BYTES:
        log.info("%s", cost)
