"""A linked image in Espressif's QEMU, with its UART on a pseudo-terminal.

pytest-embedded's own QEMU service talks to the emulator's standard streams, on which a multiplexer
takes bytes of the link for its commands. So the emulator is started here, and the suite reaches it
like a board: at a serial port.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PROGRAM = "qemu-system-xtensa"
FLASH_BYTES = 4 * 2**20
OF_PLATFORMIO = {0x1000: "bootloader.bin", 0x8000: "partitions.bin", 0x10000: "firmware.bin"}
"""Offset and file of what `pio run -e esp32` leaves in `.pio/build/esp32`."""
PORT = re.compile(r"char device redirected to (\S+)")


class NoChip(Exception):  # noqa: N818  (a reason to skip, not an error)
    """There is no image or no emulator; says what is missing."""


def parts_of(build: Path) -> dict[int, Path]:
    """Offset and file of everything that is flashed: of `idf.py build`, or of `pio run`."""
    listed = build / "flasher_args.json"
    if listed.exists():
        files = json.loads(listed.read_text("utf-8"))["flash_files"]
        return {int(offset, 0): build / name for offset, name in files.items()}
    parts = {offset: build / name for offset, name in OF_PLATFORMIO.items()}
    missing = [path.name for path in parts.values() if not path.exists()]
    if missing:
        raise NoChip(f"{build}: no flasher_args.json, and no {' or '.join(missing)}")
    return parts


def flash_image(build: Path) -> bytes:
    """What a new chip's flash holds after the first flashing."""
    image = bytearray(b"\xff" * FLASH_BYTES)
    for offset, path in parts_of(build).items():
        data = path.read_bytes()
        image[offset : offset + len(data)] = data
    return bytes(image)


@contextmanager
def chip_in_qemu(build: Path, folder: Path, program: str, extra: str) -> Iterator[str]:
    """The port of a blank chip that runs the image.

    Raises
    ------
    NoChip
        Without an image, or without the emulator.
    """
    image = flash_image(build)
    found = shutil.which(program)
    if found is None:
        raise NoChip(f"no {program} on the PATH")
    flash = folder / "flash.bin"
    flash.write_bytes(image)
    process = subprocess.Popen(
        [
            found,
            "-nographic",
            "-monitor",
            "none",
            "-machine",
            "esp32",
            "-serial",
            "pty",
            "-drive",
            f"file={flash},if=mtd,format=raw",
            *shlex.split(extra),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    said = []
    try:
        for line in process.stdout:
            said.append(line)
            port = PORT.search(line)
            if port is not None:
                yield port.group(1)
                return
        raise AssertionError(f"{program} ended before it offered a port: {''.join(said)}")
    finally:
        process.terminate()
        process.wait()
