"""The wiring drawing: what it says, that it can be read, and the command that draws it."""

from __future__ import annotations

import itertools
import shutil
from dataclasses import replace
from pathlib import Path

import draw_wiring
import numpy as np
import pytest
from draw_wiring import texts_of
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.transforms import Bbox

from chladni.host.figures.fields import save
from chladni.host.manufacture.wiring.channels import channels
from chladni.host.manufacture.wiring.figure import wiring_figure
from chladni.host.manufacture.wiring.parts import parts_list
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.gpio import CHIPS
from conftest import ROOT, CommandLine
from wired_boards import board_with, with_bridges


def drawn_texts(board: Board, folder: Path) -> list[str]:
    save(wiring_figure(board), folder / "wiring.svg")
    return texts_of(folder / "wiring.svg")


@pytest.mark.parametrize("count", [1, 2, 5, 16])
def test_every_gpio_and_actuator_stands_on_the_drawing_once(
    prototype: Board, tmp_path: Path, count: int
) -> None:
    board = board_with(prototype, count)
    texts = drawn_texts(board, tmp_path)
    for own in channels(board):
        assert texts.count(f"GPIO {own.gpio}") == 1
        assert texts.count(own.actuator) == 1
        assert texts.count(str(own.channel)) == 1
    gpios = {text for text in texts if text.startswith("GPIO")}
    others = {"GPIO 1 (TXD0)", "GPIO 3 (RXD0)", "GPIO 21", "GPIO 22", "GPIO 34"}
    assert gpios == {f"GPIO {pin}" for pin in CHIPS["esp32"].gates[:count]} | others


def test_a_row_joins_the_gpio_of_a_channel_to_its_actuator(prototype: Board) -> None:
    figure = wiring_figure(prototype)
    rows: dict[float, set[str]] = {}
    for text in figure.axes[0].texts:
        rows.setdefault(text.get_position()[1], set()).add(text.get_text())
    for own in channels(prototype)[1:]:
        (row,) = (texts for texts in rows.values() if f"GPIO {own.gpio}" in texts)
        assert {own.actuator, str(own.channel), "as channel 0"} <= row


def test_channels_are_those_of_the_board_file(prototype: Board) -> None:
    found = [(own.channel, own.gpio, own.actuator, own.at_mm) for own in channels(prototype)]
    assert found == [
        (0, 2, "centre", (0.0, 0.0)),
        (1, 4, "top-right", (24.25, 43.35)),
        (2, 15, "top-left", (-24.25, 43.35)),
        (3, 16, "bottom-right", (24.25, -43.35)),
        (4, 17, "bottom-left", (-24.25, -43.35)),
    ]


@pytest.mark.parametrize("material", ["stainless-steel", "FR4"])
def test_a_sheet_of_metal_has_its_earth_wire_on_the_drawing(
    prototype: Board, tmp_path: Path, material: str
) -> None:
    board = replace(prototype, plate=replace(prototype.plate, material=material))
    texts = drawn_texts(board, tmp_path)
    metal = material != "FR4"
    assert texts.count("earth wire") == texts.count("sheet of stainless steel") == metal


def test_a_line_of_the_panel_that_is_not_wired_is_left_out(
    prototype: Board, tmp_path: Path
) -> None:
    assert prototype.panel is not None
    reset_only = replace(prototype.panel, interrupt_pin=255, reset_pin=23)
    texts = drawn_texts(replace(prototype, panel=reset_only), tmp_path)
    assert {"SDA", "SCL", "RST", "GPIO 23"} <= set(texts)
    assert "INT" not in texts
    assert not any("255" in text for text in texts)
    assert any("polled" in text for text in texts)
    open_texts = drawn_texts(replace(prototype, panel=replace(reset_only, reset_pin=255)), tmp_path)
    assert [any("RST up to 3.3 V" in one for one in own) for own in (texts, open_texts)] == [
        False,
        True,
    ]


def test_without_a_panel_there_is_no_bus(prototype: Board, tmp_path: Path) -> None:
    board = replace(prototype, panel=None)
    texts = drawn_texts(board, tmp_path)
    assert not {"SDA", "SCL", "INT", "GPIO 21", "touch panel"} & set(texts)
    assert any("no [panel]" in text for text in texts)
    assert not any(part.part in ("touch panel", "bus pull-up") for part in parts_list(board))


def test_without_pins_the_drawing_says_so_and_invents_none(
    prototype: Board, tmp_path: Path
) -> None:
    board = replace(board_with(prototype, 3, pins=False), panel=None)
    texts = drawn_texts(board, tmp_path)
    assert [text for text in texts if text.startswith("GPIO")] == ["GPIO 1 (TXD0)", "GPIO 3 (RXD0)"]
    assert any("no GPIO" in text for text in texts)
    assert [own.gpio for own in channels(board)] == [None] * 3


def extents(figure: Figure) -> tuple[list[tuple[str, Bbox]], list[Bbox], list[Bbox]]:
    """Pixels of a figure's texts, wires (a segment each) and blocks."""
    figure.canvas.draw()
    (axes,) = figure.axes
    texts = [(text.get_text(), text.get_window_extent()) for text in axes.texts]
    wires = [
        Bbox.from_extents(*np.minimum(a, b), *np.maximum(a, b))
        for line in axes.lines
        for a, b in itertools.pairwise(line.get_transform().transform(line.get_xydata()))
    ]
    blocks = [patch.get_window_extent() for patch in axes.patches if isinstance(patch, Rectangle)]
    return texts, wires, blocks


# A supply changes the rows above the channels alone, so not every one goes with every number.
@pytest.mark.parametrize(("count", "supply_v"), [(1, 48.0), (2, 3.0), (5, 5.0), (16, 48.0)])
@pytest.mark.parametrize("pins", [True, False])
def test_texts_lie_on_nothing_and_wires_are_straight(
    prototype: Board, count: int, supply_v: float, pins: bool
) -> None:
    board = board_with(prototype, count, supply_v=supply_v, pins=pins, name="{} $long_name$ <&>")
    check_readable(wiring_figure(board))


def check_readable(figure: Figure) -> None:
    texts, wires, blocks = extents(figure)
    for (one, here), (other, there) in itertools.combinations(texts, 2):
        assert not here.overlaps(there), f"{one!r} lies on {other!r}"
    for one, here in texts:
        assert not any(here.overlaps(wire) for wire in wires), f"{one!r} lies on a wire"
        for block in blocks:
            inside = block.x0 <= here.x0 <= here.x1 <= block.x1
            inside = inside and block.y0 <= here.y0 <= here.y1 <= block.y1
            assert inside or not here.overlaps(block), f"{one!r} leaves its block"
    for wire in wires:
        assert min(wire.width, wire.height) == pytest.approx(0.0, abs=1e-6)


def test_names_are_drawn_as_they_stand(prototype: Board, tmp_path: Path) -> None:
    names = ["$\\frac{1}$", "<b>&amp;", "a\nb", "größer"]
    actuators = tuple(
        replace(own, name=name) for own, name in zip(prototype.actuators, names, strict=False)
    )
    board = replace(prototype, actuators=(*actuators, prototype.actuators[-1]))
    assert {"$\\frac{1}$", "<b>&amp;", "a·b", "größer"} <= set(drawn_texts(board, tmp_path))


@pytest.mark.parametrize("kind", ["svg", "pdf", "png"])
def test_a_board_is_drawn_to_the_same_bytes_twice(
    prototype: Board, tmp_path: Path, kind: str
) -> None:
    one, other = tmp_path / f"a.{kind}", tmp_path / f"b.{kind}"
    for path in (one, other):
        save(wiring_figure(prototype), path)
    assert one.read_bytes() == other.read_bytes()


def test_the_command_draws_and_lists(chladni: CommandLine, tmp_path: Path) -> None:
    drawing = tmp_path / "wiring.svg"
    answer = chladni("board", "wiring", "prototype", "-o", drawing, "--json").json
    assert list(answer) == ["path", "channels", "parts"]
    assert answer["path"] == str(drawing)
    assert answer["channels"][2] == {
        "channel": 2,
        "actuator": "top-left",
        "gpio": 15,
        "at_mm": [-24.25, 43.35],
    }
    assert {"part": "gate resistor", "count": 5, "value": "100 Ω"}.items() <= (
        answer["parts"][9].items()
    )
    assert "GPIO 15" in texts_of(drawing)
    assert "top-left" in chladni("board", "wiring", "prototype", "-o", drawing).out


def test_a_supply_and_its_fuse_say_what_they_are_for() -> None:
    """On phone5 five coils at full duty stay below the limit, and 4 A of fuse protect no 2.5 A."""
    phone, own = (
        {part.part: part.why for part in parts_list(load_board(name))}
        for name in ("phone5", "prototype")
    )
    assert phone["supply"].startswith("1.87 A with all coils at full duty, and 500 mA")
    assert own["supply"].startswith("1.67 A in the crest of a wave, 1 A mean, and 500 mA")
    assert "this one limits itself before" in phone["fuse, slow"]
    assert "limits" not in own["fuse, slow"]


@pytest.mark.parametrize(
    ("board", "name", "said"),
    [
        ("nope", "w.svg", "BOARD"),
        ("prototype", "w.txt", "-o"),
        ("prototype", "no/w.svg", "-o"),
        ("prototype", "", "-o"),
    ],
)
def test_bad_input_leaves_nothing_behind(
    chladni: CommandLine, tmp_path: Path, board: str, name: str, said: str
) -> None:
    answer = chladni("board", "wiring", board, "-o", tmp_path / name)
    assert answer.code == 2
    assert f"{said}: expected" in answer.err
    assert list(tmp_path.iterdir()) == []


def test_a_drawing_that_fails_leaves_the_last_one(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawing = tmp_path / "wiring.svg"
    drawing.write_text("the last one", encoding="utf-8")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    assert chladni("board", "wiring", "prototype", "-o", drawing).code == 1
    assert drawing.read_text(encoding="utf-8") == "the last one"
    assert list(tmp_path.iterdir()) == [drawing]


def test_page_and_drawing_say_what_the_board_file_says() -> None:
    assert draw_wiring.faults(ROOT / "docs") == [], "run tools/draw_wiring.py"


def test_the_check_of_the_page_sees_another_value_and_another_pin(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "docs", tmp_path / "docs")
    page = tmp_path / "docs" / "hardware.md"
    picture = tmp_path / "docs" / "images" / "wiring.svg"
    page.write_text(page.read_text(encoding="utf-8").replace("| 3.3 kΩ |", "| 10 kΩ |"), "utf-8")
    picture.write_text(picture.read_text(encoding="utf-8").replace("GPIO 15", "GPIO 18"), "utf-8")
    assert draw_wiring.faults(tmp_path / "docs") == ["docs/images/wiring.svg", "docs/hardware.md"]


def bridge_board(board: Board, count: int, *, pins: bool = True, **electronics: object) -> Board:
    """`board_with`, each coil in a bridge."""
    chip, plain = CHIPS["esp32"], board_with(board, count)
    gates = (32, 33, *chip.gates)[:count]
    signs = tuple(pin for pin in chip.signs if pin not in gates)[:count]
    return with_bridges(
        plain,
        **({"pwm_pins": gates, "sign_pins": signs} if pins else {}),
        **electronics,
    )


@pytest.mark.parametrize("count", [1, 2, 8])
def test_both_pins_of_a_bridge_stand_beside_their_ends(prototype: Board, count: int) -> None:
    """PWM where EN is, sign where PH is, by the height of each text."""
    board = bridge_board(prototype, count)
    heights: dict[str, list[float]] = {}
    for text in wiring_figure(board).axes[0].texts:
        heights.setdefault(text.get_text(), []).append(text.get_position()[1])
    for own in channels(board):
        (gate,), (sign,) = heights[f"GPIO {own.gpio}"], heights[f"GPIO {own.sign_gpio}"]
        assert gate in heights["EN"]
        assert sign in heights["PH"]
    assert len(heights["EN"]) == len(heights["PH"]) == count
    assert {"OUT1", "OUT2", "VCC, nSLEEP", "VM", "100 nF", "3.3 kΩ"} <= heights.keys()
    assert not any("Schottky" in text or "MOSFET" in text for text in heights)
    assert any("nSLEEP" in text and "pull it low" in text for text in heights)


@pytest.mark.parametrize(("count", "supply_v"), [(1, 11.0), (2, 3.0), (8, 48.0)])
@pytest.mark.parametrize("pins", [True, False])
def test_a_drawing_of_bridges_can_be_read(
    prototype: Board, count: int, supply_v: float, pins: bool
) -> None:
    board = bridge_board(prototype, count, pins=pins, supply_v=supply_v)
    check_readable(wiring_figure(board))


def test_a_coil_hangs_between_the_outputs_of_its_bridge(prototype: Board) -> None:
    """No coil of a bridge touches the supply's rail: all wires to it come from above or VM."""
    axes = wiring_figure(bridge_board(prototype, 5)).axes[0]
    red = [line for line in axes.lines if line.get_color() == "#b03a00"]
    assert min(float(np.min(line.get_ydata())) for line in red) == 0.0


def test_the_command_lists_the_pins_of_signs(chladni: CommandLine, tmp_path: Path) -> None:
    answer = chladni("board", "wiring", "strip5", "-o", tmp_path / "w.svg", "--json").json
    assert [own["sign_gpio"] for own in answer["channels"]] == [18, 19, 23, 25, 26]
