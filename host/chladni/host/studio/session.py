"""One page's connection: what arrives, who answers it, and no more than a page may ask for."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from starlette.websockets import WebSocket, WebSocketDisconnect

from chladni.host.studio.boards.builder import BoardBuilder
from chladni.host.studio.boards.catalogue import Catalogue
from chladni.host.studio.boards.prepared import BoardChoice
from chladni.host.studio.boards.searches import PageSearch
from chladni.host.studio.messages.guard import TOO_MUCH, UNSUPPORTED, Rate, SentAwayError
from chladni.host.studio.messages.requests import (
    Attach,
    Begin,
    Choose,
    Move,
    Open,
    Order,
    PlayEffect,
    Request,
    Save,
    Stop,
    Take,
    Touch,
    Voice,
    number_of,
    parse,
)
from chladni.host.studio.messages.sender import Sender
from chladni.host.studio.page_board import PageBoard
from chladni.host.studio.playing.felt_effect import EffectPlayer
from chladni.host.studio.playing.player import Player
from chladni.host.studio.playing.queue import Queue
from chladni.host.studio.playing.real_device import RealDevice
from chladni.host.studio.playing.score_queue import Scorer
from chladni.host.studio.saving import file_message
from chladni.sim.errors import ChladniError

MESSAGES_PER_SECOND, MESSAGES_AT_ONCE = 250.0, 500.0
"""A panel reports at 100 a second, a fast mouse 125; our page sends at most one a frame."""
BYTES_PER_SECOND, BYTES_AT_ONCE = 100e3, 400e3
"""250 presses a second have 20 kB; a board file has 65 kB at most."""
BOARDS_PER_SECOND, BOARDS_AT_ONCE = 1.0, 10.0
"""Boards to be made ready."""


class Session:
    """Serves one page until it goes.

    Parameters
    ----------
    socket
        Accepted.
    builder, catalogue
        Shared by all pages.
    known_ports
        Serial ports that a page may choose besides those with a USB bridge.
    """

    def __init__(
        self,
        socket: WebSocket,
        builder: BoardBuilder,
        catalogue: Catalogue,
        known_ports: Sequence[str],
    ) -> None:
        self._socket, self._catalogue = socket, catalogue
        self._messages = Rate(MESSAGES_PER_SECOND, MESSAGES_AT_ONCE)
        self._bytes = Rate(BYTES_PER_SECOND, BYTES_AT_ONCE)
        self._boards = Rate(BOARDS_PER_SECOND, BOARDS_AT_ONCE)
        self._sender = sender = Sender(socket)
        self._queue, self._scorer = Queue(), Scorer(sender)
        self._real_device = RealDevice(sender, known_ports)
        self._player = Player(self._queue, sender, self._real_device, self._scorer)
        self._page_board = PageBoard(sender, self._player, builder, catalogue, known_ports)
        self._search = PageSearch(builder.searches, sender)
        self._effects = EffectPlayer(sender)

    async def run(self) -> None:
        """Until the page goes, or is sent away."""
        followed = (self._scorer, self._real_device, self._search, self._effects)
        tasks = [asyncio.create_task(part.follow()) for part in followed]
        try:
            await self._page_board.start(self._catalogue.first)
            await self._listen()
        except (WebSocketDisconnect, RuntimeError):
            pass  # Starlette's RuntimeError: sent after the page had gone
        finally:
            for task in tasks:
                task.cancel()
            # At once: what is awaited may be cancelled, as when the server ends.
            self._real_device.close()
            await asyncio.gather(*tasks, return_exceptions=True)
            await self._page_board.stop()
            self._player.close()
            self._scorer.close()
            self._effects.close()
            self._search.stop()

    async def _listen(self) -> None:
        try:
            while True:
                text = await self._receive()
                try:
                    await self._answer(parse(text))
                except ChladniError as error:
                    await self._sender.refuse(error, number_of(text))
        except SentAwayError as error:
            await self._socket.close(error.code, error.reason)

    async def _receive(self) -> str:
        message = await self._socket.receive()
        if message["type"] == "websocket.disconnect":
            raise WebSocketDisconnect
        if message.get("text") is None:
            raise SentAwayError(UNSUPPORTED, "text only")
        text = str(message["text"])
        if not self._messages.allows() or not self._bytes.allows(len(text)):
            raise SentAwayError(TOO_MUCH, "too many messages")
        return text

    async def _answer(self, request: Request) -> None:
        """Hand a request to the part that answers it."""
        if isinstance(request, (Touch, Voice, Move)):
            self._queue.put(request)
        elif isinstance(request, Save):
            await self._sender.send(file_message(self._player.shown, request.what))
        elif isinstance(request, (Attach, Order)):
            self._real_device.begin(request, self._player.shown)
        elif isinstance(request, PlayEffect):
            self._effects.put(request, self._player.shown)
        elif isinstance(request, Stop):
            self._search.stop()
        elif not self._boards.allows():
            raise SentAwayError(TOO_MUCH, "too many boards")
        elif isinstance(request, Begin):
            self._search.begin(*self._catalogue.asked(request))
        else:
            await self._page_board.start(self._chosen(request))

    def _chosen(self, request: Open | Choose | Take) -> BoardChoice:
        if isinstance(request, Take):
            return self._search.taken(request.index)
        if isinstance(request, Open):
            return self._catalogue.opened(request)
        return self._catalogue.chosen(request, self._page_board.board)
