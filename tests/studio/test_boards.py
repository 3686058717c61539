"""Boards chosen, dropped, changed and saved: the studio's answers against Python's own."""

from __future__ import annotations

import base64
import gc
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page
from websockets.sync.client import ClientConnection

from chladni.drives.problem.problem import solved_board
from chladni.drives.solve import solve
from chladni.host.emulation.closed_loop import run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.studio.boards.builder import BoardBuilder
from chladni.host.studio.boards.prepared import BoardChoice, ReadyBoard
from chladni.sim.board.board import Board, to_document
from chladni.sim.board.file import parse_board
from chladni.sim.board.parts import Regions
from chladni.sim.errors import StoppedError
from chladni.tables.build import build_table
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.several_fingers.build import with_responses
from chladni.tables.table import Table
from studio.conftest import READY, Studio, serving_here
from studio.pages import RULES, drive, numbers, point_of, press, settle
from studio.wire import PRESS, TIMEOUT_S, opened, read_fields, told_of

MOVE = {"type": "move", "number": 2, "part": "actuators", "index": 1, "x_mm": 20.0, "y_mm": 38.0}

CHOOSE = {
    "type": "choose",
    "board": None,
    "objective": "ssim",
    "method": "phasor",
    "frequency_hz": None,
}


def ask(own: ClientConnection, **message: object) -> None:
    own.send(json.dumps(message))


def moved(board: Board) -> Board:
    own = list(board.actuators)
    own[1] = replace(own[1], at=(20e-3, 38e-3))
    return replace(board, actuators=tuple(own))


def test_a_coil_that_moves_takes_fields_drives_and_score_with_it(
    studio: Studio, small_board: Board
) -> None:
    """As a board file with the coil there would have them."""
    with opened(studio) as own:
        ask(own, **PRESS)
        before = told_of(own, "scored")
        ask(own, **MOVE)
        board = told_of(own, "board")
        assert board["is_draft"]
        assert board["actuators"][1]["at_mm"] == [20.0, 38.0]
        data = own.recv(TIMEOUT_S)
        assert isinstance(data, bytes)
        other = moved(small_board)
        expected = solved_board(other).fields.values
        assert np.abs(read_fields(board, data) - expected).max() < 1e-6 * np.abs(expected).max()
        played = told_of(own, "played")
        assert (played["number"], played["state"]) == (2, "computed")
        assert played["place_mm"] == [10.0, 25.0]
        solution = solve(other, (10.0, 25.0))
        drive = np.array([complex(*pair) for pair in played["drive"]])
        assert np.abs(drive - solution.drive).max() < 1e-6 * np.abs(solution.drive).max()
        after = told_of(own, "scored")
        assert after["ssim"] == pytest.approx(solution.ssim, abs=1e-6)
        assert abs(after["ssim"] - before["ssim"]) > 0.01
        # What is shown can be saved as a file; a table there is none of.
        ask(own, type="save", what="table")
        assert "parts that were moved" in told_of(own, "refused")["text"]
        ask(own, type="save", what="board")
        saved = base64.b64decode(told_of(own, "file")["data"]).decode()
        assert to_document(parse_board(saved, file="saved.toml")) == to_document(other)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"x_mm": 0.0, "y_mm": 1.0}, "actuators[1].at_mm"), ({"x_mm": 90.0}, "actuators[1].at_mm"),
        ({"index": 5}, "index"), ({"part": "holes"}, "part"),
        ({"part": "screws", "x_mm": 0.0, "y_mm": 0.0}, "screws[1]"),
    ],
)  # fmt: skip
def test_a_part_cannot_be_where_no_board_file_may_have_it(
    studio: Studio, change: dict[str, object], said: str
) -> None:
    with opened(studio) as own:
        ask(own, **MOVE | change)
        assert said in told_of(own, "refused")["text"]
        ask(own, **PRESS)
        assert told_of(own, "played")["state"] == "playing"  # by the device, as before


def test_two_pages_have_a_device_each(
    studio: Studio, small_board: Board, small_table: tuple[Table, TableReport]
) -> None:
    """Both down at once, each at its own place: what each plays is what the table has there."""
    places = (10.0, 25.0), (-20.0, -40.0)
    with opened(studio) as first, opened(studio) as second:
        for own, (x, y) in zip((first, second), places, strict=True):
            ask(own, **PRESS | {"x_mm": x, "y_mm": y})
        for own, place in zip((first, second), places, strict=True):
            played = told_of(own, "played")
            assert played["place_mm"] == list(place)
            found = np.array([complex(*pair) for pair in played["drive"]])
            _, report = run_loop(small_table[0], small_board, [TouchEvent(20.0, place)], 300.0)
            overlap = abs(np.vdot(found, report.played))
            most = np.linalg.norm(found) * np.linalg.norm(report.played)
            assert overlap == pytest.approx(most, rel=1e-5)


def test_a_table_is_built_for_what_is_chosen(studio: Studio, small_board: Board) -> None:
    driven = replace(small_board, drive=replace(small_board.drive, frequency_hz=120.0))
    with opened(studio) as own:
        ask(own, **CHOOSE | {"objective": "contrast", "frequency_hz": 120})
        board = told_of(own, "board")
        assert (board["objective"], board["frequency_hz"]) == ("contrast", 120.0)
        own.recv(TIMEOUT_S)
        ask(own, type="save", what="table")
        data = base64.b64decode(told_of(own, "file")["data"])
        table, _ = build_table(driven, objective="contrast")
        both, _ = with_responses(table, driven, bits=table.bits)
        assert data == pack(both)
        ask(own, **PRESS)
        assert told_of(own, "played")["state"] == "playing"


def test_a_saved_table_is_the_one_that_plays(
    studio: Studio, small_table: tuple[Table, TableReport]
) -> None:
    with opened(studio) as own:
        ask(own, type="save", what="table")
        saved = told_of(own, "file")
    assert saved["name"] == "prototype.chl"
    assert base64.b64decode(saved["data"]) == pack(small_table[0])


def test_a_method_that_fills_no_tables_is_solved_for_at_each_press(
    studio: Studio, small_board: Board
) -> None:
    with opened(studio) as own:
        ask(own, **CHOOSE | {"method": "least-squares", "objective": None})
        board = told_of(own, "board")
        assert (board["method"], board["objective"]) == ("least-squares", "ssim")
        assert not board["has_table"]
        own.recv(TIMEOUT_S)
        ask(own, **PRESS)
        played = told_of(own, "played")
        assert played["state"] == "computed"
        wanted = solve(small_board, (10.0, 25.0), method="least-squares")
        assert np.abs(np.array(played["drive"]) @ (1.0, 1j) - wanted.drive).max() < 1e-12
        assert told_of(own, "scored")["ssim"] == pytest.approx(wanted.ssim, abs=1e-9)
        ask(own, type="save", what="table")
        assert told_of(own, "refused")["field"] == "table"


def test_a_choice_that_cannot_be_made_leaves_what_was_there(studio: Studio) -> None:
    with opened(studio) as own:
        for wrong, said in (
            ({"board": "../../etc/passwd"}, "board"),
            ({"objective": "best"}, "objective"),
            ({"method": "luck"}, "method"),
            ({"method": "nearest", "objective": "focus"}, "objective"),
            ({"frequency_hz": 0}, "drive.frequency_hz"),
            ({"frequency_hz": 1e5}, "frequency_hz"),
        ):
            ask(own, **CHOOSE | wrong)
            assert said in told_of(own, "refused")["text"]
        ask(own, **PRESS)
        assert told_of(own, "played")["state"] == "playing"


def test_a_press_on_a_board_that_is_left_for_another_hinders_no_later_one(studio: Studio) -> None:
    """The board that is left is still being made: its press is never played."""
    with opened(studio) as own:
        ask(own, **CHOOSE | {"objective": "balanced"})
        ask(own, **PRESS)
        ask(own, **CHOOSE)
        assert told_of(own, "board")["objective"] == "ssim"
        own.recv(TIMEOUT_S)
        ask(own, **PRESS | {"number": 2})
        assert told_of(own, "played")["number"] == 2


def test_a_board_that_is_left_while_it_is_built_leaves_no_traceback(
    ready: ReadyBoard, caplog: pytest.LogCaptureFixture
) -> None:
    with serving_here(ready) as studio, opened(studio) as own:
        ask(own, **CHOOSE | {"objective": "balanced"})
        told_of(own, "progress")
        ask(own, **CHOOSE)
        told_of(own, "board")
        own.recv(TIMEOUT_S)
        ask(own, **PRESS)
        told_of(own, "scored")  # the build has stopped by then
    gc.collect()  # asyncio tells of an error that no one asked for when its future goes
    assert "Traceback" not in caplog.text


def test_a_file_that_is_opened_is_read_as_everywhere(studio: Studio, small_file: Path) -> None:
    text = small_file.read_text(encoding="utf-8")
    with opened(studio) as own:
        for wrong, said in (
            (
                text.replace("thickness_mm = 1.0", "thickness_mm = -1.0"),
                "own.toml, plate.thickness_mm: expected a number from 0.01 to 100, got -1.0",
            ),
            ("name = ", "own.toml, syntax"),
            ("x" * 65_537, "own.toml, board"),
        ):
            ask(own, type="open", name="own.toml", text=wrong)
            refused = told_of(own, "refused")
            assert (refused["file"], said in refused["text"]) == ("own.toml", True), refused["text"]
        other = text.replace('name = "prototype"', 'name = "own"').replace("18.0", "36.0")
        ask(own, type="open", name="own.toml", text=other)
        assert told_of(own, "board")["name"] == "own"


def test_a_board_that_no_page_waits_for_is_made_no_further(small_board: Board) -> None:
    builder = BoardBuilder(1)
    fine = replace(small_board, regions=Regions(1.5e-3))  # 4,700 regions: half a minute
    build = builder.build(BoardChoice(fine, "ssim"))
    builder.leave(build)
    with pytest.raises(StoppedError):
        build.result.result(60.0)
    assert build.done < build.all / 2
    again = builder.build(BoardChoice(fine, "ssim"))
    assert again is not build
    builder.close()
    with pytest.raises(StoppedError):
        again.result.result(60.0)


def test_the_page_moves_a_coil_and_shows_what_a_dropped_file_lacks(
    page: Page, small_board: Board, small_file: Path, tmp_path: Path
) -> None:
    press(page, small_board, (10.0, 25.0))
    page.mouse.up()
    before = numbers(page)["ssim"], drive(page)
    page.get_by_text("Move coils and screws").click()
    page.mouse.move(*point_of(page, small_board, (24.25, 43.35)))
    page.mouse.down()
    page.mouse.move(*point_of(page, small_board, (20.0, 38.0)))
    page.mouse.up()
    page.get_by_text("A part has moved").wait_for()
    settle(page)
    solution = solve(moved(small_board), (10.0, 25.0))
    # A pixel of the screen is 0.3 mm.
    assert numbers(page)["ssim"] == pytest.approx(solution.ssim, abs=5e-3)
    assert abs(numbers(page)["ssim"] - before[0]) > 0.01
    page.get_by_label("to x / mm").fill("24.25")
    page.get_by_label("to y / mm").fill("43.35")
    page.get_by_role("button", name="Move").click()
    page.get_by_text("Board, table, files").click()
    page.get_by_role("button", name="Build table").click()
    page.get_by_text("emulated firmware's pins").wait_for()
    text = small_file.read_text(encoding="utf-8").replace("loss_factor = 0.02", "loss_factor = 7")
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text, encoding="utf-8")
    page.get_by_label("Open a board file").set_input_files(wrong)
    page.get_by_text(
        "wrong.toml, plate.loss_factor: expected a number from 0 to 2, got 7"
    ).wait_for()
    press(page, small_board, (10.0, 25.0))
    assert numbers(page)["ssim"] == pytest.approx(before[0], abs=1e-6)
    page.mouse.up()
    with page.expect_download() as picture:
        page.get_by_role("button", name="Save picture").click()
    assert picture.value.suggested_filename == "prototype.png"
    assert picture.value.path().stat().st_size > 20_000


def test_two_boards_side_by_side_have_devices_and_tables_of_their_own(
    page: Page, small_board: Board
) -> None:
    page.set_viewport_size({"width": 1400, "height": 1000})
    page.get_by_role("button", name="Two side by side").click()
    page.locator(READY).nth(1).wait_for()
    second = page.locator("section").nth(1)
    second.get_by_text("Board, table, files").click()
    second.get_by_label("Drives best at").select_option("contrast")
    second.get_by_role("button", name="Build table").click()
    second.get_by_text("drives best at contrast").wait_for()
    for view in (0, 1):
        press(page, small_board, (10.0, 25.0), view)
        page.mouse.up()
    first, other = (numbers(page, view) for view in (0, 1))
    # Each is better at what it was made for.
    assert first["ssim"] > other["ssim"] + 0.005
    assert other["contrast_db"] > first["contrast_db"] + 0.05
    found = Axe().run(page, options=RULES)
    assert found.response["violations"] == [], found.generate_report()
    page.get_by_role("button", name="Two side by side").click()
    assert page.locator("section").count() == 1
