"""What a computation takes, said before it begins: memory, time, and what would lower them."""

from __future__ import annotations

import logging
from dataclasses import dataclass

from chladni.sim.errors import TooLargeError

MOST_BYTES = 2e9
"""Work that needs more is refused, unless it is allowed."""
SAID_SECONDS = 1.0
"""Work that takes longer is announced."""

log = logging.getLogger("chladni")


@dataclass(frozen=True)
class Work:
    """An estimate, by shares fitted to what was measured on one core.

    Attributes
    ----------
    what
        Is done, for people.
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
        return f"{self.what}: about {self.seconds:.0f} s and {self.bytes / 1e9:.1f} GB"


class _Permission:
    """Whether large work may begin; one for the process, as memory is."""

    is_given = False


def allow_large_work(allowed: bool) -> None:
    """Let work of more than `MOST_BYTES` begin, or refuse it again."""
    _Permission.is_given = allowed


def is_too_large(work: Work) -> bool:
    """Whether work needs more memory than it is allowed."""
    return work.bytes > MOST_BYTES and not _Permission.is_given


def begin(work: Work) -> None:
    """Refuse work that is too large, and announce work that takes time.

    Raises
    ------
    TooLargeError
        Names what to lower.
    """
    if is_too_large(work):
        raise TooLargeError(work.what, work.bytes, MOST_BYTES, work.lower)
    if work.seconds > SAID_SECONDS:
        log.info("%s", work)
