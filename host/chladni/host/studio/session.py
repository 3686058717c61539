"""One page's connection: its own device, its own queue, and no more than it may ask for."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from starlette.websockets import WebSocket, WebSocketDisconnect

from chladni.drives.methods import METHODS
from chladni.drives.objectives import OBJECTIVES
from chladni.host.studio.boards.board_message import board_message, fields_bytes
from chladni.host.studio.boards.builder import BoardBuilder
from chladni.host.studio.boards.catalogue import Catalogue
from chladni.host.studio.boards.prepared import BoardChoice, Prepared, ReadyBoard
from chladni.host.studio.boards.searches import PageSearch
from chladni.host.studio.messages.guard import Rate
from chladni.host.studio.messages.requests import (
    Attach,
    Begin,
    Choose,
    Move,
    Open,
    Order,
    Request,
    Save,
    Stop,
    Take,
    Touch,
    parse,
)
from chladni.host.studio.messages.sender import Sender
from chladni.host.studio.playing.computed_drives import ComputedDrives
from chladni.host.studio.playing.device_port import ports
from chladni.host.studio.playing.emulated_device import EmulatedDevice
from chladni.host.studio.playing.played import played_message
from chladni.host.studio.playing.real_device import RealDevice
from chladni.host.studio.playing.scorer import Scorer
from chladni.host.studio.saving import file_message
from chladni.sim.errors import ChladniError, InputError
from chladni.tables.build import default_objective

Result = TypeVar("Result")

MESSAGES_PER_SECOND, MESSAGES_AT_ONCE = 250.0, 500.0
"""A panel reports at 100 a second, a fast mouse 125; our page sends at most one a frame."""
BYTES_PER_SECOND, BYTES_AT_ONCE = 100e3, 400e3
"""250 presses a second have 20 kB; a board file has 65 kB at most."""
BOARDS_PER_SECOND, BOARDS_AT_ONCE = 1.0, 10.0
"""Boards to be made ready."""
MOST_WAITING = 64
"""Events; moves of one finger are one, so only fingers that go up and down add up."""
FROM_PINS = "Drives are what the emulated firmware's pins make of a touch."
FROM_SOLVER = "A part has moved: drives are computed, and no device plays. Build its table for one."
FROM_METHOD = "Drives are computed by {}, which fills no tables, so no device plays."
MOST_ORDERS = 2
"""For a real device: one that is at work, and one to let go of it."""
PROGRESS_S = 0.2
TOO_MUCH, UNSUPPORTED = 1008, 1003
"""Codes with which a connection is closed (RFC 6455, 7.4.1): policy, kind of data."""


class _ClosedError(Exception):
    """The connection is closed."""


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
        self._socket, self._builder, self._catalogue = socket, builder, catalogue
        self._known_ports = known_ports
        self._sender = Sender(socket)
        self._real_device = RealDevice(self._sender, known_ports)
        self._scorer, self._search = (
            Scorer(self._sender),
            PageSearch(builder.searches, self._sender),
        )
        self._rates = Rate(MESSAGES_PER_SECOND, MESSAGES_AT_ONCE)
        self._bytes = Rate(BYTES_PER_SECOND, BYTES_AT_ONCE)
        self._boards = Rate(BOARDS_PER_SECOND, BOARDS_AT_ONCE)
        self._waiting: deque[Touch | Move] = deque()
        self._has_news = asyncio.Event()
        self._choice = catalogue.first
        self._before: BoardChoice | None = None
        self._shown: Prepared | None = None
        self._serving: asyncio.Task[None] | None = None
        self._orders: set[asyncio.Task[None]] = set()
        # Of its own: what one page asks for takes no thread from another.
        self._hand = ThreadPoolExecutor(1, "touch")

    async def run(self) -> None:
        """Until the page goes, or is sent away."""
        followed = (self._scorer, self._real_device, self._search)
        besides = [asyncio.create_task(own.follow()) for own in followed]
        try:
            await self._start(self._choice)
            await self._listen()
        except (_ClosedError, WebSocketDisconnect, RuntimeError):
            pass  # Starlette's RuntimeError: sent after the page had gone
        finally:
            tasks = [*besides, *self._orders, *([self._serving] if self._serving else [])]
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._hand.shutdown(wait=False, cancel_futures=True)
            self._scorer.close()
            self._search.stop()
            self._real_device.close()

    async def _listen(self) -> None:
        while True:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                raise _ClosedError
            if message.get("text") is None:
                await self._close(UNSUPPORTED, "text only")
            text = str(message["text"])
            if not self._rates.allows() or not self._bytes.allows(len(text)):
                await self._close(TOO_MUCH, "too many messages")
            try:
                await self._do(parse(text))
            except ChladniError as error:
                await self._sender.refuse(error)

    async def _do(self, request: Request) -> None:
        if isinstance(request, (Touch, Move)):
            await self._put(request)
        elif isinstance(request, Save):
            await self._sender.send(file_message(self._shown, request.what))
        elif isinstance(request, (Attach, Order)):
            await self._order(request)
        elif isinstance(request, Stop):
            self._search.stop()
        else:
            if not self._boards.allows():
                await self._close(TOO_MUCH, "too many boards")
            if isinstance(request, Begin):
                self._search.begin(*self._catalogue.asked(request))
            else:
                await self._start(self._chosen(request))

    def _chosen(self, request: Open | Choose | Take) -> BoardChoice:
        if isinstance(request, Take):
            board = self._search.taken(request.index)
            return BoardChoice(board, default_objective(board))
        if isinstance(request, Open):
            return self._catalogue.opened(request)
        shown = (self._shown.choice if self._shown else self._choice).board
        return self._catalogue.chosen(request, shown)

    async def _put(self, request: Touch | Move) -> None:
        """Queue an event; a move replaces the one before, which no one would see."""
        if self._waiting and _replaces(request, self._waiting[-1]):
            self._waiting.pop()
        if len(self._waiting) >= MOST_WAITING:
            await self._close(TOO_MUCH, "too many touches")
        self._waiting.append(request)
        self._has_news.set()

    async def _order(self, request: Attach | Order) -> None:
        """Have the real device do something, while the page is listened to all the same."""
        if len(self._orders) >= MOST_ORDERS:
            raise InputError("order", "another one", "one at a time")
        if isinstance(request, Attach):
            work = self._real_device.attach(request.port)
        else:
            work = self._real_device.do(request, self._shown)
        task = asyncio.create_task(self._told(work))
        self._orders.add(task)
        task.add_done_callback(self._orders.discard)

    async def _told(self, work: Coroutine[Any, Any, None]) -> None:
        """Work of which the page hears what was wrong."""
        try:
            await work
        except ChladniError as error:
            await self._sender.refuse(error)
        except (WebSocketDisconnect, RuntimeError):
            pass  # the page has gone

    async def _start(self, choice: BoardChoice) -> None:
        """Go over to a board."""
        if self._serving is not None:
            self._serving.cancel()
            await asyncio.gather(self._serving, return_exceptions=True)
        self._waiting.clear()
        self._choice, self._shown, self._scorer.latest = choice, None, None
        await self._sender.send(self._hello(choice))
        self._serving = asyncio.create_task(self._serve(choice))

    def _hello(self, choice: BoardChoice) -> dict[str, Any]:
        """What there is to choose from, and what is chosen."""
        return {
            "type": "hello",
            "boards": self._catalogue.names,
            "specs": self._catalogue.specs,
            "ports": ports(self._known_ports),
            "objectives": list(OBJECTIVES),
            "methods": list(METHODS),
            "board": choice.board.name,
            "objective": choice.objective,
            "method": choice.method,
            "frequency_hz": choice.board.drive.frequency_hz,
        }

    async def _serve(self, choice: BoardChoice) -> None:
        try:
            ready, refusal = await self._ready_or_before(choice)
            if ready is not None:
                self._before = ready.choice
                await self._show(ready)
            if refusal is not None:
                await self._sender.refuse(refusal)
            if ready is not None:
                await self._play(ready)
        except (WebSocketDisconnect, RuntimeError):
            pass  # the page has gone, and `_listen` hears of it

    async def _ready_or_before(
        self, choice: BoardChoice
    ) -> tuple[Prepared | None, ChladniError | None]:
        """A board, or if that cannot be made the one before it and why."""
        try:
            return await self._ready(choice), None
        except ChladniError as error:
            if self._before is None:
                return None, error
            self._choice = self._before
            await self._sender.send(self._hello(self._before))
            return await self._ready(self._before), error

    async def _ready(self, choice: BoardChoice) -> Prepared:
        """The board, with progress while it is made."""
        build = self._builder.build(choice)
        try:
            result, told = asyncio.wrap_future(build.result), None
            while not result.done():
                if told != (build.done, build.all):
                    told = build.done, build.all
                    await self._sender.send({"type": "progress", "board": choice.board.name,
                                      "done": told[0], "all": told[1]})  # fmt: skip
                await asyncio.wait([result], timeout=PROGRESS_S)
            return result.result()
        finally:
            self._builder.leave(build)

    async def _show(self, prepared: Prepared, *, is_draft: bool = False) -> None:
        self._shown = prepared
        source = FROM_METHOD.format(prepared.choice.method)
        if is_draft:
            source = FROM_SOLVER
        elif isinstance(prepared, ReadyBoard):
            source = FROM_PINS
        head = board_message(prepared, source, is_draft=is_draft)
        await self._sender.send(head, fields_bytes(prepared))

    async def _play(self, ready: Prepared) -> None:
        """Answer touches, with the device until a part moves, and from then on without."""
        player = EmulatedDevice(ready) if isinstance(ready, ReadyBoard) else ComputedDrives(ready)
        shown = ready
        while True:
            await self._has_news.wait()
            self._has_news.clear()
            waiting, self._waiting = list(self._waiting), deque()
            number = waiting[-1].number
            moves = [one for one in waiting if isinstance(one, Move)]
            touches = [one for one in waiting if isinstance(one, Touch)]
            try:
                if moves:
                    draft = player if isinstance(player, ComputedDrives) else ComputedDrives(shown)
                    for move in moves:
                        shown = await self._in(self._hand, draft.move, *_where(move))
                    player = draft  # only now: a part that may not be there leaves all as it was
                    await self._show(shown, is_draft=True)
                played = await self._in(self._hand, player.apply, touches)
                if touches:
                    self._real_device.point(played.place_mm if played else None)
                latest = self._scorer.latest
                if moves and played is None and latest and isinstance(player, ComputedDrives):
                    place = latest[2].place_mm
                    played = await self._in(self._hand, player.solve, place)
            except ChladniError as error:
                await self._sender.refuse(error, number)
                continue
            if played is None:
                await self._sender.send({"type": "lifted", "number": number})
                continue
            await self._sender.send(played_message(shown, number, played))
            self._scorer.put(number, shown, played)

    async def _in(
        self, pool: ThreadPoolExecutor, work: Callable[..., Result], *given: Any
    ) -> Result:
        return await asyncio.get_running_loop().run_in_executor(pool, work, *given)

    async def _close(self, code: int, reason: str) -> None:
        await self._socket.close(code, reason)
        raise _ClosedError


def _replaces(new: Touch | Move, old: Touch | Move) -> bool:
    """Whether an event is the same finger or part, further on."""
    if isinstance(new, Touch) and isinstance(old, Touch):
        return bool(new.finger == old.finger and new.place_mm and old.place_mm)
    if isinstance(new, Move) and isinstance(old, Move):
        return (new.part, new.index) == (old.part, old.index)
    return False


def _where(move: Move) -> tuple[str, int, tuple[float, float]]:
    return move.part, move.index, move.place_mm
