"""The host's end of a network: requests in datagrams with a MAC, taken for a wire by the link.

A hello asks which session the device runs, once more with a cookie if the device wants one. Every
request after it names that session and a counter of its own. Whatever is lost is asked again by the
link, in a new datagram.
"""

from __future__ import annotations

import hmac
import secrets
import socket
import time
from dataclasses import dataclass
from typing import Protocol

from chladni.host.device.wires.link import FrameSplitter, encode
from chladni.host.device.wires.wire import STEP_MS, WireError
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.link import HEAD_BYTES
from chladni.host.protocol.network import (
    DATAGRAM_MAGIC,
    DEFAULT_PORT,
    HEAD,
    HELLO_BYTES,
    MAC_BYTES,
    MAX_DATAGRAM,
    RENEW_AT,
    SESSION,
    SESSION_SILENCE_MS,
    VERSION,
    Kind,
)
from chladni.sim.errors import ArgumentError

CHECK_NETWORK = "check the address, and that this machine is on the device's network"

HELLO_TRIES = 4
HELLO_WAIT_S = 0.25
"""For a welcome; doubled with every try."""
MOST_CHALLENGES = 4
"""Answered for one hello: whoever listens may send wrong ones, and the device its own."""
UNANSWERED = 2
"""Requests without an answer after which the device may have restarted: hello goes with them."""
STALE_S = SESSION_SILENCE_MS / 2e3
"""Without an answer for so long the session may be over: hello goes before the next request."""
NO_SESSION = 0
WINDOW_BITS = 32
ENDLESS_BAUD = 1e9
"""A network's bytes take no time that is worth waiting for."""


def seal(key: bytes, kind: Kind, counter: int, session: int, body: bytes) -> bytes:
    """A datagram."""
    data = HEAD.pack(DATAGRAM_MAGIC, VERSION, kind, counter, session) + body
    return data + hmac.digest(key, data, "sha256")[:MAC_BYTES]


@dataclass(frozen=True)
class Opened:
    """What a datagram says whose MAC is right."""

    kind: Kind
    counter: int
    session: int
    body: bytes


def unseal(key: bytes, data: bytes) -> Opened | None:
    """What a datagram says; None if it is none, or was not made with this key."""
    if not HEAD.size + MAC_BYTES <= len(data) <= MAX_DATAGRAM:
        return None
    signed, mac = data[:-MAC_BYTES], data[-MAC_BYTES:]
    if not hmac.compare_digest(hmac.digest(key, signed, "sha256")[:MAC_BYTES], mac):
        return None
    magic, version, kind, counter, session = HEAD.unpack_from(signed)
    if (magic, version) != (DATAGRAM_MAGIC, VERSION) or kind not in set(Kind):
        return None
    return Opened(Kind(kind), counter, session, signed[HEAD.size :])


def cookie_of(data: bytes, nonce: int) -> int | None:
    """What a challenge of the hello with this nonce asks for; None if it is none."""
    if len(data) != HEAD.size:
        return None
    magic, version, kind, cookie, session = HEAD.unpack(data)
    is_one = (magic, version, kind) == (DATAGRAM_MAGIC, VERSION, Kind.CHALLENGE)
    return int(cookie) if is_one and session == nonce else None


@dataclass
class ReplayWindow:
    """Which counters were taken; those up to 32 below the highest may still come."""

    highest: int = 0
    seen: int = 0

    def take(self, counter: int) -> bool:
        """Whether this one is new; then it no longer is."""
        ahead = counter - self.highest
        if counter == 0 or ahead <= -WINDOW_BITS or (ahead <= 0 and self.seen >> -ahead & 1):
            return False
        if ahead > 0:
            self.seen = (self.seen << ahead | 1) & (2**WINDOW_BITS - 1)
            self.highest = counter
        else:
            self.seen |= 1 << -ahead
        return True


class Port(Protocol):
    """Datagrams to one device and back; `name` is for people."""

    name: str

    def send(self, data: bytes) -> None:
        """One to the device."""

    def receive(self, timeout_s: float) -> bytes | None:
        """One from it; waits for it at most so long."""

    def now_s(self) -> float:
        """Seconds on the clock that timeouts are counted on."""

    def close(self) -> None:
        """Let go of it."""


class UdpPort:
    """A UDP socket that hears one device only.

    Parameters
    ----------
    address
        `HOST` or `HOST:PORT`.

    Raises
    ------
    InputError
        Not of that form.
    WireError
        No such host.
    """

    def __init__(self, address: str) -> None:
        host, _, port = address.partition(":")
        is_number = port.isascii() and port.isdigit()
        if not host or (port and not is_number) or not 0 < int(port or DEFAULT_PORT) < 2**16:
            raise ArgumentError("address", address, "HOST or HOST:PORT")
        self.name = address
        try:
            self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self.socket.connect((host, int(port or DEFAULT_PORT)))
        except OSError as error:
            raise WireError(f"{address}: {error.strerror or error}", hint=CHECK_NETWORK) from None

    def send(self, data: bytes) -> None:
        """One to the device."""
        try:
            self.socket.send(data)
        except ConnectionRefusedError:
            pass  # no one listens there yet: as if it had been lost
        except OSError as error:
            raise WireError(f"{self.name}: {error.strerror or error}", hint=CHECK_NETWORK) from None

    def receive(self, timeout_s: float) -> bytes | None:
        """One from it."""
        self.socket.settimeout(max(timeout_s, 1e-6))
        try:
            return self.socket.recv(2 * MAX_DATAGRAM)
        except (TimeoutError, BlockingIOError):
            return None
        except ConnectionRefusedError:
            time.sleep(min(max(timeout_s, 0.0), 0.01))
            return None
        except OSError as error:
            raise WireError(f"{self.name}: {error.strerror or error}", hint=CHECK_NETWORK) from None

    def now_s(self) -> float:
        """Seconds of this machine."""
        return time.monotonic()

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()


class EmulatedPort:
    """An emulated device's network; its clock is the emulator's own."""

    name = "the emulated device"

    def __init__(self, emulator: Emulator, peer: int = 0) -> None:
        self.emulator, self.peer = emulator, peer
        self._waiting: list[bytes] = []

    def send(self, data: bytes) -> None:
        """One to the device."""
        self.emulator.core.udp_write(data, self.peer)

    def receive(self, timeout_s: float) -> bytes | None:
        """One from it; the emulator runs on until there is one."""
        end = self.now_s() + timeout_s
        while True:
            sent = self.emulator.core.udp_read()
            self._waiting += [data for peer, data in sent if peer == self.peer]
            if self._waiting:
                return self._waiting.pop(0)
            if self.now_s() >= end:
                return None
            self.emulator.core.run_us(round(STEP_MS * 1e3))

    def now_s(self) -> float:
        """Virtual seconds."""
        return self.emulator.core.now_us / 1e6

    def close(self) -> None:
        """Nothing to let go of."""


class UdpWire:
    """A `Wire` over a network.

    Raises
    ------
    WireError
        No welcome came: no device there, or another key.
    """

    def __init__(self, port: Port, key: bytes) -> None:
        self.baud = ENDLESS_BAUD
        self.port = port
        self._key = key
        self._frames = FrameSplitter()
        self._nonce = 0
        self._challenges = 0
        self._session = NO_SESSION
        self._counter = 0
        self._answers = ReplayWindow()
        self._unanswered = 0
        self._heard_s = 0.0
        try:
            self._open()
        except WireError:
            port.close()
            raise

    def write(self, data: bytes) -> None:
        """Send frames, a datagram each."""
        for body in self._frames.feed(data):
            is_stale = self.now_s() - self._heard_s > STALE_S
            if self._counter >= RENEW_AT or (is_stale and self._unanswered == 0):
                self._open()
            elif self._unanswered >= UNANSWERED:
                self._greet()
            self._unanswered += 1
            self._counter += 1
            self.port.send(seal(self._key, Kind.REQUEST, self._counter, self._session, body))

    def read(self, timeout_s: float) -> bytes:
        """Answers that have come, as frames."""
        return self._take(self.port.receive(timeout_s))

    def now_s(self) -> float:
        """Seconds on the port's clock."""
        return self.port.now_s()

    def close(self) -> None:
        """Let go of it."""
        self.port.close()

    def _open(self) -> None:
        """A session, the one there is or another, before anything is asked."""
        wait = HELLO_WAIT_S
        for _ in range(HELLO_TRIES):
            nonce = self._greet()
            end = self.now_s() + wait
            while self.now_s() < end:
                self._take(self.port.receive(end - self.now_s()))
                if self._nonce != nonce:  # it was good for one welcome
                    return
            wait *= 2.0
        raise WireError(
            f"{self.port.name}: no device answers there",
            hint="is it on this network, and the key its own?",
        )

    def _greet(self) -> int:
        self._nonce = secrets.randbits(64)
        self._challenges = 0
        self._send_hello(0)
        return self._nonce

    def _send_hello(self, cookie: int) -> None:
        hello = seal(self._key, Kind.HELLO, cookie, self._nonce, SESSION.pack(self._session))
        assert len(hello) == HELLO_BYTES
        self.port.send(hello)

    def _take(self, data: bytes | None) -> bytes:
        """An answer as a frame; nothing for anything else."""
        cookie = None if data is None else cookie_of(data, self._nonce)
        if cookie is not None and self._challenges < MOST_CHALLENGES:
            self._challenges += 1
            self._send_hello(cookie)
        opened = None if data is None else unseal(self._key, data)
        if opened is None:
            return b""
        if opened.kind == Kind.WELCOME and opened.session == self._nonce:
            self._begin(opened.body)
            return b""
        is_answer = opened.kind == Kind.ANSWER and opened.session == self._session
        if not is_answer or len(opened.body) < HEAD_BYTES or not self._answers.take(opened.counter):
            return b""
        self._unanswered, self._heard_s = 0, self.now_s()
        return encode(opened.body[0], opened.body[1], opened.body[HEAD_BYTES:])

    def _begin(self, body: bytes) -> None:
        """Go on with the session the device names; from the beginning, if it is another."""
        if len(body) != SESSION.size:
            return
        (session,) = SESSION.unpack(body)
        if session != self._session:
            self._session, self._counter, self._answers = session, 0, ReplayWindow()
        # A nonce is good for one welcome.
        self._nonce = secrets.randbits(64)
        self._unanswered, self._heard_s = 0, self.now_s()
