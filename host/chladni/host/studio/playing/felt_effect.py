"""Effects that one page plays under a finger, and what fingers feel of them over time."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.effects.files import READERS, ReadEffect, read_effect
from chladni.host.emulation.felt_over_time import RATE_HZ
from chladni.host.emulation.over_frequency import Plates
from chladni.host.emulation.played_effect import PlayedEffect, play_effect
from chladni.host.studio.boards.prepared import Prepared, ReadyBoard
from chladni.host.studio.messages.requests import PlayEffect
from chladni.host.studio.messages.sender import Sender
from chladni.sim.errors import ArgumentError, ChladniError, InputError, MissingError
from chladni.sim.files import write_whole

FloatArray = NDArray[np.float64]
PROGRESS_S = 0.2
DIGITS = 4
"""Of a curve that is sent, a tenth of a nanometre."""


class EffectPlayer:
    """Plays effects of one page on emulated devices, one after the other.

    A board is solved over frequency with its first effect, which takes seconds, and kept.

    Parameters
    ----------
    sender
        To the page.
    """

    def __init__(self, sender: Sender) -> None:
        self._sender = sender
        self._has_news = asyncio.Event()
        # Of its own: what one page asks for takes no thread from another.
        self._thread = ThreadPoolExecutor(1, "effect")
        self._latest: tuple[PlayEffect, Prepared | None] | None = None
        self._plates: tuple[Prepared, Plates] | None = None

    def put(self, request: PlayEffect, shown: Prepared | None) -> None:
        """An effect that is asked for; one that waits makes room for it."""
        self._latest = request, shown
        self._has_news.set()

    async def follow(self) -> None:
        """Until it is cancelled."""
        while True:
            await self._has_news.wait()
            self._has_news.clear()
            if self._latest is None:
                continue
            request, shown = self._latest
            self._latest = None
            try:
                message = await self._with_progress(request, shown)
            except ChladniError as error:
                await self._sender.refuse(error, request.number)
                continue
            await self._sender.send(message)

    async def _with_progress(self, request: PlayEffect, shown: Prepared | None) -> dict[str, Any]:
        reached, told = [0, 0], [0, 0]

        def progress(done: int, of_all: int) -> None:
            reached[:] = done, of_all

        loop = asyncio.get_running_loop()
        found = loop.run_in_executor(self._thread, self._felt, request, shown, progress)
        while not found.done():
            if told != reached:
                told = list(reached)
                await self._sender.send(
                    {"type": "solving", "number": request.number, "done": told[0], "all": told[1]}
                )
            await asyncio.wait([found], timeout=PROGRESS_S)
        return found.result()

    def _felt(
        self, request: PlayEffect, shown: Prepared | None, progress: Callable[[int, int], None]
    ) -> dict[str, Any]:
        if not isinstance(shown, ReadyBoard):
            raise MissingError("table", "a board with its table", hint="build it first")
        read = _read(request)
        if self._plates is None or self._plates[0] is not shown:
            self._plates = shown, Plates.of(shown.board, progress=progress)
        played = play_effect(
            shown.table,
            shown.board,
            read.effect,
            request.at_mm,
            other_mm=request.other_mm,
            level=request.level,
            plates=self._plates[1],
        )
        return felt_message(request.number, read, played)

    def close(self) -> None:
        """Play nothing more."""
        self._thread.shutdown(wait=False, cancel_futures=True)


def _read(request: PlayEffect) -> ReadEffect:
    """The effect by its name, or from the bytes of a file that the page brought."""
    if request.data is None:
        return read_effect(request.name)
    ending = Path(request.name).suffix.lower()
    if ending not in READERS:
        raise ArgumentError("name", request.name, f"a name that ends in {', '.join(READERS)}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"effect{ending}"
        write_whole(path, request.data)
        try:
            return read_effect(path)
        except InputError as error:
            raise error.in_file(request.name) from None


def felt_message(number: int, read: ReadEffect, played: PlayedEffect) -> dict[str, Any]:
    """What a page draws of an effect; curves have `rate_hz` values a second, from the touch on."""
    return {
        "type": "felt",
        "number": number,
        "name": read.effect.name,
        "left_out": read.left_out,
        "rate_hz": RATE_HZ,
        "asked": _sent(played.asked),
        "own_um": _sent(played.own_um),
        "other_um": None if played.other_um is None else _sent(played.other_um),
        "peak_um": played.peak_um,
        "other_peak_um": played.other_peak_um,
        "just_felt_um": played.just_felt_um,
        "bias_um": played.bias_um,
        "first_ms": played.first_ms,
        "rise_ms": played.rise_ms,
        "envelope_error_db": played.envelope_error_db,
        "isolation_db": played.isolation_db,
    }


def _sent(values: FloatArray) -> Sequence[float]:
    own: list[float] = np.round(values, DIGITS).tolist()
    return own
