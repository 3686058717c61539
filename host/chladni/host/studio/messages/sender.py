"""The way to one page: messages in JSON and the bytes that follow them, one after the other."""

from __future__ import annotations

import asyncio
import json
import math
from typing import Any

from starlette.websockets import WebSocket

from chladni.sim.errors import ChladniError, InputError


class Sender:
    """Sends to one page.

    Parameters
    ----------
    socket
        Accepted.
    """

    def __init__(self, socket: WebSocket) -> None:
        self._socket, self._turn = socket, asyncio.Lock()

    async def send(self, message: dict[str, Any], data: bytes = b"") -> None:
        """Send a message, and the bytes that belong to it."""
        async with self._turn:
            await self._socket.send_text(in_json(message))
            if data:
                await self._socket.send_bytes(data)

    async def refuse(self, error: ChladniError, number: int | None = None) -> None:
        """Send an error, and the number of the request that it answers."""
        message: dict[str, Any] = {"type": "refused", "number": number, "text": str(error)}
        if isinstance(error, InputError):
            message |= {"field": error.field, "file": error.file or ""}
        await self.send(message)


def in_json(message: dict[str, Any]) -> str:
    """A message as it is sent; a number that is none becomes null."""
    return json.dumps(_finite(message), allow_nan=False, separators=(",", ":"))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(own) for key, own in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(own) for own in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
