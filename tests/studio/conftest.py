"""A studio on a small board, and Chromium to look at it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from chladni.drives.objectives import default_objective
from chladni.drives.problem.problem import solved_board
from chladni.host.studio.boards.builder import BoardBuilder
from chladni.host.studio.boards.prepared import BoardChoice, ReadyBoard
from chladni.host.studio.server import listen, make_server
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Isolation, Measured, MeasuredValue
from chladni.tables.build import build_table
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from conftest import ROOT, made_once

STRIP = ROOT / "tests" / "boards" / "strip5.toml"
READY = "section[data-board]"
TIMEOUT_MS = 15_000
"""Of what takes a second; a busy machine is no failure."""


@dataclass(frozen=True)
class Studio:
    """A server, by its address."""

    url: str

    @property
    def port(self) -> int:
        return int(self.url.split("/")[2].split(":")[1])

    @property
    def socket_url(self) -> str:
        return self.url.replace("http", "ws") + "socket"


@dataclass(frozen=True)
class StudioProcess(Studio):
    """A server in a process of its own."""

    process: subprocess.Popen[str]


@contextmanager
def serving(*arguments: object) -> Iterator[StudioProcess]:
    process = subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli.app", "studio", *map(str, arguments), "--json"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    try:
        yield StudioProcess(json.loads(process.stdout.readline())["url"], process)
    finally:
        process.kill()
        process.wait()


@pytest.fixture(scope="session")
def small_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The prototype with regions of 18 mm and a sixteenth of its image points: quick to score."""
    path = tmp_path_factory.mktemp("studio") / "small.toml"
    text = (ROOT / "boards" / "prototype.toml").read_text(encoding="utf-8")
    for own, other in (("pitch_mm = 5.0", "pitch_mm = 18.0"), ("[179, 367]", "[45, 93]")):
        assert text.count(own) == 1
        text = text.replace(own, other)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def small_board(small_file: Path) -> Board:
    """The board of that file."""
    return load_board(small_file)


@pytest.fixture(scope="session")
def small_table(
    small_board: Board, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Table, TableReport]:
    """Its table, as the studio builds it."""
    return made_once(tmp_path_factory, "small-table", lambda: build_table(small_board))


@contextmanager
def serving_here(
    ready: ReadyBoard, *known_ports: str, port: int = 0, token: str = "own"
) -> Iterator[Studio]:
    """A server in a thread, with a table that is there: what it costs is the test's own share."""
    listening, builder = listen(port), BoardBuilder(1)
    builder.keep(ready)
    port = listening.getsockname()[1]
    server = make_server(port, token, ready.choice, builder, known_ports=known_ports)
    thread = threading.Thread(target=server.run, args=([listening],))
    thread.start()
    yield Studio(f"http://127.0.0.1:{port}/{token}/")
    server.should_exit = True
    thread.join()
    builder.close()
    listening.close()


@pytest.fixture(scope="session")
def ready(small_board: Board, small_table: tuple[Table, TableReport]) -> ReadyBoard:
    return ReadyBoard(BoardChoice(small_board, "ssim"), solved_board(small_board), small_table[0])


@pytest.fixture(scope="session")
def strip(tmp_path_factory: pytest.TempPathFactory) -> ReadyBoard:
    """A strip of five coils that gives each finger a signal of its own."""
    board = load_board(STRIP)
    choice = BoardChoice(board, default_objective(board))
    table = made_once(tmp_path_factory, "strip-table", lambda: ReadyBoard.of(choice, jobs=1).table)
    return ReadyBoard(choice, solved_board(board), table)


@pytest.fixture(scope="session")
def measured(small_board: Board, tmp_path_factory: pytest.TempPathFactory) -> ReadyBoard:
    """The small board as it might be measured: a coil reversed, one weak, one dead."""
    centre, *others = small_board.actuators
    faults: list[dict[str, Any]] = [
        {"polarity": -1},
        {"trim_db": 1.9},
        {"trim_db": 3.0},
        {"is_dead": True},
    ]
    coils = [replace(own, **fault) for own, fault in zip(others, faults, strict=True)]
    values = (
        MeasuredValue("sheet thickness", 1.05, 0.95, 1.1),
        MeasuredValue("screws", 1.9, 1.5, 2.4),
    )
    apart = Isolation(25.0), Isolation(39.0)
    origin = Measured("its own coils", "2026-11-27", values, *apart)
    board = replace(small_board, actuators=(centre, *coils), measured=origin)
    table, _ = made_once(tmp_path_factory, "measured-table", lambda: build_table(board))
    return ReadyBoard(BoardChoice(board, "ssim"), solved_board(board), table)


@pytest.fixture(scope="session")
def measured_studio(measured: ReadyBoard) -> Iterator[Studio]:
    with serving_here(measured) as own:
        yield own


@pytest.fixture(scope="session")
def strip_studio(strip: ReadyBoard) -> Iterator[Studio]:
    with serving_here(strip) as own:
        yield own


@pytest.fixture(scope="session")
def studio(ready: ReadyBoard) -> Iterator[Studio]:
    with serving_here(ready) as own:
        yield own


# Not for the session: while Playwright runs, no other test of its process may use asyncio.
@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    """`.ci/run` installs it and insists; elsewhere these tests are left out without."""
    path = shutil.which("chromium")
    if path is None:
        if os.environ.get("CHLADNI_REQUIRE_CROSS") == "1":
            pytest.fail("not installed: chromium")
        pytest.skip("not installed: chromium")
    with sync_playwright() as playwright:
        # Root, as in a container, has no sandbox.
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


OpenPage = Callable[..., Page]


@contextmanager
def pages(chromium: Browser, studio: Studio) -> Iterator[OpenPage]:
    """A function that opens pages; any error in one, and any request to elsewhere, is a failure.

    Nothing moves unless that is asked for: a picture 60 times a second takes half a core.
    """
    errors: list[str] = []
    contexts = []

    def open_one(url: str = studio.url, ready: str = READY, **options: Any) -> Page:
        context = chromium.new_context(**{"reduced_motion": "reduce", **options})
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(TIMEOUT_MS)
        page.on("pageerror", lambda error: errors.append(str(error)))
        own = ("/".join(url.split("/")[:3]), "data:", "blob:", url)
        page.on("request", lambda one: None if one.url.startswith(own) else errors.append(one.url))
        page.goto(url)
        page.wait_for_selector(ready)
        return page

    yield open_one
    for context in contexts:
        context.close()
    assert errors == []


@pytest.fixture
def open_page(chromium: Browser, studio: Studio) -> Iterator[OpenPage]:
    """Pages of one's own, with options of a browser context, and their boards there."""
    with pages(chromium, studio) as opened:
        yield opened


@pytest.fixture(scope="module")
def shared_page(chromium: Browser, studio: Studio) -> Iterator[Page]:
    with pages(chromium, studio) as opened:
        yield opened()


@pytest.fixture
def page(shared_page: Page) -> Page:
    """The studio in a window that other tests have had before, as it was opened."""
    shared_page.mouse.up()
    shared_page.set_viewport_size({"width": 1280, "height": 720})
    shared_page.reload()
    shared_page.wait_for_selector(READY)
    return shared_page
