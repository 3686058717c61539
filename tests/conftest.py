"""Shared by all tests: boards, a small table, and the command line."""

from __future__ import annotations

import fcntl
import gc
import json
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import pytest
from hypothesis import settings
from instruction_counts import missing

from chladni.host.cli.app import main
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Regions
from chladni.tables.build import build_table
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from long_tests import mark_long
from soaking import IS_SOAKING

# What makes a failure come again is printed with it. `make test` draws the same cases each time, as
# its other samples; `make soak` draws new ones.
settings.register_profile("kept", print_blob=True, derandomize=not IS_SOAKING)
settings.load_profile("kept")

# A shell starts what runs in its background with Ctrl-C ignored, nohup with SIGHUP, and so would be
# every process that a test ends by them. What a test starts has the default where this process has
# a handler. A handler that does nothing lets nohup keep the tests running.
signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
    signal.signal(signal.SIGHUP, lambda *_: None)

# Four thousand tests are a million objects that stay: each look for rubbish among them takes a
# quarter of a second, and there were enough for a tenth of all time.
gc.set_threshold(100_000, 50, 50)

ROOT = Path(__file__).resolve().parents[1]
Made = TypeVar("Made")


@dataclass(frozen=True)
class Answer:
    """What one run of the command line came to."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """The one JSON object on stdout."""
        result = json.loads(self.out)
        assert isinstance(result, dict)
        return result


CommandLine = Callable[..., Answer]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Before those that are not asked for are left out."""
    mark_long(items)


def pytest_collection_finish() -> None:
    """No more looks at what was collected: it stays until the end."""
    gc.freeze()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Of the device suite; declared here, where pytest looks whatever it is asked to run."""
    parser.addoption(
        "--slowness", type=float, default=1.0, help="how many times slower than a chip it runs"
    )


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Tests of a device need pytest-embedded, which slows every other test: `make test` asks."""
    is_device = collection_path.name == "device"
    return True if is_device and not config.pluginmanager.hasplugin("pytest_embedded") else None


def built_once(factory: pytest.TempPathFactory, name: str, build: Callable[[Path], object]) -> Path:
    """A folder that one worker of a run builds something in, for all of them.

    Several runs of the same files share one where CHLADNI_BUILT names a folder for it.
    """
    base = factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = Path(os.environ.get("CHLADNI_BUILT", base)) / name
    done = folder / "done"
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not done.exists():
            folder.mkdir(exist_ok=True)
            build(folder)
            done.touch()
    return folder


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[], Made]) -> Made:
    """What one worker of a run makes, for all of them: each has an equal one of its own."""

    def build(folder: Path) -> None:
        (folder / "made").write_bytes(pickle.dumps(make()))

    made: Made = pickle.loads((built_once(factory, name, build) / "made").read_bytes())
    return made


@pytest.fixture
def chladni(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> CommandLine:
    """Run `chladni` with arguments, in this process."""

    def run(*arguments: object) -> Answer:
        monkeypatch.setattr(sys, "argv", ["chladni", *map(str, arguments)])
        code = main()
        captured = capsys.readouterr()
        return Answer(code, captured.out, captured.err)

    return run


@pytest.fixture(scope="session")
def prototype() -> Board:
    """The shipped prototype board."""
    return shipped_board("prototype")


@pytest.fixture(scope="session")
def paper() -> Board:
    """The shipped paper board."""
    return shipped_board("paper")


@pytest.fixture(scope="session")
def coarse_board(prototype: Board) -> Board:
    """The prototype with regions of about 18 mm: 4 × 8 of them."""
    return replace(prototype, regions=Regions(pitch=18e-3))


@pytest.fixture(scope="session")
def coarse_table(
    coarse_board: Board, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Table, TableReport]:
    """A table of `coarse_board`, built on all cores."""
    return made_once(tmp_path_factory, "coarse-table", lambda: build_table(coarse_board))


@cache
def shipped_board(name: str) -> Board:
    """A shipped board that stays in use as long as the run: its plate is solved once."""
    return load_board(name)


def shipped_table(factory: pytest.TempPathFactory, name: str) -> tuple[Table, TableReport]:
    """The table of a shipped board."""
    return made_once(factory, f"table-{name}", lambda: build_table(shipped_board(name)))


@pytest.fixture(scope="session")
def table_bytes(coarse_table: tuple[Table, TableReport], prototype: Board) -> bytes:
    """A small table that says it is the shipped prototype's, so that no board need be named."""
    return pack(replace(coarse_table[0], board_fingerprint=prototype.fingerprint()))


@pytest.fixture
def table_file(table_bytes: bytes, tmp_path: Path) -> Path:
    """`table_bytes` as a file."""
    path = tmp_path / "t.chl"
    path.write_bytes(table_bytes)
    return path


@pytest.fixture
def port(table_file: Path) -> Iterator[str]:
    """An emulated device on a pseudo-terminal, in a process of its own."""
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "chladni.host.cli.app",
            "emulate",
            str(table_file),
            "--serial",
            "--ms",
            "600000",
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    yield process.stdout.readline().strip()
    process.terminate()
    process.wait()


@pytest.fixture(scope="session")
def cross_compilers() -> None:
    """`.ci/run` installs them and insists; elsewhere these tests are left out without."""
    if not missing():
        return
    if os.environ.get("CHLADNI_REQUIRE_CROSS") == "1":
        pytest.fail(f"not installed: {', '.join(missing())}")
    pytest.skip(f"not installed: {', '.join(missing())}")


@pytest.fixture(scope="session", params=["esp32"])
def chip_program(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The chip's layer on a fake of ESP-IDF, compiled; named as its chip."""
    from firmware.chip_process import build  # noqa: PLC0415  (it imports this file)
    from firmware.compiled import compiled_core_here  # noqa: PLC0415  (so does this)

    core = compiled_core_here(tmp_path_factory)

    def built(folder: Path) -> Path:
        return build(folder, core, request.param)

    return built_once(tmp_path_factory, f"chip-{request.param}", built) / str(request.param)
