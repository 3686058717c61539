"""A device for programs that run on an event loop: the same requests, awaited."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from chladni.host.device.device import Device
from chladni.host.device.device_effects import TURN_S, AreaEvent
from chladni.host.device.stream_sources import PlayedSignal
from chladni.host.device.upload import Flashed, Progress
from chladni.host.device.wires.wire import Wire
from chladni.host.protocol.config import DeviceConfig
from chladni.tables.table import Table

if TYPE_CHECKING:
    from chladni.effects.effect import Effect

FloatArray = NDArray[np.float64]
T = TypeVar("T")


class AsyncDevice:
    """`Device`, with its requests made by a thread of its own, one after another.

    An asynchronous context manager: the wire is opened on entering and closed on leaving. A task
    that is cancelled while it waits leaves its request to end by itself; the next one waits for it.

    Parameters
    ----------
    open_wire
        Opens the way to the device, such as ``lambda: SerialWire("/dev/ttyUSB0")``.

    Raises
    ------
    LinkError, WireError
        On entering, and as `Device` does.
    """

    def __init__(self, open_wire: Callable[[], Wire]) -> None:
        self._open = open_wire
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="chladni-device")
        self._device: Device | None = None
        self._opened: Device | None = None

    async def __aenter__(self) -> Self:
        try:
            self._device = await self._run(self._enter)
        except BaseException:
            # Who is cancelled does not wait, but what has been opened meanwhile is closed.
            self._thread.submit(self._close_late)
            self._thread.shutdown(wait=False)
            raise
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            await self.do(lambda device: device.close())
        finally:
            self._thread.shutdown(wait=False)

    def _enter(self) -> Device:
        self._opened = Device(self._open())
        return self._opened

    def _close_late(self) -> None:
        if self._opened is not None:
            self._opened.close()

    async def do(self, work: Callable[[Device], T]) -> T:
        """Whatever a `Device` can do, such as ``do(lambda device: device.network())``."""
        device = self._device
        if device is None:
            raise RuntimeError("an AsyncDevice is used within `async with`")
        return await self._run(lambda: work(device))

    async def _run(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)

    async def info(self) -> dict[str, Any]:
        """See `Device.info`, as for all that follow."""
        return await self.do(Device.info)

    async def faults(self) -> list[dict[str, Any]]:
        """The last faults, oldest first."""
        return await self.do(Device.faults)

    async def touch(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Hold a finger there until `lift`; the place that plays."""
        return await self.do(lambda device: device.touch(x_mm, y_mm))

    async def lift(self) -> float:
        """Let go; how long it played, s."""
        return await self.do(Device.lift)

    async def play(
        self, effect: Effect | str | Path, at: tuple[float, float], **level: Any
    ) -> PlayedSignal:
        """Play an effect under a finger; returns once it is over."""
        return await self.do(lambda device: device.play(effect, at, **level))

    async def stream_signal(
        self,
        signal: FloatArray | Iterable[FloatArray],
        at: tuple[float, float],
        *,
        rate_hz: float,
        **level: Any,
    ) -> PlayedSignal:
        """Play a live signal under a finger; its rows are asked for in the device's own thread."""
        return await self.do(
            lambda device: device.stream_signal(signal, at, rate_hz=rate_hz, **level)
        )

    async def area_events(self) -> AsyncIterator[AreaEvent]:
        """What fingers do on the effect bank's areas, as it comes: ``async for``."""
        while True:
            for event in await self.do(lambda device: device.effects.events()):
                yield event
            await asyncio.sleep(TURN_S)

    async def live(
        self, gains: Sequence[complex], frequency_hz: float, waveform: str = "sine"
    ) -> None:
        """Play a drive until it is no longer repeated."""
        await self.do(lambda device: device.live(gains, frequency_hz, waveform))

    async def stream(self, duties: NDArray[np.float64], *, is_signed: bool | None = None) -> int:
        """Play raw duties; returns when the last has been taken."""
        return await self.do(lambda device: device.stream(duties, is_signed=is_signed))

    async def stop(self) -> None:
        """End a live drive or a stream."""
        await self.do(Device.stop)

    async def flash(
        self, table: Table | bytes, progress: Progress | None = None, *, force: bool = False
    ) -> Flashed:
        """Write a table; `progress` is called on the event loop."""
        told = progress
        if progress is not None:
            loop, call = asyncio.get_running_loop(), progress

            def told(done: int, total: int) -> None:
                loop.call_soon_threadsafe(call, done, total)

        return await self.do(lambda device: device.flash(table, told, force=force))

    async def previous(self) -> int:
        """Go back to the other slot's table."""
        return await self.do(Device.previous)

    async def config(self) -> DeviceConfig:
        """The configuration in force."""
        return await self.do(Device.config)

    async def set_config(self, config: DeviceConfig, *, change_driver: bool = False) -> None:
        """Keep a configuration for the next start."""
        await self.do(lambda device: device.set_config(config, change_driver=change_driver))

    async def restart(self) -> None:
        """Restart the device."""
        await self.do(Device.restart)
