"""Make the moving picture that the README shows: a finger dragged round `quiet16` in the studio.

python tools/pictures/drag.py     writes docs/images/drag.webp; needs Chromium

Each picture is what the emulated pins play where the finger is, as the page shows it.
"""

from __future__ import annotations

import io
import math
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from studio_pages import studio_pages

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "drag.webp"
BOARD = "quiet16"
STEPS, RADIUS = 48, 0.27
"""Places on a circle, and its radius as a share of the board."""
SHOWN_MS = 80
SIDE = 320
"""Pixels."""


def main() -> None:
    """Start a studio, drag, write what was seen."""
    with studio_pages(BOARD) as opened:
        frames = dragged(opened())
    first, *others = frames
    first.save(PICTURE, save_all=True, append_images=others, duration=SHOWN_MS, loop=0, quality=70)


def dragged(page: Page) -> list[Image.Image]:
    """The board with the finger at every place of the circle, once round."""
    page.get_by_label("energy").check()
    plate = page.locator('[data-part="plate"]')
    box = plate.bounding_box()
    assert box is not None
    frames = []
    for step in range(STEPS):
        angle = 2.0 * math.pi * step / STEPS
        x = box["x"] + box["width"] * (0.5 + RADIUS * math.cos(angle))
        y = box["y"] + box["height"] * (0.5 - RADIUS * math.sin(angle))
        page.mouse.move(x, y)
        if step == 0:
            page.mouse.down()
        page.wait_for_selector('[data-part="numbers"][aria-busy="false"]')
        page.evaluate("() => new Promise((done) => requestAnimationFrame(done))")
        picture = Image.open(io.BytesIO(plate.screenshot())).convert("RGB")
        frames.append(picture.resize((SIDE, SIDE)))
    page.mouse.up()
    return frames


if __name__ == "__main__":
    main()
