"""The device under test: emulated, on a pseudo-terminal, or with `--port` on the bench."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.host.device_config import config_of
from chladni.sim.board import Board
from chladni.sim.board_file import load_board
from chladni.tables.format import pack
from chladni.tables.table import Table
from made_up import make_table


@pytest.fixture(scope="session")
def board() -> Board:
    """The board of the device under test."""
    return load_board("prototype")


def table_of(board: Board, gain: float) -> Table:
    """A table of one region that says it is the board's."""
    drive = np.full((1, config_of(board)["channels"]), gain, dtype=complex)
    return replace(make_table(drive), board_name=board.name, board_fingerprint=board.fingerprint())


@pytest.fixture(scope="session")
def emulated_port(board: Board, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A pseudo-terminal with the emulated device behind it."""
    path = Path(tmp_path_factory.mktemp("device")) / "first.chl"
    path.write_bytes(pack(table_of(board, 5.0)))
    process = subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli", "emulate", str(path), "--serial"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    yield process.stdout.readline().strip()
    process.terminate()
    process.wait()


@pytest.fixture(scope="session")
def another_table(board: Board) -> Table:
    """A table for the device that is not the one it has."""
    return table_of(board, 8.0)


@pytest.fixture
def embedded_services() -> str:
    """What pytest-embedded reaches the device by."""
    return "serial"


@pytest.fixture
def port(request: pytest.FixtureRequest) -> str:
    """`--port`, or the emulated device's."""
    return str(request.config.getoption("port") or request.getfixturevalue("emulated_port"))
