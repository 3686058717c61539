"""The studio: frames a second, and from a press to its picture, as the page itself measures them.

    .venv/bin/python bench/studio.py [BOARD …]      prints a table

Chromium draws in software here. A drag goes on for ten seconds at a panel's 100 reports a second;
of presses there are a hundred, at places drawn with a fixed seed. Both include the firmware, from
the emulated panel to the demodulated duties, and scoring of what came before.
"""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import Page

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tools"))
from studio_pages import studio_pages

BOARDS = ("prototype", "phone15")
DRAG_S = 10.0
REPORT_S = 0.01
PRESSES = 100
PRESS_S = 0.08
TIMING = re.compile(r"(\d+) frames a second.*half within (\d+), 99 % within (\d+) ms of (\d+)")


def measured(page: Page) -> tuple[int, ...]:
    """Frames a second, median and 99th percentile in ms, and of how many."""
    page.wait_for_timeout(600)  # it is told twice a second
    text = page.locator('[data-part="timing"]').inner_text()
    found = TIMING.search(text)
    if found is None:
        sys.exit(f"the page says: {text}")
    return tuple(map(int, found.groups()))


def drag(page: Page) -> tuple[int, ...]:
    """Along a line that turns, as fast as a panel reports."""
    box = page.locator('[data-part="plate"]').bounding_box()
    assert box is not None
    begun, page_down = time.perf_counter(), False
    for k in range(round(DRAG_S / REPORT_S)):
        turn = k * REPORT_S
        x = box["x"] + box["width"] * (0.5 + 0.4 * np.cos(1.3 * turn))
        y = box["y"] + box["height"] * (0.5 + 0.4 * np.sin(turn))
        page.mouse.move(x, y)
        if not page_down:
            page.mouse.down()
            page_down = True
        time.sleep(max(0.0, begun + (k + 1) * REPORT_S - time.perf_counter()))
    found = measured(page)
    page.mouse.up()
    return found


def press(page: Page) -> tuple[int, ...]:
    """One place after the other."""
    box = page.locator('[data-part="plate"]').bounding_box()
    assert box is not None
    rng = np.random.default_rng(1)
    for across, along in rng.uniform(0.02, 0.98, (PRESSES, 2)):
        page.mouse.move(box["x"] + box["width"] * across, box["y"] + box["height"] * along)
        page.mouse.down()
        page.wait_for_timeout(1e3 * PRESS_S)
        page.mouse.up()
    return measured(page)


def bench(board: str) -> None:
    """One board, in a server and a browser of its own."""
    with studio_pages(board, height=1000) as opened:
        for name, work in (("press", press), ("drag", drag)):
            page = opened()
            frames, median, most, count = work(page)
            print(f"| {board} | {name} | {frames} | {median} | {most} | {count} |", flush=True)
            page.close()


def main() -> None:
    """Print the table."""
    print("\n## Studio: frames, and from a press to its picture\n")
    print("Measured in the page, Chromium without a graphics card.\n")
    print("| board | what | frames a second | median, ms | 99th percentile, ms | pictures |")
    print("|---|---|---|---|---|---|", flush=True)
    for board in sys.argv[1:] or BOARDS:
        bench(board)


if __name__ == "__main__":
    main()
