"""An ESP32 or an ESP32-S3 in its ROM's loader, on a pseudo-terminal, for esptool's own code.

Serial protocol as Espressif documents it: SLIP frames; requests of direction 0, operation, size,
checksum; answers of direction 1 with a value and two status bytes. Flash has sectors of 4 KiB that
are erased before they are written, bits go from 1 to 0 only, and the stub that is uploaded "runs"
by saying so.
"""

from __future__ import annotations

import hashlib
import os
import select
import struct
import threading
import tty
import zlib
from collections.abc import Iterator
from contextlib import contextmanager

from chladni.sim.board.electronics import ChipName

MAGIC_REGISTER, ESP32_MAGIC = 0x40001000, 0x00F01D83
SPI_W0, FLASH_ID = {"esp32": 0x3FF42080, "esp32s3": 0x60002058}, 0x1640EF
"""Where the flash chip's answer stands; a Winbond of 4 MB."""
SECURITY_INFO, S3_ID = 0x14, 9
"""Only an S3 answers: flags, counts and keys, then which chip it is."""
SECTOR = 4096
FLASH_BYTES = 4 * 1024 * 1024
END, ESC, ESC_END, ESC_ESC = 0xC0, 0xDB, 0xDC, 0xDD
SYNC, READ_REG, MEM_END = 0x08, 0x0A, 0x06
FLASH_BEGIN, FLASH_DATA, DEFL_BEGIN, DEFL_DATA, MD5, READ_FLASH = 0x02, 0x03, 0x10, 0x11, 0x13, 0xD2
KNOWN = {0x02, 0x03, 0x04, 0x05, 0x06, 0x07, 0x08, 0x09, 0x0A, 0x0B, 0x0D, 0x0F, 0x10, 0x11, 0x12,
         0x13, 0xD2}  # fmt: skip


class RomChip:
    """The chip; `flash` may be looked at and changed between commands."""

    def __init__(self, magic: int = ESP32_MAGIC, *, chip: ChipName = "esp32") -> None:
        self.flash = bytearray(b"\xff" * FLASH_BYTES)
        self.written: set[int] = set()
        """Sectors that were erased."""
        self.lies = False
        """Whether what is written is not kept."""
        self._magic, self._chip = magic, chip
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._is_stub = False
        self._at = 0
        self._inflate = zlib.decompressobj()
        self._to_send = b""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    @contextmanager
    def running(self) -> Iterator[RomChip]:
        """Powered on, and in the loader."""
        self._thread.start()
        try:
            yield self
        finally:
            self._stop.set()
            self._thread.join()
            os.close(self._master)
            os.close(self._slave)

    def _run(self) -> None:
        buffer = bytearray()
        while not self._stop.is_set():
            if not select.select([self._master], [], [], 0.02)[0]:
                continue
            buffer += os.read(self._master, 65536)
            while (begin := buffer.find(END)) >= 0 and (end := buffer.find(END, begin + 1)) >= 0:
                frame, buffer = bytes(buffer[begin + 1 : end]), buffer[end + 1 :]
                if frame:
                    self._take(frame.replace(b"\xdb\xdc", b"\xc0").replace(b"\xdb\xdd", b"\xdb"))

    def _frame(self, data: bytes) -> None:
        escaped = data.replace(b"\xdb", b"\xdb\xdd").replace(b"\xc0", b"\xdb\xdc")
        view = memoryview(b"\xc0" + escaped + b"\xc0")
        while view:
            view = view[os.write(self._master, view) :]

    def _answer(self, operation: int, value: int = 0, data: bytes = b"", status: int = 0) -> None:
        tail = data + bytes([status, 5 if status else 0]) + (b"" if self._is_stub else b"\0\0")
        self._frame(struct.pack("<BBHI", 1, operation, len(tail), value) + tail)

    def _take(self, frame: bytes) -> None:
        if self._to_send and len(frame) == 4:
            self._send_block()
            return
        _, operation, size, _ = struct.unpack_from("<BBHI", frame)
        data = frame[8 : 8 + size]
        if operation == SECURITY_INFO and self._chip == "esp32s3":
            self._answer(operation, data=struct.pack("<IB7sII", 0, 0, bytes(7), S3_ID, 0))
        elif operation not in KNOWN:
            self._answer(operation, status=1)
        elif operation == SYNC:
            for _ in range(8):
                self._answer(SYNC, value=0 if self._is_stub else 0x20120707)
        elif operation == READ_REG:
            known = {MAGIC_REGISTER: self._magic, SPI_W0[self._chip]: FLASH_ID}
            self._answer(READ_REG, value=known.get(struct.unpack("<I", data)[0], 0))
        elif operation in (FLASH_BEGIN, DEFL_BEGIN):
            size, _, _, self._at = struct.unpack_from("<IIII", data)
            self._erase(self._at, size)
            self._inflate = zlib.decompressobj()
            self._answer(operation)
        elif operation in (FLASH_DATA, DEFL_DATA):
            block = data[16 : 16 + struct.unpack_from("<I", data)[0]]
            self._program(self._inflate.decompress(block) if operation == DEFL_DATA else block)
            self._answer(operation)
        elif operation == MD5:
            at, size, _, _ = struct.unpack("<IIII", data)
            self._answer(MD5, data=hashlib.md5(self.flash[at : at + size]).digest())
        elif operation == READ_FLASH:
            at, size, _, _ = struct.unpack("<IIII", data)
            self._answer(READ_FLASH)
            self._to_send = bytes(self.flash[at : at + size])
            self._digest = hashlib.md5(self._to_send).digest()
            self._frame(self._to_send[:SECTOR])
        else:
            self._answer(operation)
            if operation == MEM_END and not self._is_stub:
                self._is_stub = True
                self._frame(b"OHAI")

    def _send_block(self) -> None:
        """The host has said how much it has: the next block, or the digest of all."""
        self._to_send = self._to_send[SECTOR:]
        self._frame(self._to_send[:SECTOR] if self._to_send else self._digest)

    def _erase(self, at: int, size: int) -> None:
        for sector in range(at // SECTOR, -(-(at + size) // SECTOR)):
            self.written.add(sector)
            self.flash[sector * SECTOR : (sector + 1) * SECTOR] = b"\xff" * SECTOR

    def _program(self, data: bytes) -> None:
        if not self.lies:
            old = self.flash[self._at : self._at + len(data)]
            self.flash[self._at : self._at + len(data)] = bytes(
                a & b for a, b in zip(old, data, strict=True)
            )
        self._at += len(data)
