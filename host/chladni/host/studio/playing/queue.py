"""Presses and moved parts of one page that wait to be played."""

from __future__ import annotations

import asyncio
from collections import deque

from chladni.host.studio.messages.guard import TOO_MUCH, SentAwayError
from chladni.host.studio.messages.requests import Move, Touch, Voice

MOST_WAITING = 64
"""Requests; moves of one finger are one, so only fingers that go up and down add up."""


class Queue:
    """Keeps requests in their order, and of one finger or part that moves on the last."""

    def __init__(self) -> None:
        self._waiting: deque[Touch | Voice | Move] = deque()
        self._has_news = asyncio.Event()

    def put(self, request: Touch | Voice | Move) -> None:
        """Let a request wait.

        Raises
        ------
        SentAwayError
            Too many wait.
        """
        # The one before would be replaced before anyone sees it.
        if self._waiting and _is_further(request, self._waiting[-1]):
            self._waiting.pop()
        if len(self._waiting) >= MOST_WAITING:
            raise SentAwayError(TOO_MUCH, "too many touches")
        self._waiting.append(request)
        self._has_news.set()

    async def take(self) -> list[Touch | Voice | Move]:
        """All that wait, once there are some."""
        await self._has_news.wait()
        taken = list(self._waiting)
        self.clear()
        return taken

    def clear(self) -> None:
        """Forget what waits."""
        self._waiting.clear()
        self._has_news.clear()


def _is_further(new: Touch | Voice | Move, old: Touch | Voice | Move) -> bool:
    """Whether a request is the same finger or part, further on."""
    if isinstance(new, Touch) and isinstance(old, Touch):
        return bool(new.finger == old.finger and new.place_mm and old.place_mm)
    if isinstance(new, Voice) and isinstance(old, Voice):
        return new.finger == old.finger
    if isinstance(new, Move) and isinstance(old, Move):
        return (new.part, new.index) == (old.part, old.index)
    return False
