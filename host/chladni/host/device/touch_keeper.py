"""A touch that a host keeps alive.

A device ends a touch whose host says nothing for `TOUCH_SILENCE_MS`, as a killed one does: a thread
says something meanwhile.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator

from chladni.host.device.wires.link import KEEP_ALIVE_S, Link, LinkError
from chladni.host.device.wires.udp import UdpPort, UdpWire
from chladni.host.device.wires.wire import SerialWire, Wire
from chladni.sim.errors import ChladniError


class TouchKeeper:
    """Keeps a link's touch alive from `begin` to `end`.

    Where time passes in the wire's own calls, as an emulated device's does, `Link.wait` does that.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._ended = threading.Event()
        self._ended.set()

    @property
    def is_holding(self) -> bool:
        """Whether a touch is held."""
        return self._link.holds_touch

    def begin(self) -> None:
        """Keep a touch alive, the same one if there is one."""
        self._link.holds_touch = True
        if self._ended.is_set() and _passes_by_itself(self._link.wire):
            self._ended = threading.Event()
            # It ends with the program, and the touch does soon after.
            threading.Thread(target=self._run, args=(self._ended,), daemon=True).start()

    @contextlib.contextmanager
    def beginning(self) -> Iterator[None]:
        """Keep a touch alive that is asked for within; not if it is refused, and none was held.

        Before it is asked for: what interrupts that finds a touch to be lifted.
        """
        was_holding = self.is_holding
        self.begin()
        try:
            yield
        except LinkError:
            if not was_holding:
                self.end()
            raise

    def end(self) -> None:
        """Let it go."""
        self._link.holds_touch = False
        self._ended.set()

    def _run(self, ended: threading.Event) -> None:
        try:
            while not ended.wait(KEEP_ALIVE_S / 2.0):
                self._link.keep_alive()
        except ChladniError:
            pass  # the wire is gone; whoever asks next hears of it


def _passes_by_itself(wire: Wire) -> bool:
    """Whether time passes on a wire while nothing is done with it."""
    if isinstance(wire, UdpWire):
        return isinstance(wire.port, UdpPort)
    return isinstance(wire, SerialWire)
