"""PlatformIO's native program and the Python emulator are the same firmware."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

from chladni.host.emulation.emulator import TouchEvent, emulate
from chladni.host.protocol.config import pack_config
from chladni.tables.format import pack
from conftest import ROOT, built_once
from made_up import device_of, make_table


def build(folder: Path) -> None:
    script = ROOT / "tools" / "platformio_offline.py"
    subprocess.run(
        [sys.executable, str(script), str(ROOT / ".pio-core"), "--", "run", "-e", "native"],
        cwd=ROOT,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    # Nobody else links this one again while a test runs it.
    shutil.copy2(ROOT / ".pio" / "build" / "native" / "program", folder)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program `pio run -e native` builds, without PlatformIO's registry."""
    return built_once(tmp_path_factory, "native", build) / "program"


@pytest.mark.slow
def test_native_and_python_move_the_pins_alike(program: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    drives = rng.normal(size=(12, 5)) + 1j * rng.normal(size=(12, 5))
    table = make_table(10.0 * drives / np.abs(drives).max(axis=1, keepdims=True), 3, 4)
    path = tmp_path / "t.chl"
    path.write_bytes(pack(table))
    device = device_of(table)
    config = tmp_path / "c.bin"
    config.write_bytes(pack_config(device.with_values(level_q15=26214)))
    answer = subprocess.run(
        [program, path, config, "10", "-25", "150"], check=True, capture_output=True, text=True
    )
    duties = emulate(device, table, [TouchEvent(5.0, (10.0, -25.0))], 150.0).duty_steps
    assert duties.any()
    assert answer.stdout.strip() == f"{zlib.crc32(duties.astype('<u2').tobytes()):08x}"


@pytest.mark.slow
def test_native_program_refuses_what_is_no_table(program: Path, tmp_path: Path) -> None:
    path = tmp_path / "bad.chl"
    path.write_bytes(b"x" * 200)
    answer = subprocess.run(
        [program, path, path, "0", "0", "10"], check=False, capture_output=True, text=True
    )
    assert answer.returncode in (1, 2)
    assert answer.stderr
