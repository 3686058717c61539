"""The network: the record that lets a device onto one, and datagrams that prove who sent them.

The one declaration of both; `tools/generate_headers.py` writes the C++ header. Little-endian. Why
it is so, and what it does not protect from, is in docs/security.md.
"""

from __future__ import annotations

import os
import secrets
import struct
import zlib
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from chladni.host.protocol.codes import numbered
from chladni.host.protocol.link import CRC_BYTES, MAX_FRAME
from chladni.sim.errors import ArgumentError, InputError
from chladni.sim.files import read_with_mode, write_new
from chladni.tables.layout import Field

VERSION = 1
KEY_BYTES = 32
"""Of HMAC-SHA-256; as long as its result, so that guessing either is as hard."""
KEY_FILE_BYTES = 1024
"""Of a file with a key: its digits, and white space of some editor."""
MAC_BYTES = 16
"""The first half of the HMAC: RFC 2104 advises no less, and 2^128 guesses are out of reach."""
DEFAULT_PORT = 50_160
LOWEST_PORT = 1024
SSID_BYTES, PASSPHRASE_BYTES = 32, 64
SHORTEST_PASSPHRASE = 8
"""WPA2 takes 8 to 63 characters; none at all means an open network."""

RECORD_MAGIC = b"CHLN"
RECORD_FIELDS = (
    Field("magic", "char4", 'The letters "CHLN".'),
    Field("version", "u16", f"{VERSION}. A reader refuses another."),
    Field("port", "u16", "UDP port the device listens on."),
    Field("key", f"char{KEY_BYTES}", "Shared secret of host and device."),
    Field("ssid", f"char{SSID_BYTES}", "Of the network, filled up with zeros."),
    Field("passphrase", f"char{PASSPHRASE_BYTES}", "Filled up with zeros, at least one of them."),
)
_RECORD = struct.Struct("<" + "".join(field.code for field in RECORD_FIELDS))
RECORD_BYTES = _RECORD.size + CRC_BYTES


class Kind(IntEnum):
    """What a datagram is."""

    REQUEST = 0
    ANSWER = 1
    HELLO = 2
    WELCOME = 3
    CHALLENGE = 4


DATAGRAM_MAGIC = 0xC41D
DATAGRAM_FIELDS = (
    Field("magic", "u16", f"{DATAGRAM_MAGIC:X}h."),
    Field("version", "u8", f"{VERSION}; another is dropped."),
    Field("kind", "u8", f"{numbered(kind.name.lower() for kind in Kind)}."),
    Field(
        "counter",
        "u32",
        "From 1, one more with each; taken once. 0 in a welcome, a challenge's "
        "cookie in the hello that answers it, and 0 in any other.",
    ),
    Field(
        "session",
        "u64",
        "Drawn by the device; in hello, welcome and challenge a number the host drew.",
    ),
)
HEAD = struct.Struct("<" + "".join(field.code for field in DATAGRAM_FIELDS))
SESSION = struct.Struct("<Q")
"""A hello's body, the session the host has had or 0, and a welcome's, the one that counts."""
HELLO_BYTES = HEAD.size + SESSION.size + MAC_BYTES
"""A hello is as long as its answer, so that no one can use a device to multiply traffic. A
challenge is shorter: a head alone, without a MAC."""
SESSION_SILENCE_MS = 10_000
"""Without a request for so long a session is over, and with it all that was held back."""
MAX_DATAGRAM = HEAD.size + MAX_FRAME - CRC_BYTES + MAC_BYTES
RENEW_AT = 2**31
"""At this counter a session is over, long before counters run out."""


@dataclass(frozen=True)
class NetworkSettings:
    """What a device needs to be reached over a network.

    Raises
    ------
    InputError
        A name, passphrase, key or port that cannot be.
    """

    ssid: str
    passphrase: str
    key: bytes
    port: int = DEFAULT_PORT

    def __post_init__(self) -> None:
        # What is no text on the command line comes as surrogates; it is no name either.
        ssid, passphrase = (text.encode(errors="replace") for text in (self.ssid, self.passphrase))
        if not self.ssid.isprintable():
            raise InputError("ssid", ascii(self.ssid), "printable text")
        if not 0 < len(ssid) <= SSID_BYTES or b"\0" in ssid:
            raise InputError("ssid", self.ssid, f"1 to {SSID_BYTES} bytes")
        is_right = SHORTEST_PASSPHRASE <= len(passphrase) < PASSPHRASE_BYTES
        if (passphrase and not is_right) or b"\0" in passphrase:
            raise InputError(
                "passphrase",
                f"{len(passphrase)} bytes",
                f"{SHORTEST_PASSPHRASE} to {PASSPHRASE_BYTES - 1}, or none for an open network",
            )
        if len(self.key) != KEY_BYTES or not any(self.key):
            raise InputError("key", f"{len(self.key)} bytes", f"{KEY_BYTES}, not all zero")
        if not LOWEST_PORT <= self.port < 2**16:
            raise InputError("port", self.port, f"{LOWEST_PORT} to {2**16 - 1}")


def pack_network(settings: NetworkSettings) -> bytes:
    """The record as it lies in flash."""
    data = _RECORD.pack(
        RECORD_MAGIC,
        VERSION,
        settings.port,
        settings.key,
        settings.ssid.encode(),
        settings.passphrase.encode(),
    )
    return data + struct.pack("<I", zlib.crc32(data))


def read_key(path: Path) -> bytes:
    """The key in a file: 64 hexadecimal digits.

    Raises
    ------
    InputError
        Not readable, or no key.
    """
    digits = f"{2 * KEY_BYTES} hexadecimal digits"
    data, mode = read_with_mode(path, "key", KEY_FILE_BYTES, f"{digits} in a regular file")
    try:
        key = bytes.fromhex(data.decode("ascii"))
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise ArgumentError("key", f"{len(data)} bytes", digits, file=str(path))
    if os.name == "posix" and mode & 0o077:
        expected = "a file that only you may read: chmod 600"
        raise ArgumentError("key", f"mode {mode:o}", expected, file=str(path))
    return key


def make_key(path: Path) -> bytes:
    """A new key, in a file that only its owner may read.

    Raises
    ------
    InputError
        The file is there, or the folder is not.
    OSError
        It cannot be written whole; nothing is left of it.
    """
    key = secrets.token_bytes(KEY_BYTES)
    try:
        write_new(path, (key.hex() + "\n").encode("ascii"), 0o600)
    except (FileExistsError, FileNotFoundError, NotADirectoryError, PermissionError) as error:
        expected = "a file to make: a new name in a folder that can be written"
        raise ArgumentError("key", error.strerror, expected, file=str(path)) from None
    return key
