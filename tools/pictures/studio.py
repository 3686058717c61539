"""Take the picture of the studio that the README shows: `prototype`, pressed, in Chromium.

python tools/pictures/studio.py     writes docs/images/studio.png
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "studio.png"
WIDTH, HEIGHT = 1280, 800
PRESS_AT = 0.64, 0.33
"""Share of the board from its left and from its top: 10 mm right and 25 mm up of its centre."""
BUILT_MS = 300_000


def main() -> None:
    """Start a studio, press, wait for the scorecard."""
    server = subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli.app", "studio", "prototype", "--port", "0",
         "--json"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert server.stdout is not None
    try:
        url = json.loads(server.stdout.readline())["url"]
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox"]
            )
            page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
            page.goto(url)
            page.wait_for_selector("section[data-board]", timeout=BUILT_MS)
            page.get_by_label("energy").check()
            box = page.locator('[data-part="plate"]').bounding_box()
            assert box is not None
            page.mouse.move(
                *(
                    begin + share * side
                    for begin, share, side in zip(
                        (box["x"], box["y"]), PRESS_AT, (box["width"], box["height"]), strict=True
                    )
                )
            )
            page.mouse.down()
            page.wait_for_selector("section[data-scored]")
            page.screenshot(path=PICTURE)
            browser.close()
    finally:
        server.terminate()
        server.wait()


if __name__ == "__main__":
    main()
