"""The device suite on an image in QEMU. No image can be linked here, so a stand-in for QEMU takes
its arguments, checks the flash that it is given, and offers the emulated device, blank, as QEMU
offers its UART. What it leaves out is the chip itself.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

PARTS = {0x1000: b"\xe9bootloader", 0x8000: b"\xaa\x50table", 0x10000: b"\xe9application"}
STAND_IN = """#!{python}
import os, signal, subprocess, sys
arguments = sys.argv[1:]
def after(name): return arguments[arguments.index(name) + 1]
assert after("-machine") == "esp32" and after("-serial") == "pty" and after("-monitor") == "none"
path, kind, form = after("-drive").split(",")
assert (kind, form) == ("if=mtd", "format=raw")
flash = open(path.removeprefix("file="), "rb").read()
assert len(flash) == 4 << 20
for offset, data in {parts!r}.items():
    assert flash[offset:].startswith(data), hex(offset)
assert flash[-4096:] == bytes([255]) * 4096
device = subprocess.Popen(
    [sys.executable, "-m", "chladni.host.cli.app", "emulate", "--serial", "--board", "prototype",
     "--flash", {flash!r}], stdout=subprocess.PIPE, text=True)
signal.signal(signal.SIGTERM, lambda *_: (device.terminate(), sys.exit(0)))
port = device.stdout.readline().strip()
print("char device redirected to", port, "(label serial0)", flush=True)
device.wait()
"""


def suite(*arguments: object) -> str:
    """What pytest says of the device suite."""
    run = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "pytest_embedded",
            "-p",
            "no:cacheprovider",
            "-rs",
            "tests/device",
            "--embedded-services",
            "idf,qemu",
            *map(str, arguments),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={key: value for key, value in os.environ.items() if not key.startswith("PYTEST_")},
    )
    return run.stdout + run.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("own", "count"), [("greets or handshake", 2), ("", 8)], ids=["two", "all"]
)
def test_the_suite_takes_an_image_from_blank_flash_to_a_touch(
    own: str, count: int, tmp_path: Path
) -> None:
    """`make test` also runs all of it, on the emulated device."""
    build = tmp_path / "build"
    build.mkdir()
    files = {f"{offset:#x}": f"{offset:x}.bin" for offset in PARTS}
    for offset, data in PARTS.items():
        (build / f"{offset:x}.bin").write_bytes(data)
    (build / "flasher_args.json").write_text(json.dumps({"flash_files": files}), "utf-8")
    program = tmp_path / "qemu-system-xtensa"
    text = STAND_IN.format(python=sys.executable, parts=PARTS, flash=str(tmp_path / "own.flash"))
    program.write_text(text, "utf-8")
    program.chmod(0o755)
    said = suite("--qemu-prog-path", program, "--build-dir", build, "-k", own)
    assert f"{count} passed" in said, said


def test_without_an_image_or_an_emulator_the_suite_is_skipped_with_the_reason(
    tmp_path: Path,
) -> None:
    said = suite("--build-dir", tmp_path)
    assert "no flasher_args.json, and no bootloader.bin or partitions.bin or firmware.bin" in said
    assert "8 skipped" in said
    for name in ("bootloader.bin", "partitions.bin", "firmware.bin"):
        (tmp_path / name).write_bytes(b"\xe9")
    said = suite("--build-dir", tmp_path, "--qemu-prog-path", "no-such-emulator")
    assert "no no-such-emulator on the PATH" in said
