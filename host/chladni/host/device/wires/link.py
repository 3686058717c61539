"""The host's end of the link: frames, repetition, and several requests under way at once."""

from __future__ import annotations

import contextlib
import struct
import threading
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from cobs import cobs

from chladni.host.device.wires.wire import Wire
from chladni.host.protocol.codes import BANK_STATUS, CONFIG_STATUS, TABLE_STATUS
from chladni.host.protocol.link import (
    BY_NAME,
    CRC_BYTES,
    HEAD_BYTES,
    MAX_FRAME,
    RESPONSE,
    STATUS_TEXT,
    TOUCH_SILENCE_MS,
    VERSION_MAJOR,
    VERSION_MINOR,
    Message,
    Status,
)
from chladni.sim.errors import ChladniError

TRIES = 6
GREETING_TRIES = 4
FIRST_WAIT_S = 0.25
"""For an answer, beyond the time both frames need on the wire; doubled with every try."""
BUSY_WAIT_S = 0.02
BUSY_FOR_S = 3.0
LOG_BYTES = 64 * 1024
KEEP_ALIVE_S = TOUCH_SILENCE_MS / 4e3
"""Three of these may get lost before a touch ends."""
BRIEF_TRIES, BRIEF_WAIT_S = 2, 0.1
"""Of what must not take long: 0.3 s where no device answers."""


CHECK_WIRE = "check the cable, and that nothing else talks to the device"
TRY_AGAIN = "try again, or restart the device"
REMEDIES = {
    Status.BUSY: TRY_AGAIN,
    Status.UNKNOWN: "give the device newer firmware",
    Status.OTHER_DRIVER: "update chladni on this computer, and use the device's own board file",
    Status.MALFORMED: "give device and host the same version",
    Status.INCOMPATIBLE: "give device and host the same version",
    Status.WRONG_OFFSET: TRY_AGAIN,
    Status.TOO_LARGE: "build a table with a larger pitch or fewer bits",
    Status.FLASH_FAILED: TRY_AGAIN,
    Status.REFUSED: "`chladni device info` shows its state",
    Status.NOT_BEGUN: TRY_AGAIN,
    Status.NO_OTHER: "flash a table",
    Status.NOT_NOW: "`chladni device info` shows its state",
    Status.TOO_OFTEN: "wait a minute",
    Status.NO_PARTITION: "write the partition table again, with PlatformIO's `upload`",
    Status.NOT_WIRED: "`chladni device config set --from BOARD`, of a board file with [sensing]",
}
"""What to do where the device did not do what it was asked for."""


REASON_REMEDIES = {
    "no drives for that frequency": "`chladni table show` names a table's frequencies, and "
    "`chladni table build --frequency` builds one with others",
}
"""The same, by the reason that the device gives, where there is more to say."""


class LinkError(ChladniError):
    """The device did not answer, or refused."""

    def __init__(self, text: str, status: Status | None = None, *, hint: str = "") -> None:
        super().__init__(text, hint=hint)
        self.status = status


@dataclass(frozen=True)
class Answer:
    """What a device says to a request."""

    status: Status
    fields: dict[str, Any]
    tail: bytes


def encode(kind: int, sequence: int, payload: bytes) -> bytes:
    """A frame as it goes onto the wire."""
    body = bytes([kind, sequence]) + payload
    return b"\0" + bytes(cobs.encode(body + struct.pack("<I", zlib.crc32(body)))) + b"\0"


def decode(coded: bytes) -> bytes | None:
    """Kind, sequence and payload of what stood between two zeros; None if it is no frame."""
    try:
        body = bytes(cobs.decode(coded))
    except cobs.DecodeError:
        return None
    if not HEAD_BYTES + CRC_BYTES <= len(body) <= MAX_FRAME + CRC_BYTES:
        return None
    body, crc = body[:-CRC_BYTES], body[-CRC_BYTES:]
    return body if struct.pack("<I", zlib.crc32(body)) == crc else None


@dataclass
class FrameSplitter:
    """Frames out of a stream of bytes; what is none of them is text."""

    text: bytearray = field(default_factory=bytearray)
    damaged: int = 0
    _rest: bytes = b""

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Whole frames, as `decode` gives them, in order."""
        parts = (self._rest + data).split(b"\0")
        self._rest = parts.pop()[-2 * MAX_FRAME :]
        for part in parts:
            body = decode(part) if part else None
            if body is not None:
                yield body
            elif part:
                self.damaged += 1
                self._keep(part)
        # A line of text; an answer's second byte has its top bit set.
        if self._rest.endswith(b"\n") and len(self._rest) > 1 and max(self._rest) < RESPONSE:
            self._keep(self._rest)
            self._rest = b""

    def _keep(self, text: bytes) -> None:
        self.text += text
        del self.text[:-LOG_BYTES]


class Link:
    """Requests to a device and its answers.

    Every request is repeated until it is answered, with waits that double; the device does none
    twice.

    Attributes
    ----------
    holds_touch
        Whether the device is to go on with a touch: it ends one whose host says nothing for long.
    lock
        Held while something is asked, for a touch is kept alive by a thread of its own.
    """

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        self.splitter = FrameSplitter()
        self.repeated = 0
        self._sequence = 0
        self._said_s = 0.0
        self.holds_touch = False
        self.lock = threading.RLock()

    def request(
        self,
        name: str,
        tail: bytes = b"",
        *,
        tries: int = TRIES,
        first_wait_s: float = FIRST_WAIT_S,
        **fields: Any,
    ) -> Answer:
        """Send a request, `tries` times at most, and wait for its answer.

        The first wait is for `first_wait_s` beyond the time on the wire; it doubles every time.

        Raises
        ------
        LinkError
            No answer, or a status that is not ok.
        """
        end = self.wire.now_s() + BUSY_FOR_S
        while True:
            with self.lock:
                answer = self._ask(BY_NAME[name], tail, fields, tries, first_wait_s)
            if answer.status != Status.BUSY:
                break
            if self.wire.now_s() > end:
                raise LinkError(f"{name}: the device stays busy", Status.BUSY, hint=TRY_AGAIN)
            self.wait(BUSY_WAIT_S)
        if answer.status != Status.OK:
            raise refusal(name, answer)
        return answer

    def _ask(
        self, message: Message, tail: bytes, fields: dict[str, Any], tries: int, wait: float
    ) -> Answer:
        sequence = self.send(message, tail, fields)
        frame = _frame(message, sequence, tail, fields)
        for attempt in range(tries):
            if attempt > 0:
                self.wire.write(frame)
                self.repeated += 1
            end = self.wire.now_s() + wait + self.wire_time(len(frame) + MAX_FRAME)
            while self.wire.now_s() < end:
                for code, number, answer in self.poll(end - self.wire.now_s()):
                    if (code, number) == (message.code, sequence):
                        return answer
            wait *= 2.0
        raise LinkError(f"{message.name}: no answer", hint=CHECK_WIRE)

    def send(self, message: Message, tail: bytes, fields: dict[str, Any]) -> int:
        """Put a request onto the wire; returns its sequence number."""
        self._sequence = self._sequence % 255 + 1
        self._said_s = self.wire.now_s()
        self.wire.write(_frame(message, self._sequence, tail, fields))
        return self._sequence

    def poll(self, timeout_s: float) -> list[tuple[int, int, Answer]]:
        """Answers that have come: (message's code, sequence, answer)."""
        found = []
        for body in self.splitter.feed(self.wire.read(timeout_s)):
            answer = _answer(body)
            if answer is not None:
                found.append(answer)
        return found

    def wire_time(self, count: int) -> float:
        """Seconds that bytes take on the wire."""
        return count * 10.0 / self.wire.baud

    def wait(self, seconds: float) -> None:
        """Let time pass; what comes meanwhile is no answer to anything. A touch goes on."""
        end = self.wire.now_s() + seconds
        while self.wire.now_s() < end:
            with self.lock:
                self.keep_alive()
                left = end - self.wire.now_s()
                self.poll(min(left, KEEP_ALIVE_S) if self.holds_touch else left)

    def keep_alive(self) -> None:
        """Say something, if a touch is held and nothing was said for a while."""
        with self.lock:
            is_due = self.wire.now_s() - self._said_s >= KEEP_ALIVE_S
            if self.holds_touch and is_due:
                # A device that is mute is found out by who asks it for something.
                with contextlib.suppress(LinkError):
                    self.request(
                        "hello",
                        tries=BRIEF_TRIES,
                        first_wait_s=BRIEF_WAIT_S,
                        major=VERSION_MAJOR,
                        minor=VERSION_MINOR,
                    )


STATUSES = (
    ("table_status", TABLE_STATUS),
    ("bank_status", BANK_STATUS),
    ("config_status", CONFIG_STATUS),
)
"""Fields in which a device says what became of a file."""


def refusal(name: str, answer: Answer) -> LinkError:
    """Why the device did not do what it was asked for, in its own words where it gave some."""
    reasons = [
        codes.text(answer.fields[field]) for field, codes in STATUSES if answer.fields.get(field)
    ]
    refused = answer.status == Status.REFUSED and reasons
    why = f"the device refuses it: {reasons[0]}" if refused else STATUS_TEXT[answer.status]
    hint = REASON_REMEDIES.get(reasons[0] if refused else "", REMEDIES[answer.status])
    return LinkError(f"{name}: {why}", answer.status, hint=hint)


def _frame(message: Message, sequence: int, tail: bytes, fields: dict[str, Any]) -> bytes:
    values = [fields[f.name] for f in message.request]
    if len(values) != len(fields):
        raise TypeError(f"{message.name}: no such field among {sorted(fields)}")
    packed = struct.pack("<" + "".join(f.code for f in message.request), *values)
    return encode(message.code, sequence, packed + tail)


def _answer(body: bytes) -> tuple[int, int, Answer] | None:
    """An answer's kind, sequence and content; None for what is none."""
    code = body[0] & ~RESPONSE
    message = next((m for m in BY_NAME.values() if m.code == code), None)
    if message is None or not body[0] & RESPONSE or len(body) <= HEAD_BYTES:
        return None
    try:
        status = Status(body[HEAD_BYTES])
    except ValueError:
        return None
    content = body[HEAD_BYTES + 1 :]
    form = struct.Struct("<" + "".join(f.code for f in message.answer))
    fields: dict[str, Any] = {}
    if len(content) >= form.size:
        values = list(form.unpack_from(content))
        for f in message.answer:
            taken, values = values[: f.count], values[f.count :]
            fields[f.name] = taken[0] if f.count == 1 else tuple(taken)
        content = content[form.size :]
    elif status == Status.OK:
        return None
    return code, body[1], Answer(status, fields, content)
