"""Several fingers on the page: by mouse, by touch and by keyboard, and what it shows of them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page

from chladni.host.studio.boards.prepared import ReadyBoard
from studio.conftest import READY, OpenPage, Studio, pages
from studio.pages import RULES, Place, drive, levels, mark, place_shown, point_of, press, settle

FIRST, SECOND = (0.0, 24.0), (1.0, -12.0)
CLOSE_MM = 0.3
"""A pixel of the screen is up to 0.1 mm wide."""


@pytest.fixture(scope="module")
def opened_strip(chromium: Browser, strip_studio: Studio) -> Iterator[Page]:
    with pages(chromium, strip_studio) as opened:
        yield opened()


@pytest.fixture
def page(opened_strip: Page) -> Page:
    """A page on which no finger is."""
    opened_strip.mouse.up()
    opened_strip.reload()
    opened_strip.wait_for_selector(READY)
    return opened_strip


def shift_click(page: Page, strip: ReadyBoard, place: Place) -> None:
    page.mouse.move(*point_of(page, strip.board, place))
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.up()
    page.keyboard.up("Shift")
    settle(page)


def fingers_shown(page: Page) -> list[int]:
    """Numbers of the rows, as people read them."""
    heads = page.locator('[data-part="fingerRows"] tbody th')
    return [int(text) for text in heads.all_inner_texts()]


def matrix(page: Page) -> list[list[float | None]]:
    value = page.locator('[data-part="matrix"]').get_attribute("data-value")
    assert value is not None
    rows: list[list[float | None]] = json.loads(value)
    return rows


def is_shown(page: Page, finger: str) -> bool:
    return page.locator(f".place-{finger}").get_attribute("visibility") == "visible"


def test_one_finger_has_no_rows_and_no_number(page: Page, strip: ReadyBoard) -> None:
    press(page, strip.board, FIRST)
    assert page.locator('[data-part="fingers"]').is_hidden()
    assert page.locator(".place-finger text").first.is_hidden()
    assert page.locator('[data-part="scoreCaption"]').inner_text() == "Scorecard"
    assert "under the finger" in page.locator('[data-part="words"]').inner_text()
    page.mouse.up()


def test_a_shift_click_adds_a_finger_that_stays_and_a_click_removes_it(
    page: Page, strip: ReadyBoard
) -> None:
    shift_click(page, strip, FIRST)
    shift_click(page, strip, SECOND)
    assert fingers_shown(page) == [1, 2]
    assert mark(page, "finger") == pytest.approx(FIRST, abs=CLOSE_MM)
    assert mark(page, "other") == pytest.approx(SECOND, abs=CLOSE_MM)
    assert page.locator(".place-other text").first.is_visible()
    # Dragged, it is another place of the same finger.
    page.mouse.move(*point_of(page, strip.board, SECOND))
    page.mouse.down()
    page.mouse.move(*point_of(page, strip.board, (0.0, -20.0)), steps=4)
    page.mouse.up()
    settle(page)
    assert mark(page, "other") == pytest.approx((0.0, -20.0), abs=CLOSE_MM)
    assert fingers_shown(page) == [1, 2]
    shift_click(page, strip, (0.0, 4.0))
    assert fingers_shown(page) == [1, 2, 3]
    # Clicked, it leaves; the others keep their numbers.
    page.mouse.click(*point_of(page, strip.board, (0.0, -20.0)))
    settle(page)
    assert fingers_shown(page) == [1, 3]
    assert not is_shown(page, "other")
    page.get_by_role("button", name="Remove finger 1").click()
    settle(page)
    assert place_shown(page) == pytest.approx((0.0, 4.0), abs=CLOSE_MM)


def test_a_matrix_is_shown_in_decibels_and_in_words(page: Page, strip: ReadyBoard) -> None:
    shift_click(page, strip, FIRST)
    shift_click(page, strip, SECOND)
    rows = matrix(page)
    assert [rows[k][k] for k in range(2)] == [0.0, 0.0]
    cells = page.locator('[data-part="matrix"] tbody tr').nth(0).locator("td")
    level = rows[0][1]
    assert level is not None
    assert level < -20.0
    assert cells.nth(1).locator("[aria-hidden]").inner_text() == f"−{-level:.0f} dB"
    told = cells.nth(1).locator(".unseen").text_content()
    assert told == f"Gets {-level:.0f} decibels less of signal 2 than finger 2 does."
    heads = page.locator('[data-part="matrix"] thead th').all_inner_texts()
    assert heads == ["finger", "signal 1", "signal 2"]
    words = page.locator('[data-part="words"]').inner_text()
    assert words == "No resting finger feels the others’ signals."


def row_of(page: Page, finger: int) -> list[str]:
    rows = page.locator('[data-part="fingerRows"] tbody tr')
    return rows.nth(finger).locator("td").all_inner_texts()


def micrometres(page: Page, finger: int) -> float:
    found = re.match(r"([\d.]+) µm", row_of(page, finger)[2])
    assert found is not None
    return float(found[1])


def test_tone_and_level_are_set_and_what_cannot_be_is_refused(
    page: Page, strip: ReadyBoard
) -> None:
    shift_click(page, strip, FIRST)
    shift_click(page, strip, SECOND)
    tone, level = (
        page.get_by_label(f"{what} of finger 2, {unit}")
        for what, unit in (("Tone", "Hz"), ("Level", "%"))
    )
    assert (tone.input_value(), level.input_value()) == ("160", "100")
    before, full = matrix(page), micrometres(page, 1)
    level.fill("50")
    level.press("Tab")
    settle(page)
    assert micrometres(page, 1) == pytest.approx(full / 2.0, rel=0.03)
    tone.fill("90")
    tone.press("Tab")
    settle(page)
    assert matrix(page)[0][1] != before[0][1]
    tone.fill("5")
    tone.press("Tab")
    settle(page)
    status = page.locator('[data-part="status"]').inner_text()
    assert status.startswith("tone_hz: expected 20 to 250 Hz")
    assert tone.input_value() == "90"
    level.fill("0")
    level.press("Tab")
    settle(page)
    assert row_of(page, 1)[2] == "silent"
    assert matrix(page)[0][1] is None
    page.get_by_label("Level of finger 1, %").fill("0")
    page.get_by_label("Level of finger 1, %").press("Tab")
    settle(page)
    assert [row_of(page, k)[2] for k in range(2)] == ["silent", "silent"]


def test_the_picture_is_of_all_signals_or_of_one(page: Page, strip: ReadyBoard) -> None:
    """Powers of signals at tones of their own add up."""
    shift_click(page, strip, FIRST)
    shift_click(page, strip, SECOND)
    drives = page_drives(page)
    fields = [np.abs(np.tensordot(own, strip.solved.fields.values, axes=1)) for own in drives]
    everything = np.sqrt(fields[0] ** 2 + fields[1] ** 2)
    check_picture(page, everything)
    page.get_by_role("button", name="Show finger 2 alone").click()
    page.wait_for_timeout(100)
    check_picture(page, fields[1])
    page.get_by_role("button", name="Show finger 2 alone").click()
    page.wait_for_timeout(100)
    check_picture(page, everything)
    # Coils are those of the first finger.
    assert np.abs(drive(page) - drives[0]).max() < 0.01 * np.abs(drives[0]).max()


def page_drives(page: Page) -> list[np.ndarray[Any, np.dtype[np.complex128]]]:
    """Both fingers' drives, each from the table of coils while it is the only one that sounds."""
    found = []
    for silent in (2, 1):
        level = page.get_by_label(f"Level of finger {silent}, %")
        level.fill("0")
        level.press("Tab")
        settle(page)
        found.append(drive(page))
        level.fill("100")
        level.press("Tab")
        settle(page)
    return found


def check_picture(page: Page, field: np.ndarray[Any, np.dtype[np.float64]]) -> None:
    shown, wanted = levels(page), field.T[::-1] / field.max()
    assert shown.shape == wanted.shape
    # A colour is a step of 1/255; a drive is measured again with the other finger silent.
    assert np.abs(shown - wanted).max() < 3.0 / 255.0


def test_the_keyboard_adds_selects_moves_and_removes(page: Page) -> None:
    page.locator('[data-part="plate"]').focus()
    page.keyboard.press("Space")
    settle(page)
    page.keyboard.press("a")  # beside the one that is there
    settle(page)
    assert fingers_shown(page) == [1, 2]
    assert mark(page, "other") == (0.0, 20.0)
    page.keyboard.press("Shift+ArrowUp")
    settle(page)
    assert mark(page, "other") == (0.0, 25.0)
    assert place_shown(page) == (0.0, 0.0)
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("ArrowDown")
    settle(page)
    assert place_shown(page) == (0.0, -1.0)
    page.keyboard.press("Tab")
    assert page.locator("tr.selected th").inner_text() == "2"
    page.keyboard.press("Delete")
    settle(page)
    assert not is_shown(page, "other")
    page.keyboard.press("ArrowDown")
    settle(page)
    assert place_shown(page) == (0.0, -2.0)
    # With one finger left Tab leaves the board: it is no trap.
    page.keyboard.press("Tab")
    assert not page.locator('[data-part="plate"]').evaluate("own => own === document.activeElement")


def test_the_form_adds_a_finger_and_a_sixth_is_none(page: Page) -> None:
    for k, y in enumerate((-24.0, -12.0, 0.0, 12.0, 24.0, 28.0)):
        page.get_by_label("x / mm", exact=True).fill("0")
        page.get_by_label("y / mm", exact=True).fill(str(y))
        page.get_by_role("button", name="Add finger").click()
        settle(page)
        assert k == 0 or fingers_shown(page) == list(range(1, min(k + 1, 5) + 1))
    assert len(matrix(page)) == 5


def test_two_fingers_of_a_touch_screen_each_have_a_signal(
    chromium: Browser, strip_studio: Studio, strip: ReadyBoard
) -> None:
    with pages(chromium, strip_studio) as opened:
        check_touch_screen(opened, strip)


def check_touch_screen(open_one: OpenPage, strip: ReadyBoard) -> None:
    page = open_one(has_touch=True)
    wire = page.context.new_cdp_session(page)
    points = [
        dict(zip("xy", point_of(page, strip.board, place), strict=True)) | {"id": k}
        for k, place in enumerate((FIRST, SECOND))
    ]
    wire.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": points[:1]})
    settle(page)
    wire.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": points})
    settle(page)
    assert fingers_shown(page) == [1, 2]
    assert mark(page, "other") == pytest.approx(SECOND, abs=CLOSE_MM)
    wire.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": points[1:]})
    settle(page)
    assert place_shown(page) == pytest.approx(FIRST, abs=CLOSE_MM)
    assert page.locator('[data-part="scoreCaption"]').inner_text() == "Scorecard"


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_rows_and_matrix_are_within_reach_of_all(page: Page, strip: ReadyBoard, theme: str) -> None:
    page.locator("#theme").select_option(theme)
    shift_click(page, strip, FIRST)
    shift_click(page, strip, SECOND)
    found = Axe().run(page, options=RULES).response["violations"]
    assert [(one["id"], [node["html"] for node in one["nodes"]]) for one in found] == []
