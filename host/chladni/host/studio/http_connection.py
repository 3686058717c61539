"""A connection that must ask for something: one whose request does not come is closed."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

REQUEST_S = 5.0
"""For the next request, all of its head: pages come from this machine or from its network."""


class HttpConnection(H11Protocol):
    """uvicorn's, which by itself waits for ever for a request that was begun, or never is.

    Such connections would count as all others do, until no page gets one.
    """

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request."""
        super().connection_made(transport)
        self._wait()

    def on_response_complete(self) -> None:
        """Wait for the next one."""
        self._wait()
        super().on_response_complete()

    def handle_websocket_upgrade(self, event: Any) -> None:
        """Wait no more: a page may say nothing for as long as it likes."""
        self._stop()
        super().handle_websocket_upgrade(event)

    def connection_lost(self, exc: Exception | None) -> None:
        """Nothing is left to wait for."""
        self._stop()
        super().connection_lost(exc)

    def _wait(self) -> None:
        self._stop()
        self._deadline = self.loop.call_later(REQUEST_S, self._give_up, self.cycle)

    def _stop(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()

    def _give_up(self, last: object) -> None:
        """Close the connection, unless a request has come after the last one."""
        if self.cycle is last:
            self.transport.close()
