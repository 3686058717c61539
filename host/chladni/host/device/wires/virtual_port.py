"""The emulated device on a pseudo-terminal, and on UDP: any program meets it as hardware."""

from __future__ import annotations

import os
import select
import socket
import time
import tty
from collections.abc import Callable

from chladni.host.device.wires.wire import WireError
from chladni.host.emulation.emulator import Emulator
from chladni.host.emulation.flash_file import FlashFile

STEP_S = 0.001
LONGEST_STEP_US = 2_000
"""At once; what has come is handed over in between."""
MOST_BEHIND_US = 5_000
LOOPBACK = "127.0.0.1"
LARGEST = 2048
"""More than a datagram of the device's may be long."""


class LoopbackNetwork:
    """UDP on 127.0.0.1 for an emulated device, while that is on a network.

    Raises
    ------
    WireError
        Its port is taken.
    """

    def __init__(self, emulator: Emulator) -> None:
        self.emulator = emulator
        self.socket: socket.socket | None = None
        self._port = 0
        self._peers: list[tuple[str, int]] = []

    def follow(self) -> None:
        """Listen where the device does; it may have restarted."""
        port = self.emulator.core.network_port
        if port == self._port:
            return
        self.close()
        self._port = port
        if port == 0:
            return
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        try:
            self.socket.bind((LOOPBACK, port))
        except OSError as error:
            self.socket.close()
            self.socket = None
            raise WireError(
                f"UDP {LOOPBACK}:{port}: {error.strerror}", hint="choose another"
            ) from None

    def take(self) -> None:
        """What has come, to the device."""
        while self.socket is not None:
            try:
                data, peer = self.socket.recvfrom(LARGEST)
            except (BlockingIOError, ConnectionRefusedError):
                return
            if peer not in self._peers:
                self._peers.append(peer)
            self.emulator.core.udp_write(data, self._peers.index(peer))

    def give(self) -> None:
        """What the device has sent, to whom it is for."""
        for peer, data in self.emulator.core.udp_read():
            if self.socket is not None:
                self.socket.sendto(data, self._peers[peer])

    def close(self) -> None:
        """Listen no more."""
        if self.socket is not None:
            self.socket.close()
        self.socket = None


class VirtualPort:
    """A pseudo-terminal that an emulated device talks through, in real time.

    Once the device has a key for a network, it is also there, on 127.0.0.1.

    A pseudo-terminal has no baud rate: bytes take their virtual time on the emulator's wire.

    Parameters
    ----------
    flash
        Where it keeps its flash, if it is to outlast the process.

    Attributes
    ----------
    port
        What to open, as `/dev/pts/3`.
    """

    def __init__(self, emulator: Emulator, flash: FlashFile | None = None) -> None:
        self.emulator = emulator
        self._flash = flash
        self.network = LoopbackNetwork(emulator)
        self._master, self._slave = os.openpty()
        # Kept open here: the other side may come and go.
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)

    def serve(self, until: Callable[[], bool]) -> None:
        """Run the device along with the clock until told to stop."""
        core = self.emulator.core
        begun_s, is_behind = time.monotonic() - core.now_us / 1e6, False
        while not until():
            self.network.follow()
            listening = self.network.socket
            heard = [self._master] + ([listening.fileno()] if listening else [])
            ready, _, _ = select.select(heard, [], [], 0.0 if is_behind else STEP_S)
            self.network.take()
            if self._master in ready:
                core.uart_write(os.read(self._master, 4096))
            behind_us = int((time.monotonic() - begun_s) * 1e6) - core.now_us
            is_behind = behind_us > LONGEST_STEP_US
            if behind_us <= 0:
                continue  # an erase took longer than a step: what came of it is not out yet
            if behind_us > MOST_BEHIND_US:
                # This machine was busy elsewhere, and no host could reach the device: its clock
                # is late from now on, rather than that it leaps past what was on its way.
                begun_s += (behind_us - MOST_BEHIND_US) / 1e6
            core.run_us(min(behind_us, LONGEST_STEP_US))
            core.take_duties()
            if self._flash is not None:
                self._flash.follow(core)
            data = core.uart_read()
            if data:
                os.write(self._master, data)
            self.network.give()

    def close(self) -> None:
        """Take the port away."""
        self.network.close()
        os.close(self._master)
        os.close(self._slave)
