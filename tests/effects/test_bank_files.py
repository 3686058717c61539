"""A bank's own file, the drawings that it may name, and the commands that build and show it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chladni.effects import Circle, Polygon, read_bank, shipped_effects
from chladni.effects.bank.bank_file import bank_bytes, shipped_banks
from chladni.effects.bank.drawing import shapes_of_drawing
from chladni.effects.bank.unpack import unpack_bank
from chladni.host.emulation._emulator import bank_status
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError
from conftest import CommandLine

SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="160mm" viewBox="0 0 800 1600">
<rect id="key" x="100" y="200" width="200" height="100"/>
<g transform="translate(100,0) scale(2)"><circle id="knob" cx="150" cy="400" r="40"/></g>
<path id="wedge" d="M 400 1200 l 100 0 l 0 200 z"/>
<path id="bow" d="M 100 1300 C 100 1400 300 1400 300 1300 Z"/>
<ellipse id="egg" cx="600" cy="1400" rx="80" ry="40"/>
<text id="label" x="3" y="3">7</text>
</svg>"""
FILE = """
name = "panel"
hysteresis_mm = 0.5
effects = ["pulse"]
svg = "panel.svg"

[[area]]
name = "key"
svg = "key"
press = "click"
release = "own.toml"

[[area]]
name = "strip"
rectangle_mm = [-20, -60, 20, -40]
hold = "tick"
every_mm = 3
along = "x"
level_db = -6
level_um = 8
"""
BANKS_OF = {"fader": ("strip5", "quiet5"), "four-keys": ("pad16", "quiet16")}
"""The others are for phones."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "panel.svg").write_text(SVG, encoding="utf-8")
    (tmp_path / "panel.toml").write_text(FILE, encoding="utf-8")
    (tmp_path / "own.toml").write_text("[[click]]\nfrequency_hz = 90\n", encoding="utf-8")
    return tmp_path


def test_a_file_with_a_drawing_and_an_effect_beside_it(folder: Path) -> None:
    bank = read_bank(folder / "panel.toml").bank
    assert (bank.name, bank.hysteresis_mm) == ("panel", 0.5)
    assert list(bank.effects) == ["pulse", "click", "own", "tick"]
    key, strip = bank.areas
    assert key.effects == {"press": "click", "release": "own"}
    # 80 by 160 mm about the middle, y upwards.
    assert isinstance(key.shape, Polygon)
    assert set(key.shape.corners_mm) == {(-30, 60), (-10, 60), (-10, 50), (-30, 50)}
    assert (strip.every_mm, strip.along, strip.level_db) == (3.0, "x", -6.0)
    assert strip.level_um == 8.0


def test_shapes_of_a_drawing_lie_where_they_are_drawn(folder: Path) -> None:
    shapes = shapes_of_drawing(folder / "panel.svg", "svg")
    assert set(shapes) == {"key", "knob", "wedge", "bow", "egg"}
    assert shapes["knob"] == Circle((0.0, 0.0), 8.0)
    wedge = shapes["wedge"]
    assert isinstance(wedge, Polygon)
    assert wedge.corners_mm == ((0.0, -40.0), (10.0, -40.0), (10.0, -60.0))
    egg = shapes["egg"]
    assert isinstance(egg, Polygon)
    x, y = np.array(egg.corners_mm).T
    np.testing.assert_allclose(((x - 20.0) / 8.0) ** 2 + ((y + 60.0) / 4.0) ** 2, 1.0, atol=1e-3)


def test_a_drawing_without_millimetres_has_them_for_units(tmp_path: Path) -> None:
    path = tmp_path / "plain.svg"
    text = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 40 60"><rect id="a" x="0" y="0" '
    path.write_text(text + 'width="10" height="20"/></svg>', encoding="utf-8")
    shape = shapes_of_drawing(path, "svg")["a"]
    assert isinstance(shape, Polygon)
    assert set(shape.corners_mm) == {(-20, 30), (-10, 30), (-10, 10), (-20, 10)}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<svg", "svg: expected an SVG drawing"),
        ("<svg xmlns='http://www.w3.org/2000/svg'/>", 'svg: expected width="80mm"'),
        ("<g id='a'/>", "svg: expected width="),
        ("<g width='9mm' height='9mm'/>", "svg: expected an SVG drawing, got 'no svg element'"),
    ],
)
def test_a_drawing_that_has_no_areas_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "bad.svg"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        shapes_of_drawing(path, "svg")
    assert said in str(raised.value)
    assert "bad.svg" in str(raised.value)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (
            "<path id='key' d='M0 0 L1 0 L1 1 Z M3 3 L4 3 L4 4 Z'/>",
            "panel.svg, #key: expected one outline, got 'several outlines'",
        ),
        (
            "<polygon id='key' points='0,0 9,9 9,0 0,9'/>",
            "panel.svg, #key: expected sides that do not cross",
        ),
        ("<line id='key' x1='0' y1='0' x2='9' y2='0'/>", "#key: expected 3 to 32 corners"),
    ],
)
def test_a_shape_that_can_be_no_area_is_refused_where_an_area_asks_for_it(
    folder: Path, shape: str, said: str
) -> None:
    text = SVG.replace('<rect id="key" x="100" y="200" width="200" height="100"/>', shape)
    (folder / "panel.svg").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read_bank(folder / "panel.toml")
    assert said in str(raised.value)
    other = FILE.replace('svg = "key"', 'svg = "knob"')
    (folder / "panel.toml").write_text(other, encoding="utf-8")
    assert len(read_bank(folder / "panel.toml").bank.areas) == 2


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("hysteresis_mm = 0.5", "hysteresis_mm = 99"), "hysteresis_mm: expected a number from 0"),
        (('name = "panel"', "colour = 3"), "colour: expected one of name, hysteresis_mm, effects"),
        (('press = "click"', 'press = "clack"'), "area[0].press: expected click, double-click"),
        (('hold = "tick"', 'hold = "tik"'), "got 'tik'; tick, perhaps"),
        (('"own.toml"', '"none.wav"'), "none.wav"),
        (('svg = "key"', 'svg = "lock"'), "area[0].svg: expected an id of the drawing: bow, egg"),
        (('svg = "key"', "circle_mm = [1, 2]"), "area[0].circle_mm: expected [x, y, radius]"),
        (('svg = "key"', 'svg = "key"\ncircle_mm = [1, 2, 3]'), "expected nothing beside"),
        (("every_mm = 3", "every_mm = 0.01"), "area[1].every_mm: expected 0, or 0.2 to 500"),
        (('along = "x"', 'along = "w"'), "area[1].along: expected one of path, x, y"),
        (('name = "strip"', 'name = "key"'), "area: expected names that differ, got 'key'"),
        (("level_db = -6", "level_db = 6"), "area[1].level_db: expected a number from -60 to 0"),
        (("level_um = 8", "level_um = 0"), "area[1].level_um: expected a number from 0.01 to 655"),
        (('name = "strip"', "swipe = 1"), "area[1].swipe: expected one of name, rectangle_mm"),
        (('effects = ["pulse"]', "effects = 3"), "effects: expected a list"),
    ],
)  # fmt: skip
def test_a_file_that_breaks_a_rule_is_refused_by_place(
    folder: Path, change: tuple[str, str], said: str
) -> None:
    path = folder / "panel.toml"
    path.write_text(FILE.replace(*change), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read_bank(path)
    assert said in str(raised.value)


def test_all_that_is_wrong_with_a_file_is_told_at_once(
    tmp_path: Path, chladni: CommandLine
) -> None:
    file, output = tmp_path / "wrong.toml", tmp_path / "wrong.che"
    file.write_text(
        'hysteresis = 2\n[[area]]\npress = "clack"\nlevel_db = 3\ncircle_mm = [0, 0]\n'
        '[[area]]\nname = "b"\nhold = "tick"\nevery = 4\n'
    )
    done = chladni("effects", "build", file, "-o", output, "--board", "phone5")
    assert (done.code, output.exists()) == (2, False)
    told = [line.split("wrong.toml, ")[1] for line in done.err.splitlines() if "toml, " in line]
    assert [line.split(":")[0].split(" is ")[0] for line in told] == [
        *("hysteresis", "area[0].name", "area[0].press", "area[0].level_db"),
        *("area[0].circle_mm", "area[1].every"),
    ]
    file.write_text('[[area]]\nname = "a"\npress = "lost.toml"\n')
    lost = chladni("effects", "build", file, "-o", output)
    assert lost.code == 2
    said = " ".join(lost.err.split())
    assert f"wrong.toml, area[0].press: expected a file that is there, in {tmp_path}" in said


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_mangled_drawings_and_files_are_banks_or_are_refused(
    folder: Path, data: st.DataObject
) -> None:
    name = data.draw(st.sampled_from(["panel.toml", "panel.svg"]))
    mangled = bytearray({"panel.toml": FILE, "panel.svg": SVG}[name].encode())
    for _ in range(data.draw(st.integers(0, 3))):
        mangled[data.draw(st.integers(0, len(mangled) - 1))] = data.draw(st.integers(0, 255))
    (folder / name).write_bytes(bytes(mangled[: data.draw(st.integers(0, len(mangled)))]))
    try:
        found = bank_bytes(folder / "panel.toml")
    except InputError:
        return
    assert bank_status(found) == "ok"


@pytest.mark.parametrize("name", list(shipped_banks()))
def test_a_shipped_bank_lies_on_the_boards_that_it_is_for(name: str) -> None:
    bank = read_bank(name).bank
    for board in BANKS_OF.get(name, ("phone5", "phone8", "phone15", "prototype")):
        bank.check_on(*(1e3 * size for size in load_board(board).plate.size))
    assert bank_status(bank_bytes(name)) == "ok"
    assert set(bank.effects) <= set(shipped_effects())


def test_commands_build_and_show_a_bank(folder: Path, chladni: CommandLine) -> None:
    built, output = folder / "panel.toml", folder / "panel.che"
    said = json.loads(chladni("effects", "build", str(built), "-o", str(output), "--json").out)
    assert said["bytes"] == output.stat().st_size == len(bank_bytes(built))
    assert said["areas"] == ["key", "strip"]
    figure = folder / "areas.png"
    shown = json.loads(
        chladni("effects", "show", str(output), "--json", "--figure", str(figure)).out
    )
    assert figure.stat().st_size > 5000
    assert [one["name"] for one in shown["effects"]] == said["effects"]
    assert shown["areas"][1] == {
        "name": "strip",
        "shape": "polygon",
        "level_db": -6.0,
        "level_um": 8.0,
        "every_mm": 3.0,
        "along": "x",
        "hold": "tick",
    }
    assert "every 3 mm along x" in chladni("effects", "show", str(output)).out
    output.write_bytes(output.read_bytes()[:-1])
    refused = chladni("effects", "show", str(output))
    assert refused.code == 2
    assert "panel.che, total_bytes: expected" in refused.err
    off = chladni("effects", "build", str(built), "-o", str(output), "--board", "strip5")
    assert off.code == 2
    assert "area key: expected within the board, 14 × 60 mm" in off.err
    assert unpack_bank(bank_bytes(built)).name == "panel"
