"""A device on an emulated network, and what speaks to it datagram by datagram."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chladni.host.device.streaming import StreamStep
from chladni.host.device.wires.udp import (
    EmulatedPort,
    seal,
    unseal,
)
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.network import (
    KEY_BYTES,
    SESSION,
    Kind,
    NetworkSettings,
)
from chladni.tables.format import pack
from made_up import make_table, powered, random_table

FRAME_HZ = 78_125 / 8
"""Of raw duties: carrier/8."""
KEY = bytes(range(1, KEY_BYTES + 1))
OTHER_KEY = bytes(KEY_BYTES - 1) + b"\1"
LAB = NetworkSettings("lab", "a passphrase", KEY)
OLD, NEW = (pack(make_table(np.array([[gain, 1.0, 2.0, 3.0, 4.0]]))) for gain in (10.0, 5.0))
BIG = pack(random_table(30, 20, 5, 3))


def networked() -> Emulator:
    """An emulated device on the network."""
    return powered(OLD, network=LAB)


def exchange(emulator: Emulator, *datagrams: bytes, apart: bool = False) -> list[bytes]:
    """What the device answers within 5 ms; `apart`, to sources of their own."""
    for k, data in enumerate(datagrams):
        emulator.core.udp_write(data, k if apart else 0)
    emulator.run(5.0)
    return [data for _, data in emulator.core.udp_read()]


def session_of(emulator: Emulator, known: int = 0) -> int:
    """The session that the device opens, or goes on with."""
    (welcome,) = exchange(emulator, seal(KEY, Kind.HELLO, 0, 99, SESSION.pack(known)))
    opened = unseal(KEY, welcome)
    assert opened is not None
    assert (opened.kind, opened.session) == (Kind.WELCOME, 99)
    return int(SESSION.unpack(opened.body)[0])


@dataclass
class Recorder:
    """A port that keeps what went either way, and may spoil it first."""

    inner: EmulatedPort
    spoil: Callable[[bytes], list[bytes]] = lambda data: [data]
    sent: list[bytes] = field(default_factory=list)
    got: list[bytes] = field(default_factory=list)
    name: str = "recorded"

    def send(self, data: bytes) -> None:
        """To the device."""
        self.sent.append(data)
        for part in self.spoil(data):
            self.inner.send(part)

    def receive(self, timeout_s: float) -> bytes | None:
        """From it."""
        data = self.inner.receive(timeout_s)
        if data is None:
            return None
        self.got.append(data)
        parts = self.spoil(data)
        return parts[0] if parts else None

    def now_s(self) -> float:
        """Virtual seconds."""
        return self.inner.now_s()

    def close(self) -> None:
        """Nothing."""


class UnpunctualPort(EmulatedPort):
    """A network whose host comes too late one time in ten, some way from the device, in s."""

    def __init__(self, emulator: Emulator, *, late_s: float = 0.0, way_s: float = 0.0) -> None:
        super().__init__(emulator)
        self.late_s, self.way_s = late_s, way_s
        self._rng = np.random.default_rng(7)

    def send(self, data: bytes) -> None:
        """One to the device."""
        self._pass(self.way_s)
        super().send(data)

    def receive(self, timeout_s: float) -> bytes | None:
        """One from it."""
        data = super().receive(timeout_s)
        if data is not None:
            self._pass(self.way_s)
        elif self._rng.random() < 0.1:
            self._pass(self.late_s)
        return data

    def _pass(self, seconds: float) -> None:
        self.emulator.core.run_us(round(seconds * 1e6))


def wave(seconds: float) -> NDArray[np.float64]:
    """Raw duties of five channels at 160 Hz, shape (frames, 5)."""
    t = np.arange(round(seconds * FRAME_HZ))[:, None] / FRAME_HZ
    return np.asarray(0.4 + 0.3 * np.sin(2.0 * np.pi * 160.0 * t + np.arange(5)))


def late_ms(steps: list[StreamStep]) -> NDArray[np.float64]:
    """How long the last frame of each piece takes from the host's call to the pins, at most.

    It waits for all before it in the ring, and the request's way is counted there and back.
    """
    return np.array([1e3 * (step.seconds + step.filled / FRAME_HZ) for step in steps])
