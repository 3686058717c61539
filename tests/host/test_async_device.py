"""The asynchronous device: many tasks, one wire, nothing mixed up."""

from __future__ import annotations

import asyncio
import threading
import time

import numpy as np
import pytest

from chladni.host.device.async_device import AsyncDevice
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.tables.format import pack
from made_up import make_table, powered, random_table

OLD = pack(make_table(np.array([[10.0, 1.0, 2.0, 3.0, 4.0]])))
BIG = pack(random_table(30, 20, 5, 3))


def test_two_devices_are_flashed_side_by_side_while_the_loop_goes_on() -> None:
    emulators = [powered(OLD), powered(OLD)]
    told: list[tuple[int, int, int]] = []
    turns = 0

    async def tick() -> None:
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    async def flash(number: int) -> bool:
        def progress(done: int, total: int) -> None:
            assert threading.current_thread() is threading.main_thread()
            told.append((number, done, total))

        async with AsyncDevice(lambda: EmulatorWire(emulators[number])) as device:
            return (await device.flash(BIG, progress)).verified

    async def main() -> list[bool]:
        ticking = asyncio.create_task(tick())
        done = await asyncio.gather(flash(0), flash(1))
        ticking.cancel()
        return list(done)

    assert asyncio.run(main()) == [True, True]
    for number in (0, 1):
        assert [step for step in told if step[0] == number][-1] == (number, len(BIG), len(BIG))
    # Far more as a rule, but a machine that is busy hands the loop few.
    assert turns > 3


def test_tasks_that_ask_at_once_each_get_their_own_answer() -> None:
    emulator = powered(OLD)

    async def main() -> None:
        async with AsyncDevice(lambda: EmulatorWire(emulator)) as device:
            answers = await asyncio.gather(
                *(device.info() if k % 2 else device.faults() for k in range(20))
            )
            assert all(isinstance(a, dict if k % 2 else list) for k, a in enumerate(answers))
            await device.touch(0.0, 0.0)
            await device.do(lambda blocking: blocking.link.wait(0.05))
            assert (await device.info())["state"] == "playing"
            await device.lift()
            wanted = (await device.config()).with_values(level_q15=999)
            await device.do(lambda blocking: blocking.link.wait(0.1))
            await device.set_config(wanted)
            await device.restart()
            await device.do(lambda blocking: blocking.link.wait(0.5))
            assert await device.config() == wanted

    asyncio.run(main())


def test_a_cancelled_task_leaves_the_device_usable() -> None:
    emulator = powered(OLD)

    async def main() -> None:
        async with AsyncDevice(lambda: EmulatorWire(emulator)) as device:
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(device.do(lambda d: d.link.wait(20.0)), 0.001)
            assert (await device.info())["table_status"] == "ok"

    asyncio.run(main())


def test_a_wire_that_is_opened_too_late_is_closed() -> None:
    closed = threading.Event()

    class Slow(EmulatorWire):
        def __init__(self) -> None:
            time.sleep(0.2)
            super().__init__(powered(OLD))

        def close(self) -> None:
            closed.set()

    async def main() -> None:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.02), AsyncDevice(Slow):
                pass

    asyncio.run(main())
    assert closed.wait(60.0)


def test_a_silent_port_is_said_on_entering() -> None:
    class Silent(EmulatorWire):
        def write(self, data: bytes) -> None:
            """Nothing gets through."""

    async def main() -> None:
        with pytest.raises(LinkError, match="no device answers"):
            async with AsyncDevice(lambda: Silent(powered(OLD))):
                pass
        with pytest.raises(RuntimeError, match="async with"):
            await AsyncDevice(lambda: EmulatorWire(powered(OLD))).info()

    asyncio.run(main())
