"""Work that takes long keeps what it has done beside its output, and goes on from there.

Lines with a checksum and not SQLite: SQLite follows links, writes a journal beside the file, does
not notice a changed bit outside of rows that have a checksum of ours, and took 2.3 ms a result
where a line takes 0.07.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import math
import os
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO

from chladni.sim.errors import InputError
from chladni.sim.files import open_regular

Result = dict[str, Any]
"""Finite numbers, texts and lists of them. JSON keeps floating-point numbers to the last bit."""
MAGIC = b"chladni-checkpoint-1 "
"""With this every file begins that was written here; no other is ever written to."""
MOST_BYTES = 512_000_000
"""Of a file; the largest table's drives take 30 million."""
MOST_LINE_BYTES = 1_000_000
"""One target's rows by all methods take 6,000."""
FIELD = "checkpoint"


class Checkpoint(contextlib.AbstractContextManager["Checkpoint"]):
    """Finished results by name, one line each, appended as they come.

    Parameters
    ----------
    path
        The file; None keeps results in memory only.
    key
        All that the results depend on: a board's whole document, and options. A file with another
        key, or of another version of Chladni, is from other work: `has_other_work` says so, and the
        first result takes its place.
    is_result
        Whether a result is one that this work writes; all are by default.

    Raises
    ------
    InputError
        On entering: something stands there that is no checkpoint, or one that was changed, or
        another process works with it. It is left as it is.
    OSError
        It cannot be written. What was kept before stays, and nothing where there was nothing.

    Notes
    -----
    A line is the CRC-32 of all lines up to its own, a blank, and JSON; the first one, behind
    `MAGIC`, holds the key. The file stays if there is a result in it, also when the work is done:
    what was made of it is still to be written, and who wrote that calls `remove_checkpoint`. A last
    line that was torn when the work was cut off is dropped at the next start. A link is not
    followed: the name is made of the output's, so in a folder that others write to they could lay
    one there beforehand.
    """

    def __init__(
        self, path: Path | None, key: Result, is_result: Callable[[Any], bool] = lambda _: True
    ) -> None:
        self._path = path
        # As JSON gives it back: lists and not tuples.
        self._key = json.loads(json.dumps({"chladni": version("chladni"), **key}))
        self._is_result = is_result
        self._done: dict[str, Result] = {}
        self._file: BinaryIO | None = None
        self._crc = 0
        self.has_other_work = False
        self._is_begun = False  # what was in the file is gone, and there is no result yet

    def __enter__(self) -> Checkpoint:
        if self._path is None:
            return self
        handle = open_regular(self._path, FIELD, os.O_RDWR | os.O_CREAT, follow=False)
        self._file = os.fdopen(handle, "r+b", buffering=0)
        try:
            self._lock()
            whole = self._read()
            if self.has_other_work:
                pass  # Whoever is told of it may still stop, and lose nothing.
            elif whole == 0:
                self._begin()
            else:
                self._file.truncate(whole)
                self._file.seek(whole)
        except BaseException:
            self._leave(is_empty=self._is_begun)
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._leave(is_empty=not self._done and not self.has_other_work)

    def get(self, name: str) -> Result | None:
        """A finished result."""
        return self._done.get(name)

    def count(self, beginning: str) -> int:
        """How many results have names that begin so."""
        return sum(name.startswith(beginning) for name in self._done)

    def put(self, name: str, result: Result) -> Result:
        """Keep a result.

        Raises
        ------
        ValueError
            A number in it is not finite.
        OSError
            It cannot be written; those before it are kept.
        """
        if self.has_other_work:
            self._begin()
        self._write(b"", {"name": name, "result": result})
        self._done[name] = result
        return result

    def part(self, name: str) -> Part:
        """One of several works whose results have the same names."""
        return Part(self, name)

    def _leave(self, *, is_empty: bool) -> None:
        if self._file is None or self._path is None:
            return
        with self._file:
            # Only what was opened: another file may have come to be there.
            own = os.fstat(self._file.fileno())
            with contextlib.suppress(OSError):
                if is_empty and os.path.samestat(own, os.lstat(self._path)):
                    self._path.unlink()

    def _lock(self) -> None:
        assert self._file is not None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise self._refused("in use", "one that no other process writes to") from None
        except OSError:
            pass  # A file system without locks.

    def _begin(self) -> None:
        assert self._file is not None
        self._done, self._crc, self._is_begun, self.has_other_work = {}, 0, True, False
        self._file.seek(0)
        self._file.truncate()
        self._write(MAGIC, self._key)

    def _write(self, mark: bytes, line: Result) -> None:
        if self._file is None:
            return
        text = json.dumps(line, allow_nan=False).encode()
        crc = zlib.crc32(text, self._crc)
        data, begun = mark + f"{crc:08x} ".encode() + text + b"\n", self._file.tell()
        try:
            while data:
                data = data[self._file.write(data) :]
        except OSError as error:
            # A part of the line, where the disk is full, would be in the way of what comes later.
            self._file.truncate(begun)
            self._file.seek(begun)
            raise OSError(error.errno, error.strerror, str(self._path)) from None
        self._crc = crc

    def _read(self) -> int:
        """Take what was kept; bytes up to the last whole line, 0 to begin again.

        Raises
        ------
        InputError
            It was not written here, or was changed since.
        """
        assert self._file is not None
        size = os.fstat(self._file.fileno()).st_size
        if size > MOST_BYTES:
            raise self._refused(f"{size:,} bytes", f"at most {MOST_BYTES:,}")
        with open(self._file.fileno(), "rb", closefd=False) as file:
            head = file.readline(MOST_LINE_BYTES)
            is_torn = len(head) == size and not head.endswith(b"\n")
            if is_torn and (head.startswith(MAGIC) or MAGIC.startswith(head)):
                return 0  # Empty, or cut off before there was a result.
            if not head.startswith(MAGIC):
                raise self._refused("another file", "one that this program wrote")
            if self._parsed(head.removeprefix(MAGIC), 1) != self._key:
                self.has_other_work = True
                return 0
            whole = len(head)
            for number, line in enumerate(iter(lambda: file.readline(MOST_LINE_BYTES), b""), 2):
                if not line.endswith(b"\n") and whole + len(line) == size:
                    break
                entry = self._parsed(line, number)
                if not self._is_entry(entry):
                    raise self._refused(f"line {number}", "a result of this work, once")
                self._done[entry["name"]] = entry["result"]
                whole += len(line)
        return whole

    def _parsed(self, line: bytes, number: int) -> Any:
        crc, _, text = line.rstrip(b"\n").partition(b" ")
        self._crc = zlib.crc32(text, self._crc)
        if crc != f"{self._crc:08x}".encode():
            raise self._refused(f"line {number}", "one that no one changed: its CRC-32 differs")
        try:
            return json.loads(text)
        except (ValueError, RecursionError):
            raise self._refused(f"line {number}", "JSON") from None

    def _is_entry(self, entry: Any) -> bool:
        if not isinstance(entry, dict) or entry.keys() != {"name", "result"}:
            return False
        name, result = entry["name"], entry["result"]
        is_own = isinstance(name, str) and name not in self._done and isinstance(result, dict)
        return is_own and are_finite(result) and self._is_result(result)

    def _refused(self, found: str, expected: str) -> InputError:
        hint = "it is left as it is: move it away, or write to another name"
        return InputError(FIELD, found, expected, file=str(self._path), hint=hint)


@dataclass(frozen=True)
class Part:
    """Results of one of several works that share a checkpoint, by name."""

    whole: Checkpoint
    name: str

    def get(self, name: str) -> Result | None:
        """A finished result."""
        return self.whole.get(f"{self.name} {name}")

    def put(self, name: str, result: Result) -> Result:
        """Keep a result; raises what `Checkpoint.put` does."""
        return self.whole.put(f"{self.name} {name}", result)


def remove_checkpoint(path: Path | None) -> None:
    """Remove the checkpoint of work whose last file is written; nothing that is no checkpoint."""
    if path is None:
        return
    # One that another process works with by now, or that cannot be removed, is in no one's way.
    with contextlib.suppress(OSError, InputError):
        handle = open_regular(path, FIELD, os.O_RDWR, follow=False)
        with os.fdopen(handle, "rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            own = os.fstat(handle)
            if file.read(len(MAGIC)) == MAGIC and os.path.samestat(own, os.lstat(path)):
                path.unlink()


def digest(value: Any) -> str:
    """A short name for lists and dictionaries, by which equal ones are known."""
    text = json.dumps(value, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def are_finite(value: Any) -> bool:
    """Whether all numbers in lists and dictionaries are; no recursion, which has a limit."""
    left = [value]
    while left:
        one = left.pop()
        if isinstance(one, dict):
            left += one.values()
        elif isinstance(one, list):
            left += one
        elif isinstance(one, float) and not math.isfinite(one):
            return False
    return True
