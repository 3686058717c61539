"""Who may speak to the server, and how often: pages that it served itself, under its token.

Any page that a browser has open may send requests to 127.0.0.1. So `Host` must be the server's own
name (another one is a foreign domain that resolves to it), `Origin` must be its own page, and the
path begins with a token that no other page knows.
"""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from time import monotonic
from typing import Any

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

NAMES = ("127.0.0.1", "localhost")
HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "cache-control": "no-store",
}
"""Nothing is loaded from elsewhere, framed, kept, or told to where links lead."""
TOO_MUCH, UNSUPPORTED = 1008, 1003
"""Codes with which a connection is closed (RFC 6455, 7.4.1): policy, kind of data."""


class Guard:
    """Lets requests of the server's own pages through; others get 403, wrong addresses 404.

    Parameters
    ----------
    app
        What answers; its paths come without the token.
    token
        First part of every path.
    port, host
        The server's.
    """

    def __init__(self, app: App, token: str, port: int, host: str = NAMES[0]) -> None:
        self._app, self._token = app, token.encode()
        names = NAMES if host in NAMES else (host,)
        self._hosts = {f"{name}:{port}".encode() for name in names}
        if port == 80:
            self._hosts |= {name.encode() for name in names}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request or connection."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        is_socket = scope["type"] == "websocket"
        if not self._is_own(scope, is_socket=is_socket):
            await _refuse(receive, send, 403, is_socket=is_socket)
            return
        token, _, rest = str(scope["path"]).removeprefix("/").partition("/")
        if not hmac.compare_digest(token.encode("utf-8", "replace"), self._token):
            await _refuse(receive, send, 404, is_socket=is_socket)
            return
        inner = dict(scope) | {"path": "/" + rest, "raw_path": None}
        await self._app(inner, receive, _with_headers(send))

    def _is_own(self, scope: Scope, *, is_socket: bool) -> bool:
        hosts = [value for name, value in scope["headers"] if name == b"host"]
        origins = [value for name, value in scope["headers"] if name == b"origin"]
        if len(hosts) != 1 or hosts[0].lower() not in self._hosts:
            return False
        # Browsers always name the page that opens a socket; of requests they may not.
        if not origins:
            return not is_socket
        return origins == [b"http://" + hosts[0].lower()]


def _with_headers(send: Send) -> Send:
    own = [(name.encode(), value.encode()) for name, value in HEADERS.items()]

    async def sent(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", []), *own]}
        await send(message)

    return sent


async def _refuse(receive: Receive, send: Send, status: int, *, is_socket: bool) -> None:
    if is_socket:
        await receive()
        await send({"type": "websocket.close", "code": 1008})  # answered with 403
        return
    await send(
        {
            "type": "http.response.start",
            "status": status,
            "headers": [(b"content-type", b"text/plain")],
        }
    )
    await send({"type": "http.response.body", "body": b"not for you\n"})


class SentAwayError(Exception):
    """A page does what it may not: its connection is closed, with this code and reason."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code, self.reason = code, reason


class Rate:
    """A bucket that fills at `per_second` up to `most`; what comes is taken out of it."""

    def __init__(
        self, per_second: float, most: float, clock: Callable[[], float] = monotonic
    ) -> None:
        self._per_second, self._most, self._clock = per_second, most, clock
        self._left, self._at = most, clock()

    def allows(self, amount: float = 1.0) -> bool:
        """Whether there is room for so much more, which is taken."""
        now = self._clock()
        self._left = min(self._most, self._left + (now - self._at) * self._per_second)
        self._at = now
        if self._left < amount:
            return False
        self._left -= amount
        return True
