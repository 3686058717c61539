"""The emulated device on a pseudo-terminal: any program meets it as a serial port."""

from __future__ import annotations

import os
import select
import time
import tty
from collections.abc import Callable

from chladni.host.emulator import Emulator

STEP_S = 0.002


class Terminal:
    """A pseudo-terminal that an emulated device talks through, in real time.

    A pseudo-terminal has no baud rate: bytes take their virtual time on the emulator's wire.

    Attributes
    ----------
    port
        What to open, as `/dev/pts/3`.
    """

    def __init__(self, emulator: Emulator) -> None:
        self.emulator = emulator
        self._master, self._slave = os.openpty()
        # Kept open here: the other side may come and go.
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)

    def serve(self, until: Callable[[], bool]) -> None:
        """Run the device along with the clock until told to stop."""
        core = self.emulator.core
        begun, run_us = time.monotonic(), 0
        while not until():
            ready, _, _ = select.select([self._master], [], [], STEP_S)
            if ready:
                core.uart_write(os.read(self._master, 4096))
            due_us = int((time.monotonic() - begun) * 1e6)
            if due_us > run_us:
                core.run_us(due_us - run_us)
                run_us = due_us
            core.take_duties()
            data = core.uart_read()
            if data:
                os.write(self._master, data)

    def close(self) -> None:
        """Take the port away."""
        os.close(self._master)
        os.close(self._slave)
