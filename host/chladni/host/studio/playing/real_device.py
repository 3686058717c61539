"""A page's real device: presses and orders go to its port one at a time, in their own thread."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from starlette.websockets import WebSocketDisconnect

from chladni.host.studio.boards.prepared import Prepared, ReadyBoard
from chladni.host.studio.messages.requests import Attach, Order, Place
from chladni.host.studio.messages.sender import Sender
from chladni.host.studio.playing.device_port import DevicePort
from chladni.sim.errors import ChladniError, InputError, MissingError

Result = TypeVar("Result")
MOST_ORDERS = 2
"""One that is at work, and one to let go of it."""
PROGRESS_S = 0.2


class RealDevice:
    """Attaches a device, passes presses on to it, and does what a page orders.

    Parameters
    ----------
    sender
        To the page.
    known
        Ports that pages may choose besides those with a USB bridge.
    """

    def __init__(self, sender: Sender, known: Sequence[str]) -> None:
        self._sender, self._known = sender, known
        self._port: DevicePort | None = None
        self._thread = ThreadPoolExecutor(1, "device")
        self._orders: set[asyncio.Task[None]] = set()
        self._wanted: Place | None = None
        self._has_news = asyncio.Event()

    def begin(self, request: Attach | Order, shown: Prepared | None) -> None:
        """Have the device do something, of which the page hears; it can ask more meanwhile.

        Parameters
        ----------
        shown
            The board of the page; None while it is made ready.

        Raises
        ------
        InputError
            The device is still at what was asked before.
        """
        if len(self._orders) >= MOST_ORDERS:
            raise InputError("order", "another one", "one at a time")
        if isinstance(request, Attach):
            work = self._attach(request.port)
        else:
            work = self._do(request, shown)
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

    async def _attach(self, port: str | None) -> None:
        """Take a port, or let go of it; the page hears what is there."""
        await self._in(self._let_go)
        if port is None:
            await self._sender.send({"type": "device", "port": None, "said": "let go"})
            return
        try:
            self._port = await self._in(lambda: DevicePort(port, self._known))
            await self._about("")
        except ChladniError as error:
            await self._lost(error)

    async def _do(self, order: Order, shown: Prepared | None) -> None:
        """What a page orders; it hears how far that is, and what came of it."""
        connected = self._port
        if connected is None:
            raise MissingError("port", "no device is connected")
        try:
            await self._about(await self._ordered(connected, order, shown))
        except InputError as error:  # of the setting or the table: the device is still there
            await self._about(str(error))
        except ChladniError as error:
            await self._lost(error)

    def point(self, place_mm: Place | None) -> None:
        """Hold a finger there, or lift it; of several that come at once, the last."""
        self._wanted = place_mm
        self._has_news.set()

    async def follow(self) -> None:
        """Pass presses on, for ever."""
        while True:
            await self._has_news.wait()
            self._has_news.clear()
            connected, place = self._port, self._wanted
            if connected is None:
                continue
            try:
                if place is None:
                    await self._in(connected.lift)
                else:
                    await self._in(partial(connected.hold, place))
            except ChladniError as error:
                await self._lost(error)

    def close(self) -> None:
        """Let go of the device, once it has done what it is at."""
        for task in self._orders:
            task.cancel()
        self._thread.submit(self._let_go)
        self._thread.shutdown(wait=False)

    async def _ordered(self, connected: DevicePort, order: Order, shown: Prepared | None) -> str:
        done = [0, 0]

        def tell(now: int, of_all: int) -> None:
            done[:] = now, of_all

        if order.what == "flash":
            if not isinstance(shown, ReadyBoard):
                raise InputError("table", "a board without one", "a board whose table is built")
            table = shown.table
            return await self._watched(order.what, done, lambda: connected.flash(table, tell))
        if order.what == "self-test":
            return await self._watched(order.what, done, lambda: connected.self_test(tell))
        if order.what == "set":
            return await self._in(lambda: connected.set(order.text))
        if order.what == "configure":
            if shown is None:
                raise MissingError("board", "none is shown yet")
            board = shown.board
            return await self._in(lambda: connected.configure(board))
        return ""

    async def _watched(self, what: str, done: list[int], work: Callable[[], str]) -> str:
        """Work that takes seconds, with its progress told."""
        task = asyncio.ensure_future(self._in(work))
        while not task.done():
            await self._sender.send(
                {"type": "doing", "what": what, "done": done[0], "all": done[1]}
            )
            await asyncio.wait([task], timeout=PROGRESS_S)
        return task.result()

    async def _about(self, said: str) -> None:
        connected = self._port
        if connected is not None:
            await self._sender.send(
                {"type": "device", "said": said, **await self._in(connected.about)}
            )

    async def _lost(self, error: ChladniError) -> None:
        """The device has gone, or does not answer: the port is free again."""
        await self._in(self._let_go)
        await self._sender.send({"type": "device", "port": None, "said": str(error)})

    def _let_go(self) -> None:
        if self._port is not None:
            self._port.close()
        self._port = None

    async def _in(self, work: Callable[[], Result]) -> Result:
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)
