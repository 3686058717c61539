"""The page as one file: opened without a server, pressed, compared with the firmware's reader."""

from __future__ import annotations

import base64
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
from playwright.sync_api import Page

from chladni.drives.scoring.felt import felt
from chladni.drives.scoring.scorecard import score
from chladni.drives.solve import solve
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.host.studio.export import PAGE, bundle, file_data, one_file
from chladni.host.studio.playing.press_score import in_words
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image.energy import compose
from chladni.sim.image.finger import sensation_db
from chladni.sim.image.metrics import (
    FINGERTIP_RADIUS,
    SECOND_FINGER_DISTANCE,
    FingertipDiscs,
    disc_mask,
)
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import pack
from conftest import CommandLine
from studio.conftest import OpenPage
from studio.pages import drive, levels, mark, numbers, place_shown, press, settle


def test_a_file_is_pressed_and_plays_what_the_firmware_reads(
    open_page: OpenPage, small_board: Board, ready: ReadyBoard, tmp_path: Path
) -> None:
    path = tmp_path / "index.html"
    path.write_text(one_file(ready), encoding="utf-8")
    page = open_page(path.as_uri())
    page.get_by_label("energy").check()
    press(page, small_board, (-14.0, 30.4))
    place = place_shown(page)
    assert np.hypot(*np.subtract(place, (-14.0, 30.4))) < 0.8  # half the spacing, both ways
    reader = FirmwareReader(pack(ready.table), 5)
    x_um, y_um = (np.array([round(1e3 * value)]) for value in place)
    own = reader.drives(160.0, x_um, y_um)[0] * ready.table.sections[0].full_scale_gain
    assert np.abs(drive(page) - own).max() < 1e-12
    solved = ready.solved
    field = compose(solved.fields.values, own)
    wanted = np.abs(field).T[::-1] / np.abs(field).max()
    assert np.abs(levels(page) - wanted).max() < 1.5 / 255.0
    i, j = np.unravel_index(np.abs(field).argmax(), field.shape)
    peak = small_board.x[i] / MM, small_board.y[j] / MM
    assert mark(page, "maximum") == pytest.approx(peak, abs=0.5)
    shown = numbers(page)
    assert shown["focal_error_mm"] == pytest.approx(np.hypot(*np.subtract(peak, place)), abs=0.8)
    full = solved_full(ready, own)
    centre = place[0] * MM, place[1] * MM
    mean = field[disc_mask(small_board.x, small_board.y, centre, FINGERTIP_RADIUS)].mean()
    assert shown["finger_um"] == pytest.approx(1e6 * full * abs(mean), rel=1e-5)  # float32
    discs = FingertipDiscs(small_board.x, small_board.y)
    target = place[0] * MM, place[1] * MM
    # The page centres the finger on an image point, up to 0.8 mm away.
    second = discs.second_finger_db(field, target, [SECOND_FINGER_DISTANCE])[0]
    assert shown["second_finger_db"] == pytest.approx(second, abs=0.3)
    assert shown["sensation_db"] == pytest.approx(sensation_db(shown["finger_um"], 160.0), abs=1e-3)
    assert words(page) == sentence(ready, shown)
    page.mouse.up()
    page.get_by_label("x / mm", exact=True).fill("20")
    page.get_by_role("button", name="Press").click()
    settle(page)
    assert place_shown(page)[0] == pytest.approx(20.0, abs=0.5)


def words(page: Page) -> str:
    return page.locator('[data-part="words"]').inner_text()


def sentence(ready: ReadyBoard, shown: dict[str, Any]) -> str:
    """What the live page says of such numbers, SSIM aside."""
    card = score(solve(ready.board, (10.0, 25.0)), ready.board)
    assert card.felt is not None
    own = {key: shown[key] for key in ("finger_um", "sensation_db")}
    card = replace(
        card,
        felt=replace(card.felt, **own),
        second_finger_db=shown["second_finger_db"],
        remark=None,
    )
    return in_words(card, 160.0)


@pytest.mark.parametrize("level", [0.0, 1e-5, 0.02, 0.3, 1.0, 30.0])
def test_a_file_says_what_the_live_page_says(
    open_page: OpenPage, ready: ReadyBoard, tmp_path: Path, level: float
) -> None:
    """At any level, from nothing at all to what every finger feels."""
    data = file_data(ready)
    newtons = np.frombuffer(base64.b64decode(data["newtons"]), "<f4") * np.float32(level)
    html = one_file(ready, data | {"newtons": base64.b64encode(newtons.tobytes()).decode()})
    path = tmp_path / "index.html"
    path.write_text(html, encoding="utf-8")
    page = open_page(path.as_uri())
    press(page, ready.board, (10.0, 25.0))
    shown = numbers(page)
    if level == 0.0:
        assert shown["sensation_db"] is None
        assert words(page).startswith("The board moves less than 0.01 µm")
    else:
        assert words(page) == sentence(ready, shown)


def solved_full(ready: ReadyBoard, own: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> float:
    """Newtons per gain, by Ohm's law from the volts that `Felt` reports."""
    coil = ready.board.coil
    volts = felt(ready.solved.problem((0.0, 0.0)), own).full_volts
    assert coil is not None
    assert volts is not None
    impedance = abs(coil.resistance + 2j * np.pi * 160.0 * coil.inductance)
    return float(coil.force_factor * volts / impedance / np.abs(own).max())


def test_a_wide_board_has_more_room_and_no_place_beside_it(
    open_page: OpenPage, ready: ReadyBoard, tmp_path: Path
) -> None:
    data = file_data(ready)
    data["board"]["size_mm"] = [180.0, 55.0]
    path = tmp_path / "index.html"
    path.write_text(one_file(ready, data), encoding="utf-8")
    page = open_page(path.as_uri(), viewport={"width": 1280, "height": 800})
    box = page.locator('[data-part="plate"]').bounding_box()
    assert box is not None
    assert box["width"] > 600.0
    for button in ("Press", "Add finger"):
        page.locator('[data-part="add"]').evaluate("button => { button.hidden = false; }")
        page.get_by_label("x / mm", exact=True).fill("-136")
        page.get_by_role("button", name=button).click()
        assert page.locator('[data-part="x"]:invalid').count() == 1
        assert page.locator(".place-finger").get_attribute("visibility") == "hidden"


def test_a_saved_picture_has_the_number_of_no_finger_that_is_alone(
    open_page: OpenPage, ready: ReadyBoard
) -> None:
    """As the page: beside the finger there is nothing but the energy's colours."""
    page, (x_mm, y_mm) = open_page(), (10.0, 25.0)
    page.get_by_label("energy").check()
    press(page, ready.board, (x_mm, y_mm))
    page.mouse.up()
    page.locator("summary", has_text="Board, table, files").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save picture").click()
    picture = matplotlib.image.imread(download.value.path())
    scale = picture.shape[0] / (ready.board.plate.size[1] / MM)
    column, row = (round(scale * one) for one in (x_mm + 71.5 / 2, 146.7 / 2 - y_mm))
    reach = round(4.8 * scale)  # a fingertip's 6 mm times 0.75, and the rest of its ring
    beside = picture[row - 2 * reach : row - reach, column + reach : column + 2 * reach, :3]
    assert beside.min(axis=2).max() < 0.9  # nothing white
    assert beside.max(axis=2).min() > 0.1  # nor black


def test_a_name_cannot_get_out_of_the_data(
    open_page: OpenPage, ready: ReadyBoard, tmp_path: Path
) -> None:
    name = "</script><script>document.title='mine'</script>"
    first, *others = ready.board.actuators
    board = replace(ready.board, actuators=(replace(first, name=name), *others))
    evil = replace(ready, choice=replace(ready.choice, board=board))
    path = tmp_path / "index.html"
    path.write_text(one_file(evil), encoding="utf-8")
    page = open_page(path.as_uri())
    assert page.title() == "Chladni studio"
    press(page, board, (10.0, 25.0))
    assert page.locator('[data-part="coils"] tbody th').first.inner_text() == name


def test_modules_of_a_file_keep_scopes_of_their_own() -> None:
    """Every module is there once, after those that it imports, and nothing is left to load."""
    script = bundle("offline")
    files = [file.relative_to(PAGE).with_suffix("") for file in PAGE.rglob("*.js")]
    names = [str(file) for file in files if file.name not in ("app", "connection")]
    assert len(names) > 10
    for name in names:
        assert script.count(f'modules["{name}"] = ') == 1, name
    assert script.index('modules["picture/field"] = ') < script.index('modules["view"] = ')
    for word in ("import ", "export "):
        assert not any(line.startswith(word) for line in script.splitlines())


def test_an_export_that_cannot_be_written_says_so(chladni: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    for folder in (file, tmp_path / "no" / "where"):
        answer = chladni("studio", "--export", folder)
        assert (answer.code, "--export: expected a folder" in answer.err) == (2, True), answer.err
