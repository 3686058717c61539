"""The page in a real browser: what it shows is what the emulated pins do to the plate."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.scorecard import Scorecard, score_field
from chladni.host.emulation.closed_loop import LoopReport, run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image.finger import NOTICED_DB
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from conftest import ROOT
from studio.conftest import OpenPage, Studio, pages
from studio.pages import (
    Place,
    drive,
    frames,
    levels,
    mark,
    numbers,
    pixels,
    place_shown,
    point_of,
    press,
    settle,
)

SAME_DRIVE = 2e-3
"""Share of the largest coil: two stretches of one recording, of 8 waves and of 40, differ by less;
duties are rounded to 1/1024 and the rounding is noise."""


def played_by_python(board: Board, table: Table, place: Place) -> tuple[LoopReport, Scorecard]:
    """A touch through the emulator and back to the plate, without the studio."""
    _, report = run_loop(table, board, [TouchEvent(20.0, place)], 300.0)
    card = score_field(
        solved_board(board), report.field, report.target_field, place, drive=report.played
    )
    return report, card


def check(page: Page, board: Board, table: Table, place: Place) -> None:
    """Drive, marks and numbers on the page against Python's own."""
    report, card = played_by_python(board, table, place)
    found = drive(page)
    turn = np.vdot(found, report.played)
    expected = report.played * np.conj(turn) / abs(turn)
    assert np.abs(found - expected).max() < SAME_DRIVE * np.abs(expected).max()
    i, j = np.unravel_index(np.abs(report.field).argmax(), report.field.shape)
    assert mark(page, "maximum") == pytest.approx((board.x[i] / MM, board.y[j] / MM), abs=0.5)
    shown = numbers(page)
    assert shown["ssim"] == pytest.approx(card.ssim, abs=2e-3)
    assert shown["contrast_db"] == pytest.approx(card.contrast_db, abs=0.05)
    assert shown["second_finger_db"] == pytest.approx(card.second_finger_db, abs=0.05)
    assert shown["focal_error_mm"] == pytest.approx(card.focal_error_mm, abs=0.5)
    assert card.felt is not None
    assert shown["finger_um"] == pytest.approx(card.felt.finger_um, rel=5e-3)
    second = mark(page, "second")
    assert np.hypot(*np.subtract(second, place)) > 12.0
    assert shown["latency_ms"] == pytest.approx(report.latency_ms, abs=0.3)


@pytest.mark.parametrize("place", [(10.0, 25.0), (-14.0, -51.0)])
def test_a_press_shows_what_the_pins_make_of_it(
    page: Page, small_board: Board, small_table: tuple[Table, TableReport], place: Place
) -> None:
    """Picture, marks and numbers are those of Python's own recording of the same touch."""
    page.get_by_label("energy").check()
    press(page, small_board, place)
    touched = place_shown(page)
    assert touched == pytest.approx(place, abs=0.2)  # a pixel of the screen is as wide
    check(page, small_board, small_table[0], touched)
    field = played_by_python(small_board, small_table[0], touched)[0].field
    # The page has its rows from the top.
    wanted = np.abs(field).T[::-1] / np.abs(field).max()
    shown = levels(page)
    assert shown.shape == wanted.shape
    # A colour is a step of 1/255, and two stretches of a recording differ a little.
    assert np.abs(shown - wanted).max() < 1.5 / 255.0
    assert float(np.ptp(shown)) > 0.9


@pytest.fixture(scope="module")
def moving_page(chromium: Browser, studio: Studio) -> Iterator[Page]:
    with pages(chromium, studio) as opened:
        yield opened(reduced_motion="no-preference")


def test_a_displacement_moves_and_a_pause_stops_it(moving_page: Page, small_board: Board) -> None:
    page = moving_page
    press(page, small_board, (10.0, 25.0))
    first = levels(page)
    frames(page, 20)
    second = levels(page)
    # Still plate is the middle of the scale, and the two moments differ where it moves.
    assert abs(float(np.median(second)) - 0.5) < 0.1
    assert np.abs(first - second).max() > 0.05
    page.mouse.up()
    page.get_by_role("button", name="Pause").click()
    frames(page, 3)
    held = pixels(page)
    frames(page, 10)
    assert (pixels(page) == held).all()
    page.get_by_role("button", name="Play").click()
    assert page.locator('[data-part="factor"]').inner_text() == "slowed 320 times"  # 160 Hz at 0.5


def test_a_drag_ends_where_the_finger_is(
    moving_page: Page, small_board: Board, small_table: tuple[Table, TableReport]
) -> None:
    page = moving_page
    drag(page, small_board, 60)
    settle(page)
    end = place_shown(page)
    assert end == pytest.approx((20.0, -50.0), abs=0.3)
    check(page, small_board, small_table[0], end)
    page.mouse.up()
    assert "frames a second" in page.locator('[data-part="timing"]').inner_text()


@pytest.mark.soak
def test_a_drag_of_ten_seconds_is_followed_to_its_end(
    page: Page, small_board: Board, small_table: tuple[Table, TableReport]
) -> None:
    """At a panel's rate, which is more of the device's time than `max_on_s` allows a touch."""
    drag(page, small_board, 1000)
    settle(page)
    end = place_shown(page)
    assert end == pytest.approx((20.0, -50.0), abs=0.3)
    check(page, small_board, small_table[0], end)


def drag(page: Page, board: Board, steps: int) -> None:
    """From the upper left to the lower right, as fast as a panel reports."""
    page.mouse.move(*point_of(page, board, (-20.0, 50.0)))
    page.mouse.down()
    for k in range(1, steps + 1):
        place = -20.0 + 40.0 * k / steps, 50.0 - 100.0 * k / steps
        page.mouse.move(*point_of(page, board, place))
        page.wait_for_timeout(10)


def test_of_two_fingers_the_first_plays(
    open_page: OpenPage, small_board: Board, small_table: tuple[Table, TableReport]
) -> None:
    page = open_page(has_touch=True)
    wire = page.context.new_cdp_session(page)
    first, second = (10.0, 25.0), (-20.0, -40.0)
    points = [
        dict(zip("xy", point_of(page, small_board, place), strict=True)) | {"id": k}
        for k, place in enumerate((first, second))
    ]

    def touch(kind: str, some: list[dict[str, Any]]) -> None:
        wire.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": some})

    touch("touchStart", points[:1])
    settle(page)
    touch("touchStart", points)
    settle(page)
    assert place_shown(page) == pytest.approx(first, abs=0.3)
    check(page, small_board, small_table[0], place_shown(page))
    # Once the first has gone, the other one begins a touch.
    touch("touchEnd", points[:1])
    settle(page)
    assert place_shown(page) == pytest.approx(second, abs=0.3)
    found, report = (
        drive(page),
        played_by_python(small_board, small_table[0], place_shown(page))[0],
    )
    overlap = abs(np.vdot(found, report.played))
    assert overlap > 0.9999 * np.linalg.norm(found) * np.linalg.norm(report.played)


def test_the_keyboard_does_all_of_it(
    page: Page, small_board: Board, small_table: tuple[Table, TableReport]
) -> None:
    page.locator('[data-part="plate"]').focus()
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Space")
    settle(page)
    assert place_shown(page) == (-1.0, 5.0)
    page.keyboard.press("Shift+ArrowRight")
    settle(page)
    assert place_shown(page) == (4.0, 5.0)
    page.keyboard.press("Escape")
    # The form's fields and button do the same.
    page.get_by_label("x / mm", exact=True).fill("-14")
    page.get_by_label("y / mm", exact=True).fill("30.5")
    page.get_by_role("button", name="Press").press("Enter")
    settle(page)
    check(page, small_board, small_table[0], (-14.0, 30.5))
    assert "µm under the finger" in page.locator('[data-part="words"]').inner_text()


def test_a_place_off_the_board_is_refused_in_words(page: Page) -> None:
    x = page.get_by_label("x / mm", exact=True)
    x.fill("400")
    page.get_by_role("button", name="Press").click()
    assert "35.7" in x.evaluate("field => field.validationMessage")  # half the board's 71.5 mm
    assert page.locator(".place-finger").get_attribute("visibility") == "hidden"


def test_who_wants_no_motion_gets_none(page: Page, small_board: Board) -> None:
    assert page.get_by_label("energy").is_checked()
    press(page, small_board, (10.0, 25.0))
    page.mouse.up()
    page.get_by_label("displacement, moving").check()
    frames(page, 3)
    held = pixels(page)
    frames(page, 10)
    assert (pixels(page) == held).all()


def test_a_browser_without_a_canvas_shows_numbers_and_says_so(
    open_page: OpenPage, small_board: Board
) -> None:
    page = open_page()
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.reload()
    page.wait_for_selector("section[data-board]")
    press(page, small_board, (10.0, 25.0))
    assert numbers(page)["ssim"] > 0.5
    assert "no 2-D canvas" in page.locator('[data-part="nocanvas"]').inner_text()


def test_colours_are_even_to_the_eye_and_safe_for_eyes_that_confuse_red_with_green(
    page: Page, small_board: Board
) -> None:
    """Lightness rises in equal steps, for normal eyes and for those that lack a kind of cone."""
    page.get_by_label("energy").check()
    scale = pixels(page, "bar")[0, :, :3] / 255.0
    linear = np.where(scale <= 0.04045, scale / 12.92, ((scale + 0.055) / 1.055) ** 2.4)
    # CIE 1931 luminance, then L*; OKLab's steps are even to a factor of two of those of L*.
    steps = np.diff(_lightness(linear))
    assert steps.min() > 0.0
    assert steps.max() < 3.0 * steps.mean()
    for kind in (PROTANOPIA, DEUTERANOPIA):
        seen = _lightness(np.clip(linear @ kind.T, 0.0, 1.0))
        smooth = np.convolve(np.diff(seen), np.ones(8) / 8.0, mode="valid")
        assert smooth.min() > 0.0


# Machado, Oliveira and Fernandes (IEEE Trans. Vis. Comput. Graph. 15, 2009), severity 1, on linear
# RGB.
PROTANOPIA = np.array(
    [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ]
)
DEUTERANOPIA = np.array(
    [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ]
)


def _lightness(
    linear: np.ndarray[Any, np.dtype[np.float64]],
) -> np.ndarray[Any, np.dtype[np.float64]]:
    luminance = linear @ np.array([0.2126, 0.7152, 0.0722])
    return np.asarray(
        np.where(luminance > 0.008856, 116.0 * np.cbrt(luminance) - 16.0, 903.3 * luminance)
    )


def test_the_page_has_the_level_that_fingers_notice() -> None:
    rows = ROOT / "host" / "chladni" / "host" / "studio" / "page" / "scorecard.js"
    assert f'"above {NOTICED_DB:g} dB: felt more here than elsewhere"' in rows.read_text("utf-8")


def test_nothing_of_the_page_comes_from_elsewhere() -> None:
    folder = ROOT / "host" / "chladni" / "host" / "studio" / "page"
    files = [file for file in folder.rglob("*") if file.is_file()]
    assert len(files) > 5
    for file in files:
        text = file.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert "http:" not in text, file.name
        assert "https:" not in text, file.name
