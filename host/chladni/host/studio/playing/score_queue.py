"""Scores the latest press: it takes longer than the picture, so a drag leaves some out."""

from __future__ import annotations

import asyncio
import contextlib
from concurrent.futures import ThreadPoolExecutor
from time import monotonic

from chladni.host.studio.boards.prepared import Prepared
from chladni.host.studio.messages.sender import Sender
from chladni.host.studio.playing.played import Played
from chladni.host.studio.playing.press_score import numbers_of
from chladni.sim.errors import ChladniError

QUIET_S, LATEST_S = 0.1, 0.5
"""A scorecard is made once no press has come for so long, and in a drag as often as this."""


class Scorer:
    """Scores what one page plays.

    Parameters
    ----------
    sender
        To the page.
    """

    def __init__(self, sender: Sender) -> None:
        self._sender = sender
        self._has_news = asyncio.Event()
        # Of its own: what one page asks for takes no thread from another.
        self._thread = ThreadPoolExecutor(1, "score")
        self._latest: tuple[int, Prepared, Played] | None = None

    def put(self, number: int, shown: Prepared, played: Played) -> None:
        """A press that plays."""
        self._latest = number, shown, played
        self._has_news.set()

    def forget(self) -> None:
        """Send no score of the presses so far."""
        self._latest = None

    async def follow(self) -> None:
        """Until it is cancelled."""
        while True:
            await self._has_news.wait()
            await self._quiet()
            if self._latest is None:
                continue
            number, shown, played = self._latest
            loop = asyncio.get_running_loop()
            try:
                numbers = await loop.run_in_executor(self._thread, numbers_of, shown, played)
            except ChladniError as error:
                await self._sender.refuse(error, number)
                continue
            if self._latest is not None and self._latest[1] is shown:
                await self._sender.send({"type": "scored", "number": number, **numbers})

    async def _quiet(self) -> None:
        """Wait for a moment in which scoring holds up no press."""
        begun = monotonic()
        while self._has_news.is_set() and monotonic() < begun + LATEST_S:
            self._has_news.clear()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._has_news.wait(), QUIET_S)
        self._has_news.clear()

    def close(self) -> None:
        """Score nothing more."""
        self._thread.shutdown(wait=False, cancel_futures=True)
