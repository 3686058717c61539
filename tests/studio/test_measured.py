"""A board that was measured: what was found beside what was drawn, and the coils to look at."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

from calibration.small_board import small_board as board_on_foam
from chladni.host.studio.boards.board_message import board_message
from chladni.host.studio.boards.measured_message import measured_message
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.host.studio.export import one_file
from chladni.sim.board.board import Board
from chladni.sim.board.foundation import Patch
from chladni.sim.board.parts import Isolation, Measured, MeasuredValue
from studio.conftest import OpenPage, Studio
from studio.pages import RULES, place_shown, point_of, press

SAID = "Measured by its own coils on 2026-11-27: two fingers 25 dB apart before, 39 dB after."
LOOK_AT = [
    "Coil top-right is reversed: swap its wires, or keep this file.",
    "Coil bottom-right has 3.0 dB less force than drawn: look at its magnet and its gap.",
    "Coil bottom-left is dead: look at its wires and its driver.",
]


def on_foam(**ratios: float) -> Board:
    """A board whose file has these values so many times what is drawn; foam in two halves."""
    drawn = board_on_foam()
    assert drawn.foundation is not None
    plate = replace(drawn.plate, thickness=ratios["sheet thickness"] * drawn.plate.thickness)
    halves = (Patch((0.0, -0.02), 0.5), Patch((0.0, 0.02), 2.0))
    foam = replace(
        drawn.foundation.stiffer(ratios["foam"]),
        loss_factor=ratios["foam's loss"] * drawn.foundation.sheet_loss_factor,
        patches=halves,
    )
    values = tuple(MeasuredValue(name, own, 0.9 * own, 1.2 * own) for name, own in ratios.items())
    measured = Measured("its own coils", "2026-11-27", values)
    return replace(drawn, plate=plate, foundation=foam, measured=measured)


def test_values_stand_in_their_own_units_beside_the_drawn_ones() -> None:
    """Patches of a half and of twice the stiffness leave foam as stiff as it is between them."""
    board = on_foam(**{"sheet thickness": 1.05, "foam": 3.0, "foam's loss": 0.8, "feet": 1.9})
    told = measured_message(board)
    assert told is not None
    assert told["said"] == "Measured by its own coils on 2026-11-27."
    rows = [list(row.values()) for row in told["rows"]]
    wanted: list[tuple[str, str, float, float]] = [
        ("sheet’s thickness", "mm", 0.4, 1.05),
        ("foam’s stiffness", "N/mm³", 0.01, 3.0),
        ("foam’s loss factor", "", 0.2, 0.8),
        ("feet", "×", 1.0, 1.9),
    ]
    for row, (what, unit, drawn, ratio) in zip(rows, wanted, strict=True):
        own = drawn * ratio
        assert row == [what, unit, *map(pytest.approx, (drawn, own, 0.9 * own, 1.2 * own))]


def test_a_board_that_focuses_has_one_finger_first_and_a_long_origin_its_comma() -> None:
    board = on_foam(**{"sheet thickness": 1.0, "foam": 1.0, "foam's loss": 1.0})
    apart = Isolation(40.0, 24.6), Isolation(48.0, 26.0)
    measured = Measured("a laboratory, a.csv", "2026-11-27", (), *apart)
    told = measured_message(replace(board, measured=measured))
    assert told is not None
    assert told["said"] == (
        "Measured by a laboratory, a.csv, on 2026-11-27: from 20 mm on 25 dB quieter before, 26 dB "
        "after, two fingers 40 dB apart before, 48 dB after."
    )
    assert measured_message(replace(board, measured=None)) is None


def test_a_force_within_what_coils_differ_by_is_no_fault(measured: ReadyBoard) -> None:
    told = board_message(measured, "")
    kinds = [own["fault"] and own["fault"]["kind"] for own in told["actuators"]]
    assert kinds == [None, "reversed", None, "force", "dead"]
    assert told["measured"]["said"] == f"{SAID} Look at top-right, bottom-right, bottom-left."


def shown(page: Page) -> dict[str, Any]:
    """What of it is seen: marks, legend, and the section once it is opened."""
    section = page.locator('[data-part="measured"]')
    summary = section.locator("summary")
    summary.click()
    rows = section.locator("tbody tr")
    return {
        "summary": summary.inner_text(),
        "rows": [row.split("\t") for row in rows.all_inner_texts()],
        "look at": section.locator("li").all_inner_texts(),
        "titles": page.locator(".fault title").all_text_contents(),
        "legend": [
            text for text in page.locator(".legend li:visible").all_inner_texts() if "coil" in text
        ],
    }


def check(page: Page) -> None:
    found = shown(page)
    assert found["summary"] == f"{SAID} Look at top-right, bottom-right, bottom-left."
    assert found["rows"] == [
        ["sheet’s thickness", "0.952 mm", "1 mm", "0.905 to 1.05 mm"],
        ["screws", "× 1", "× 1.9", "× 1.5 to 2.4"],
    ]
    assert found["look at"] == LOOK_AT
    assert found["titles"] == [LOOK_AT[0], LOOK_AT[2]]
    legend = [text.strip() for text in found["legend"]]
    assert legend == ["coil, amplitude and phase", "reversed coil", "dead coil"]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_what_was_measured_and_the_coils_to_look_at_are_on_the_page(
    open_page: OpenPage, measured_studio: Studio, scheme: Literal["light", "dark"]
) -> None:
    page = open_page(measured_studio.url, color_scheme=scheme)
    check(page)
    found = Axe().run(page, options=RULES)
    assert found.response["violations"] == [], found.generate_report()


def test_the_page_of_a_file_has_the_same(
    open_page: OpenPage, measured: ReadyBoard, tmp_path: Path
) -> None:
    path = tmp_path / "index.html"
    path.write_text(one_file(measured), encoding="utf-8")
    check(open_page(path.as_uri()))


def test_a_mark_says_what_it_is_where_a_pointer_rests_and_is_pressed_like_all_else(
    open_page: OpenPage, measured_studio: Studio, measured: ReadyBoard
) -> None:
    page = open_page(measured_studio.url)
    dead = next(own for own in measured.board.actuators if own.is_dead)
    place = dead.at[0] * 1e3, dead.at[1] * 1e3
    x, y = point_of(page, measured.board, place)
    under = "([x, y]) => document.elementFromPoint(x, y).parentElement.textContent"
    assert page.evaluate(under, [x, y]) == LOOK_AT[2]
    press(page, measured.board, place)
    assert place_shown(page) == pytest.approx(place, abs=0.3)


def test_a_board_that_was_not_measured_has_none_of_it(page: Page) -> None:
    for part in ('[data-part="measured"]', '[data-part="reversedMark"]', '[data-part="deadMark"]'):
        assert not page.locator(part).is_visible()
    assert page.locator(".fault").count() == 0
