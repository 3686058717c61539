"""Every view for everybody: axe finds nothing; and a server that comes back is found again."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

from chladni.host.protocol.network import read_key
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.sim.board.board import Board
from studio.conftest import OpenPage, Studio, serving, serving_here
from studio.pages import RULES, numbers, press

WIDE, NARROW = {"width": 1280, "height": 900}, {"width": 360, "height": 740}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(
    page: Page, small_board: Board, scheme: Literal["light", "dark"]
) -> None:
    """Before and after a press, in both pictures, wide and narrow."""
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": WIDE["width"], "height": WIDE["height"]})
    faults = [Axe().run(page, options=RULES)]
    press(page, small_board, (10.0, 25.0))
    page.mouse.up()
    faults.append(Axe().run(page, options=RULES))
    page.get_by_label("energy").check()
    for summary in page.locator("summary:visible").all():
        summary.click()
    faults.append(Axe().run(page, options=RULES))
    page.set_viewport_size({"width": NARROW["width"], "height": NARROW["height"]})
    faults.append(Axe().run(page, options=RULES))
    for found in faults:
        assert found.response["violations"] == [], found.generate_report()
        assert len(found.response["passes"]) > 10  # it looked
    assert page.evaluate("document.documentElement.scrollWidth") <= NARROW["width"]


@pytest.mark.parametrize("size", [(1280, 800), (1366, 768)])
def test_picture_scale_marks_and_fields_are_seen_without_scrolling(
    open_page: OpenPage,
    strip_studio: Studio,
    measured_studio: Studio,
    small_board: Board,
    size: tuple[int, int],
) -> None:
    """On a board of the paper's shape, that one measured, and a strip; no coil lies under words."""
    width, height = size
    for url in (None, strip_studio.url, measured_studio.url):
        options = {"viewport": {"width": width, "height": height}}
        page = open_page(url, **options) if url else open_page(**options)
        parts = ["plate", "bar", "place"]
        boxes = [page.locator(f'[data-part="{part}"]').bounding_box() for part in parts]
        boxes.append(page.locator(".legend").bounding_box())
        boxes.append(page.locator('[data-part="words"]').bounding_box())
        for box in boxes:
            assert box is not None
            assert box["y"] >= 0.0
            assert box["y"] + box["height"] <= height
        plate, hint = boxes[0], page.locator('[data-part="hint"]').bounding_box()
        assert plate is not None
        assert plate["height"] > 0.4 * height
        assert hint is not None
        assert hint["y"] >= plate["y"] + plate["height"]


def test_marks_are_of_what_the_board_has(
    open_page: OpenPage, page: Page, strip: ReadyBoard, strip_studio: Studio
) -> None:
    assert page.locator('[data-part="screwMark"]').is_visible()
    assert not page.locator('[data-part="footMark"]').is_visible()
    other = open_page(strip_studio.url)
    assert not strip.board.screws
    assert not other.locator('[data-part="screwMark"]').is_visible()


def test_on_a_board_made_to_focus_the_focus_comes_first(
    open_page: OpenPage, page: Page, small_board: Board, strip: ReadyBoard, strip_studio: Studio
) -> None:
    press(page, small_board, (10.0, 25.0))
    assert next(iter(numbers(page))) == "ssim"
    other = open_page(strip_studio.url)
    press(other, strip.board, (0.0, 6.0))
    shown = [key for key in numbers(other) if key != "latency_ms"]
    assert strip.choice.objective == "focus"
    assert (shown[0], shown[-1]) == ("second_finger_db", "ssim")


def test_the_switch_of_the_theme_wins_over_the_system_and_is_kept(page: Page) -> None:
    page.emulate_media(color_scheme="light")
    ground = "getComputedStyle(document.body).backgroundColor"
    light = page.evaluate(ground)
    page.get_by_label("Theme").select_option("dark")
    dark = page.evaluate(ground)
    assert dark != light
    page.reload()
    assert page.evaluate(ground) == dark
    page.emulate_media(color_scheme="dark")
    page.get_by_label("Theme").select_option("light")
    assert page.evaluate(ground) == light


@pytest.mark.slow
def test_a_page_finds_its_server_again(
    open_page: OpenPage, small_board: Board, small_file: Path, ready: ReadyBoard, tmp_path: Path
) -> None:
    """Killed, and started again at the same port under the same key."""
    key = tmp_path / "own.key"
    with serving(small_file, "--port", 0, "--key", key) as first:
        page = open_page(first.url)
        press(page, small_board, (10.0, 25.0))
        before = numbers(page)
        page.mouse.up()
        first.process.kill()
        page.get_by_text("No connection to the studio").wait_for()
    with serving_here(ready, port=first.port, token=read_key(key).hex()) as second:
        assert second.url == first.url
        page.get_by_text("No connection to the studio").wait_for(state="hidden")
        page.wait_for_selector("section[data-board]:not([data-scored])")
        press(page, small_board, (10.0, 25.0))
        # Sums over threads differ in their last bits.
        assert numbers(page)["ssim"] == pytest.approx(before["ssim"], abs=1e-9)
