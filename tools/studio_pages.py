"""Pages of a studio that serves one board, in Chromium: for pictures and for the bench."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from playwright.sync_api import Page, sync_playwright

WIDTH = 1280
"""Pixels."""
BUILT_MS = 1_200_000


@contextmanager
def studio_pages(board: str, height: int = 800) -> Iterator[Callable[[], Page]]:
    """What opens a page, `height` pixels high, and waits for its board; server and all end here."""
    server = subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli.app", "studio", board, "--port", "0", "--json"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert server.stdout is not None
    try:
        url = json.loads(server.stdout.readline())["url"]
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox"]
            )

            def opened() -> Page:
                page = browser.new_page(viewport={"width": WIDTH, "height": height})
                page.goto(url)
                page.wait_for_selector("section[data-board]", timeout=BUILT_MS)
                return page

            yield opened
            browser.close()
    finally:
        server.terminate()
        server.wait()
