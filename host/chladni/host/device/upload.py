"""A file's way over the link: several pieces under way at once, and again what got lost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from chladni.effects.bank import layout as banks
from chladni.host.device.wires.link import (
    CHECK_WIRE,
    FIRST_WAIT_S,
    TRY_AGAIN,
    Answer,
    Link,
    LinkError,
    refusal,
)
from chladni.host.protocol.link import BY_NAME, MAX_PAYLOAD, WINDOW, Message, Status
from chladni.host.protocol.slot_store import SECTOR_BYTES
from chladni.tables import layout as tables

Progress = Callable[[int, int], None]

DATA_WAIT_S = 0.08
"""For an answer to a piece of a file beyond its time on the wire, before it is sent again: a
programme of 20 ms, a USB adapter's 16 ms twice, and slack. Doubled with every silence."""
ERASE_S = 0.5
"""A sector's erase at worst, and slack."""
MAX_SILENCES = 6
"""In a row, before the device is given up."""


@dataclass(frozen=True)
class FileKind:
    """A kind of file that a device keeps in two slots, and the requests that replace it."""

    name: str
    header_bytes: int

    @property
    def begin(self) -> Message:
        """Opens an update."""
        return BY_NAME[f"{self.name}_begin"]

    @property
    def data(self) -> Message:
        """Brings the next of it."""
        return BY_NAME[f"{self.name}_data"]


TABLES, BANKS = FileKind("table", tables.HEADER_BYTES), FileKind("bank", banks.HEADER.size)


@dataclass(frozen=True)
class Flashed:
    """What came of an update."""

    bytes: int
    slot: int
    seconds: float
    repeated: int
    verified: bool

    def check_verified(self) -> None:
        """Raise `LinkError` unless the device reports that it plays what was written."""
        if not self.verified:
            raise LinkError("the device does not report this file as its own", hint=TRY_AGAIN)


def upload(
    link: Link,
    kind: FileKind,
    data: bytes,
    in_use: Callable[[], tuple[int, int]],
    progress: Progress | None = None,
) -> Flashed:
    """Replace a file.

    Parameters
    ----------
    in_use
        CRC and bytes of the file that the device uses, as it reports them afterwards.

    Raises
    ------
    LinkError
        The device refused or fell silent; the old file stays.
    """
    begun, repeated = link.wire.now_s(), link.repeated
    Upload(link, kind, data, progress).run()
    slot = link.request(f"{kind.name}_commit").fields["slot"]
    verified = in_use() == (int.from_bytes(data[-4:], "little"), len(data))
    seconds = link.wire.now_s() - begun
    return Flashed(len(data), slot, seconds, link.repeated - repeated, verified)


class Upload:
    """Puts a file's bytes into the slot that is not in use; they are not committed here."""

    def __init__(
        self, link: Link, kind: FileKind, data: bytes, progress: Progress | None = None
    ) -> None:
        self._link, self._data, self._progress = link, data, progress
        self._begin, self._piece = kind.begin, kind.data
        self._request: dict[str, Any] = {
            "total": len(data),
            "crc": int.from_bytes(data[-4:], "little"),
        }
        self._head = data[: kind.header_bytes]
        self._due = 0
        """Bytes that the device has."""
        self._sent = 0
        self._waiting: dict[int, int] = {}
        """Offsets of the pieces under way, by their sequence numbers."""
        self._deadline = 0.0

    def run(self) -> None:
        """Send all of it.

        Raises
        ------
        LinkError
            The device refused or fell silent; the old file stays.
        """
        if not self._begin_with_data():
            self._link.repeated += len(self._waiting)
            self._waiting, self._sent, self._due = {}, 0, 0
            self._link.request(self._begin.name, self._head, **self._request)
        quiet = 0
        while self._due < len(self._data):
            self._fill_window(quiet)
            for code, sequence, answer in self._link.poll(self._deadline - self._link.wire.now_s()):
                if code == self._piece.code and sequence in self._waiting:
                    self._take(sequence, answer)
                    quiet = 0
            if self._due < len(self._data) and self._link.wire.now_s() >= self._deadline:
                quiet += 1
                if quiet > MAX_SILENCES:
                    raise LinkError(f"{self._piece.name}: no answer", hint=CHECK_WIRE)
                self._send_again()

    def _begin_with_data(self) -> bool:
        """Pieces right behind the first request: they travel while the device erases.

        False if it did not go as hoped, which costs no more than that time: the device was busy, or
        something got lost. Nothing is repeated here, since a second begin would erase again.
        """
        begin = self._link.send(self._begin, self._head, self._request)
        self._fill_window(0)
        sectors = -(-len(self._data) // SECTOR_BYTES)
        end = self._deadline + FIRST_WAIT_S + ERASE_S * sectors
        while self._link.wire.now_s() < end:
            answers = self._link.poll(end - self._link.wire.now_s())
            for k, (code, sequence, answer) in enumerate(answers):
                if code == self._piece.code and sequence in self._waiting:
                    return False
                if (code, sequence) != (self._begin.code, begin):
                    continue
                if answer.status == Status.REFUSED:
                    raise refusal(self._begin.name, answer)
                if answer.status != Status.OK:
                    return False
                for also, number, piece in answers[k + 1 :]:
                    if also == self._piece.code and number in self._waiting:
                        self._take(number, piece)
                self._wait_for_data(0)
                return True
        return False

    def _fill_window(self, quiet: int) -> None:
        while len(self._waiting) < WINDOW and self._sent < len(self._data):
            piece = self._data[self._sent : self._sent + MAX_PAYLOAD]
            number = self._link.send(self._piece, piece, {"offset": self._sent})
            self._waiting[number] = self._sent
            self._sent += len(piece)
            self._wait_for_data(quiet)

    def _wait_for_data(self, quiet: int) -> None:
        self._deadline = self._link.wire.now_s() + DATA_WAIT_S * 2.0**quiet
        self._deadline += self._link.wire_time((MAX_PAYLOAD + 64) * (len(self._waiting) + 1))

    def _take(self, sequence: int, answer: Answer) -> None:
        """What the device says of a piece."""
        if answer.status not in (Status.OK, Status.WRONG_OFFSET):
            raise refusal(self._piece.name, answer)
        # More than was sent, if this file broke off before: the device goes on where that ended.
        self._due = max(self._due, answer.fields["next"])
        self._sent = max(self._sent, self._due)
        self._waiting.pop(sequence)
        # What the device has counts as answered, whether or not its answer came.
        self._waiting = {s: at for s, at in self._waiting.items() if at >= self._due}
        if answer.status == Status.WRONG_OFFSET:
            # A piece before this one was lost: from there again, and at once.
            self._link.repeated += 1
            self._send_again()
        if self._progress:
            self._progress(self._due, len(self._data))

    def _send_again(self) -> None:
        self._link.repeated += len(self._waiting)
        self._waiting, self._sent = {}, self._due
