"""Plays one page's board: takes presses from the queue and sends what they make to the page."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from chladni.host.studio.boards.board_message import board_message, fields_bytes
from chladni.host.studio.boards.prepared import Prepared, ReadyBoard
from chladni.host.studio.messages.requests import Move, Place, Touch, Voice
from chladni.host.studio.messages.sender import Sender
from chladni.host.studio.playing.computed_drives import ComputedDrives
from chladni.host.studio.playing.emulated_fingers import EmulatedFingers
from chladni.host.studio.playing.played import Played, played_message
from chladni.host.studio.playing.queue import Queue
from chladni.host.studio.playing.real_device import RealDevice
from chladni.host.studio.playing.score_queue import Scorer
from chladni.sim.errors import ChladniError

Result = TypeVar("Result")

FROM_PINS = "Drives are what the emulated firmware's pins make of a touch."
FROM_SOLVER = "A part has moved: drives are computed, and no device plays. Build its table for one."
FROM_METHOD = "Drives are computed by {}, which fills no tables, so no device plays."


class Player:
    """Answers presses by the emulated device, or by computed drives once a part has moved.

    Parameters
    ----------
    queue
        Where presses and moved parts come from.
    sender
        To the page.
    real_device
        Plays what is pressed, too.
    scorer
        Scores what plays.

    Attributes
    ----------
    shown
        The board that the page has; None while one is made ready.
    """

    def __init__(
        self, queue: Queue, sender: Sender, real_device: RealDevice, scorer: Scorer
    ) -> None:
        self._queue, self._sender = queue, sender
        self._real_device, self._scorer = real_device, scorer
        self.shown: Prepared | None = None
        self._place_mm: Place | None = None
        # Of its own: what one page asks for takes no thread from another.
        self._thread = ThreadPoolExecutor(1, "touch")

    def forget(self) -> None:
        """Show no board: another one is made ready."""
        self.shown = self._place_mm = None
        self._queue.clear()
        self._scorer.forget()

    async def show(self, prepared: Prepared) -> None:
        """Send a board to the page."""
        if isinstance(prepared, ReadyBoard):
            await self._show(prepared, FROM_PINS)
        else:
            await self._show(prepared, FROM_METHOD.format(prepared.choice.method))

    async def play(self, prepared: Prepared) -> None:
        """Answer presses on a board that is shown, until cancelled."""
        source: EmulatedFingers | ComputedDrives = (
            EmulatedFingers(prepared)
            if isinstance(prepared, ReadyBoard)
            else ComputedDrives(prepared)
        )
        while True:
            requests = await self._queue.take()
            number = requests[-1].number
            moves = [one for one in requests if isinstance(one, Move)]
            touches = [one for one in requests if isinstance(one, (Touch, Voice))]
            try:
                if moves:
                    source = await self._move(source, moves)
                played = await self._in_thread(source.apply, touches)
                if touches:
                    self._real_device.point(played.place_mm if played else None)
                if moves and played is None and self._place_mm is not None:
                    assert isinstance(source, ComputedDrives)
                    played = await self._in_thread(source.solve, self._place_mm)
            except ChladniError as error:
                await self._sender.refuse(error, number)
                continue
            await self._send(number, played)

    async def _move(
        self, source: EmulatedFingers | ComputedDrives, moves: Sequence[Move]
    ) -> ComputedDrives:
        """Put parts elsewhere; what then answers. A part that may not be there changes nothing."""
        assert self.shown is not None
        computed = source if isinstance(source, ComputedDrives) else ComputedDrives(self.shown)
        await self._show(await self._in_thread(computed.move, moves), FROM_SOLVER, is_draft=True)
        return computed

    async def _show(self, prepared: Prepared, source: str, *, is_draft: bool = False) -> None:
        self.shown = prepared
        head = board_message(prepared, source, is_draft=is_draft)
        await self._sender.send(head, fields_bytes(prepared))

    async def _send(self, number: int, played: Played | None) -> None:
        if played is None:
            await self._sender.send({"type": "lifted", "number": number})
            return
        assert self.shown is not None
        self._place_mm = played.place_mm
        await self._sender.send(played_message(self.shown, number, played))
        if played.drive.any():  # fingers may all be silent
            self._scorer.put(number, self.shown, played)

    async def _in_thread(self, work: Callable[..., Result], *given: object) -> Result:
        return await asyncio.get_running_loop().run_in_executor(self._thread, work, *given)

    def close(self) -> None:
        """Play nothing more."""
        self._thread.shutdown(wait=False, cancel_futures=True)
