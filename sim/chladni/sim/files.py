"""Files: read up to a stated size and no further, written whole or not at all; TOML of them."""

from __future__ import annotations

import contextlib
import io
import math
import os
import secrets
import stat
import struct
import tomllib
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import ArgumentError, InputError

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISLNK, "a link"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
CHUNK_BYTES = 65_536
MOST_DOTS = 256
"""In a line of TOML. A key has three parts at most; what reading a key takes grows with their
square."""
MOST_DEPTH = 16
"""Of TOML's lists and blocks within each other; a board needs five."""
_PACKINGS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def read_whole(
    path: Path, field: str, most_bytes: int, what: str = "a regular file", *, follow: bool = True
) -> bytes:
    """A file's bytes, if it is a regular file of at most so many.

    Nothing else is opened: a pipe or a device would hang, or never end.

    Parameters
    ----------
    path, field
        The file, and the argument that names it.
    most_bytes
        A longer file is refused, and not read beyond this.
    what
        The file that is meant, for the message.
    follow
        Through a link, too.

    Raises
    ------
    InputError
        Not there, not readable, no regular file, or too long.
    """
    return read_with_mode(path, field, most_bytes, what, follow=follow)[0]


def read_with_mode(
    path: Path, field: str, most_bytes: int, what: str = "a regular file", *, follow: bool = True
) -> tuple[bytes, int]:
    """As `read_whole`, with the file's permissions: for secrets that no one else may read."""
    expected = f"{what} of at most {most_bytes:,} bytes"
    try:
        handle = open_regular(path, field, os.O_RDONLY, expected, follow=follow)
        with os.fdopen(handle, "rb") as file:
            found = os.fstat(handle)
            size = found.st_size
            data = b"" if size > most_bytes else file.read(size)
            # A file of /proc reports 0 bytes, and another may have grown.
            rest, left = [], most_bytes + 1 - size
            while left > 0 and (more := file.read(min(left, CHUNK_BYTES))):
                rest.append(more)
                left -= len(more)
            data = b"".join((data, *rest))
    except OSError as error:
        raise ArgumentError(field, error.strerror, "a readable file", file=str(path)) from None
    size = max(size, len(data))
    if size > most_bytes:
        raise ArgumentError(
            field,
            f"{size:,} bytes or more",
            expected,
            file=str(path),
            hint="is this the file that was meant?",
        )
    return data, stat.S_IMODE(found.st_mode)


def open_regular(
    path: Path,
    field: str,
    flags: int,
    expected: str = "a regular file",
    *,
    follow: bool = True,
    mode: int = 0o666,
) -> int:
    """A descriptor of a regular file, with the flags of `os.open`; of anything else an error.

    Raises
    ------
    InputError
        No regular file, or a link that is not to be followed.
    OSError
        It cannot be opened, or is not there.
    """
    if not follow and path.is_symlink():
        raise ArgumentError(field, "a link", f"{expected}, not a link", file=str(path))
    try:
        # Looked at first: opening a device may already do something.
        _check_regular(os.stat(path, follow_symlinks=follow), path, field, expected)
    except FileNotFoundError:
        if not flags & os.O_CREAT:
            raise
    except ValueError as error:  # a name with a zero byte
        raise ArgumentError(field, str(error), expected, file=str(path)) from None
    # What was put in its place meanwhile must not hang either.
    flags |= os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC | (0 if follow else os.O_NOFOLLOW)
    handle = os.open(path, flags, mode)
    try:
        _check_regular(os.fstat(handle), path, field, expected)
    except InputError:
        os.close(handle)
        raise
    return handle


def _check_regular(found: os.stat_result, path: Path, field: str, expected: str) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = next((name for test, name in _KINDS if test(found.st_mode)), "no file")
        raise ArgumentError(field, kind, expected, file=str(path))


def read_text(
    path: Path,
    field: str,
    most_bytes: int,
    what: str = "a regular file",
    *,
    encoding: str = "utf-8",
) -> str:
    """A file's text, within the bounds of `read_whole`.

    Raises
    ------
    InputError
        See there; also for bytes that are no such text.
    """
    try:
        return read_whole(path, field, most_bytes, what).decode(encoding)
    except UnicodeDecodeError as error:
        given = f"other bytes from {error.start} on"
        raise ArgumentError(field, given, f"{what}, as text in UTF-8", file=str(path)) from None


def read_arrays(
    path: Path, field: str, most_bytes: int, what: str = "a regular file", *, follow: bool = True
) -> dict[str, NDArray[Any]]:
    """Arrays of numbers and texts from an .npz of at most so many bytes, packed and unpacked.

    Raises
    ------
    InputError
        Not readable within these bounds.
    ValueError
        No .npz, or one of something else.
    """
    data = read_whole(path, field, most_bytes, what, follow=follow)
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            unpacked = sum(member.file_size for member in members)
            if unpacked > most_bytes:
                expected = f"at most {most_bytes:,} bytes once unpacked"
                raise ArgumentError(field, f"{unpacked:,} bytes", expected, file=str(path))
            if not {member.compress_type for member in members} <= _PACKINGS:
                raise ValueError("packed as NumPy packs nothing")
            # zipfile reads no member beyond the size that was summed, and checks its CRC-32.
            return {
                member.filename.removesuffix(".npy"): _array_of(archive.read(member))
                for member in members
            }
    except (
        zipfile.BadZipFile,
        zlib.error,
        struct.error,
        EOFError,
        OSError,
        RuntimeError,
        SyntaxError,
        MemoryError,
    ) as error:
        raise ValueError(f"no .npz: {error}") from None


def _array_of(data: bytes) -> NDArray[Any]:
    """An .npy's array, whose header must promise the bytes that are there and no objects."""
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    if version not in _HEADERS:
        raise ValueError(f"version {version}")
    shape, is_fortran, dtype = _HEADERS[version](file)
    if dtype.hasobject or math.prod(shape) * dtype.itemsize != len(data) - file.tell():
        raise ValueError(f"{dtype} of shape {shape} in {len(data)} bytes")
    flat: NDArray[Any] = np.frombuffer(data[file.tell() :], dtype)
    # Fortran's order is C's of the axes the other way round.
    array = flat.reshape(shape[::-1]).T if is_fortran else flat.reshape(shape)
    return array.copy()


def write_at(handle: int, data: bytes, at: int) -> None:
    """Write all of some bytes at a place of an open file: a disk that fills up takes a part first.

    Raises
    ------
    OSError
        They cannot be written; a part of them may be.
    """
    done = 0
    while done < len(data):
        done += os.pwrite(handle, data[done:], at + done)


def write_whole(path: Path, data: bytes, *, follow: bool = True) -> None:
    """Write a file beside its place and rename it, so that no one ever sees half of it.

    Parameters
    ----------
    follow
        Through a link the file it names is replaced; otherwise the link itself.

    Raises
    ------
    OSError
        It cannot be written. What was there before is still there, and nothing besides.
    """
    _write(Path(os.path.realpath(path)) if follow else path, data, 0o666, os.replace)


def write_new(path: Path, data: bytes, mode: int) -> None:
    """Write a file that is not there yet, with these permissions, whole or not at all.

    Raises
    ------
    OSError
        There is something of that name, or it cannot be written.
    """
    # A hard link, unlike a rename, never replaces what is there.
    _write(path, data, mode, os.link)


def _write(path: Path, data: bytes, mode: int, place: Any) -> None:
    part = path.with_name(f".chladni-{secrets.token_hex(8)}.part")
    try:
        handle = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, mode)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        place(part, path)
    except OSError as error:
        # The temporary file's name would tell no one anything.
        raise OSError(error.errno, error.strerror, str(path)) from None
    finally:
        with contextlib.suppress(OSError):  # it became `path`, or never was
            part.unlink()


def write_arrays(path: Path, *, follow: bool = True, **arrays: Any) -> None:
    """Write a compressed .npz under exactly the given name."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    write_whole(path, buffer.getvalue(), follow=follow)


def toml_document(text: str) -> dict[str, Any]:
    """A shallow TOML document, with integers of 64 bits as TOML has them.

    Raises
    ------
    InputError
        The text is no such document.
    """
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > MOST_DOTS:
            raise InputError(
                f"line {number}",
                f"{line.count('.')} dots",
                f"at most {MOST_DOTS}",
                hint="a key has three parts at most",
            )
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise _too_deep("syntax") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError("syntax", str(error), "a TOML document") from None
    except ValueError:  # Python reads no integer of more than 4,300 digits
        expected = "integers of 64 bits"
        raise InputError("syntax", "an integer of thousands of digits", expected) from None
    _check_values(document)
    return document


def _check_values(document: dict[str, Any]) -> None:
    """Refuse what nests too deep or is no TOML integer. Without recursion, which has a limit."""
    left: list[tuple[Any, tuple[str, ...]]] = [(document, ())]
    while left:
        value, where = left.pop()
        if len(where) > MOST_DEPTH:
            raise _too_deep("".join(where).lstrip("."))
        if isinstance(value, dict):
            left += [(own, (*where, "." + key)) for key, own in value.items()]
        elif isinstance(value, list):
            left += [(own, (*where, f"[{number}]")) for number, own in enumerate(value)]
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise InputError("".join(where).lstrip("."), value, "an integer of 64 bits")


def _too_deep(where: str) -> InputError:
    expected = f"blocks and lists at most {MOST_DEPTH} deep"
    return InputError(where, "deeper ones", expected, hint="a board needs five")
