"""The board of one page: made ready when it is chosen, shown, and played until the next one."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from starlette.websockets import WebSocketDisconnect

from chladni.drives.methods import METHODS
from chladni.drives.objectives import OBJECTIVES
from chladni.effects.files import shipped_effects
from chladni.host.studio.boards.builder import BoardBuilder
from chladni.host.studio.boards.catalogue import Catalogue
from chladni.host.studio.boards.prepared import BoardChoice, Prepared
from chladni.host.studio.messages.sender import Sender
from chladni.host.studio.playing.device_port import ports
from chladni.host.studio.playing.player import Player
from chladni.sim.board.board import Board
from chladni.sim.errors import ChladniError

PROGRESS_S = 0.2


class PageBoard:
    """Makes ready what one page chooses, and lets the player have it.

    Parameters
    ----------
    sender
        To the page.
    player
        Plays the board once it is ready.
    builder, catalogue
        Shared by all pages.
    known_ports
        Serial ports that a page may choose besides those with a USB bridge.
    """

    def __init__(
        self,
        sender: Sender,
        player: Player,
        builder: BoardBuilder,
        catalogue: Catalogue,
        known_ports: Sequence[str],
    ) -> None:
        self._sender, self._player = sender, player
        self._builder, self._catalogue, self._known_ports = builder, catalogue, known_ports
        self._choice = catalogue.first
        self._before: BoardChoice | None = None
        self._serving: asyncio.Task[None] | None = None

    @property
    def board(self) -> Board:
        """The one that is shown, or that is made ready."""
        shown = self._player.shown
        return shown.board if shown else self._choice.board

    async def start(self, choice: BoardChoice) -> None:
        """Go over to a board."""
        await self.stop()
        self._player.forget()
        await self._hello(choice)
        self._serving = asyncio.create_task(self._serve(choice))

    async def stop(self) -> None:
        """Play no board."""
        if self._serving is not None:
            self._serving.cancel()
            await asyncio.gather(self._serving, return_exceptions=True)

    async def _hello(self, choice: BoardChoice) -> None:
        """Tell what there is to choose from, and what is chosen."""
        self._choice = choice
        await self._sender.send(
            {
                "type": "hello",
                "boards": self._catalogue.names,
                "specs": self._catalogue.specs,
                "ports": ports(self._known_ports),
                "objectives": list(OBJECTIVES),
                "methods": list(METHODS),
                "effects": list(shipped_effects()),
                "board": choice.board.name,
                "objective": choice.objective,
                "method": choice.method,
                "frequency_hz": choice.board.drive.frequency_hz,
            }
        )

    async def _serve(self, choice: BoardChoice) -> None:
        try:
            ready, refusal = await self._ready_or_before(choice)
            if ready is not None:
                self._before = ready.choice
                await self._player.show(ready)
            if refusal is not None:
                await self._sender.refuse(refusal)
            if ready is not None:
                await self._player.play(ready)
        except (WebSocketDisconnect, RuntimeError):
            pass  # the page has gone, and the session hears of it

    async def _ready_or_before(
        self, choice: BoardChoice
    ) -> tuple[Prepared | None, ChladniError | None]:
        """A board, or if that cannot be made the one before it and why."""
        try:
            return await self._ready(choice), None
        except ChladniError as error:
            if self._before is None:
                return None, error
            await self._hello(self._before)
            return await self._ready(self._before), error

    async def _ready(self, choice: BoardChoice) -> Prepared:
        """The board, with progress while it is made."""
        build = self._builder.build(choice)
        try:
            result, told = asyncio.wrap_future(build.result), None
            # A page that goes elsewhere does not ask how this build ended.
            result.add_done_callback(lambda ended: ended.cancelled() or ended.exception())
            while not result.done():
                if told != (build.done, build.all):
                    told = build.done, build.all
                    await self._sender.send(
                        {
                            "type": "progress",
                            "board": choice.board.name,
                            "done": told[0],
                            "all": told[1],
                        }
                    )
                await asyncio.wait([result], timeout=PROGRESS_S)
            return result.result()
        finally:
            self._builder.leave(build)
