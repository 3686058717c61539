"""A studio on a small board, and Chromium to look at it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from conftest import ROOT

READY = "section[data-board]"
TIMEOUT_MS = 15_000
"""Of what takes a second; a busy machine is no failure."""


@dataclass(frozen=True)
class Studio:
    """A server in a process of its own."""

    process: subprocess.Popen[str]
    url: str

    @property
    def port(self) -> int:
        return int(self.url.split("/")[2].split(":")[1])

    @property
    def socket_url(self) -> str:
        return self.url.replace("http", "ws") + "socket"


@contextmanager
def serving(*arguments: object) -> Iterator[Studio]:
    process = subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli.app", "studio", *map(str, arguments), "--json"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        yield Studio(process, json.loads(process.stdout.readline())["url"])
    finally:
        process.kill()
        process.wait()


@pytest.fixture(scope="session")
def coarse_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of `coarse_board`."""
    path = tmp_path_factory.mktemp("studio") / "coarse.toml"
    text = (ROOT / "boards" / "prototype.toml").read_text(encoding="utf-8")
    assert text.count("pitch_mm = 5.0") == 1
    path.write_text(text.replace("pitch_mm = 5.0", "pitch_mm = 18.0"), encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def studio(coarse_file: Path) -> Iterator[Studio]:
    with serving(coarse_file, "--port", 0) as own:
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


@pytest.fixture
def open_page(chromium: Browser, studio: Studio) -> Iterator[OpenPage]:
    """Open the studio with options of a browser context, and wait for its board.

    Any error in the page, and any request to elsewhere, fails the test.
    """
    errors: list[str] = []
    contexts = []

    def open_one(url: str = studio.url, ready: str = READY, **options: object) -> Page:
        context = chromium.new_context(**options)  # type: ignore[arg-type]
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(TIMEOUT_MS)
        page.on("pageerror", lambda error: errors.append(str(error)))
        origin = "/".join(url.split("/")[:3])
        page.on("request", lambda request: None if request.url.startswith(
            (origin, "data:", "blob:", url)) else errors.append(request.url))  # fmt: skip
        page.goto(url)
        page.wait_for_selector(ready)
        return page

    yield open_one
    for context in contexts:
        context.close()
    assert errors == []
