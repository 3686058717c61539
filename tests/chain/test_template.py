"""The template as a new user takes it: copied, built, scored; and what is left from elsewhere."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import tomlkit

from chladni.sim.board.board import to_document
from chladni.sim.board.file import load_board
from chladni.sim.errors import MissingError
from conftest import ROOT, CommandLine

TEMPLATE = ROOT / "boards" / "template.toml"
PANEL = "size_mm = [80.0, 160.0]         # its"


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("template") / "my.chl"


def changed(folder: Path, *edits: tuple[str, str]) -> Path:
    text = TEMPLATE.read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "my.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("panel", ["as it is", "small", "turned and off the middle"])
def test_the_template_can_be_built_and_scored(
    chladni: CommandLine, table: Path, tmp_path: Path, panel: str
) -> None:
    edits = {
        "as it is": [],
        "small": [(PANEL, "size_mm = [54.0, 94.0]  # its")],
        "turned and off the middle": [
            (PANEL, "size_mm = [94.0, 54.0]  # its"),
            ("rotation_deg = 0", "rotation_deg = 90"),
            ("offset_mm = [0.0, 0.0]", "offset_mm = [5.0, -30.0]"),
        ],
    }[panel]
    board = changed(tmp_path, *edits)
    if not table.exists():
        built = chladni("table", "build", board, "-o", table, "--json")
        assert built.code == 0, built.err
    scored = chladni(
        "table", "score", table, "--board", board, "--pitch", "40", "--no-perturbed", "--json"
    )
    assert scored.code == 0, scored.err
    # 80 x 160 mm less 3 mm all round: 2 x 4 cells and those half-way; of a small panel 1 x 2.
    assert scored.json["places"] == (21 if panel == "as it is" else 3)


def test_what_is_left_out_has_the_templates_value(tmp_path: Path) -> None:
    """Or its line says what it has."""
    whole, path = tomllib.loads(TEMPLATE.read_text(encoding="utf-8")), tmp_path / "template.toml"
    as_it_is = to_document(load_board(TEMPLATE))
    lines, block = {}, ""
    for line in TEMPLATE.read_text(encoding="utf-8").splitlines():
        block = line[1:].split("]")[0] if line.startswith("[") else block
        lines[block, line.split(" = ")[0]] = line
    seen = 0
    for block, key in [(b, k) for b, own in whole.items() if isinstance(own, dict) for k in own]:
        without = whole | {block: {k: own for k, own in whole[block].items() if k != key}}
        path.write_text(tomlkit.dumps(without), encoding="utf-8")
        try:
            found = to_document(load_board(path))
        except MissingError:
            continue
        seen += 1
        is_alike = as_it_is[block].get(key) == (found.get(block) or {}).get(key)
        assert is_alike or "left out" in lines[block, key], (block, key)
    assert seen > 20


def test_fingers_are_expected_where_a_panel_senses_them(tmp_path: Path) -> None:
    board = load_board(
        changed(
            tmp_path,
            (PANEL, "size_mm = [94.0, 54.0]  # its"),
            ("rotation_deg = 0", "rotation_deg = 90"),
            ("offset_mm = [0.0, 0.0]", "offset_mm = [20.0, -40.0]"),
        )
    )
    x, y = board.active_area
    assert x == pytest.approx((-7e-3, 37e-3))
    assert y == pytest.approx((-77e-3, 7e-3))


def test_what_is_left_from_another_board_is_remarked_on(
    chladni: CommandLine, tmp_path: Path
) -> None:
    assert "panel.size_mm" not in chladni("board", "show", TEMPLATE).err
    latch = (
        "rms_voltage = 1.8 ",
        "moving_mass_g = 12.0\nresonance_hz = 160.0\nmechanical_q = 12.0\nrms_voltage = 1.8 ",
    )
    small = (PANEL, "size_mm = [54.0, 94.0]  # its")
    told = chladni("board", "show", changed(tmp_path, small, latch))
    assert told.code == 0
    assert "senses x from -27 to 27 and y from -47 to 47 mm of a plate of 80 x 160 mm" in told.err
    assert "coil.resonance_hz, 160 Hz, is a latch's" in told.err
    own = chladni("board", "show", changed(tmp_path, (latch[0], latch[1].replace("160", "212"))))
    assert "latch" not in own.err
    assert "image.points" not in own.err
    turned = chladni("board", "show", changed(tmp_path, ("[201, 401] ", "[401, 201] ")))
    assert "are 0.2 × 0.8 mm apart: is image.points of another board?" in turned.err


def test_a_metal_under_a_panel_is_remarked_on(chladni: CommandLine, tmp_path: Path) -> None:
    edits = (
        ('# material = "FR4"', 'material = "aluminium"'),
        ("youngs_modulus_gpa = 22.0", ""),
        ('place = "beside"', 'place = "in"'),
    )
    told = chladni("board", "show", changed(tmp_path, *edits))
    assert told.code == 0, told.err
    assert "aluminium shields electrodes in or under it: take panel.place 'on'" in told.err
    on = (*edits[:2], ('place = "beside"', 'place = "on"\nfilm_mm = 0.125'))
    told = chladni("board", "show", changed(tmp_path, *on))
    assert "so near aluminium a capacitive panel senses fingers less well" in told.err
    told = chladni("board", "show", changed(tmp_path, *edits[:2]))
    assert "aluminium near a capacitive panel makes it sense fingers less well" in told.err
    assert "earth the sheet" in told.err
    assert "eddy" not in chladni("board", "show", TEMPLATE).err


def test_an_option_for_a_command_is_not_dropped_before_it(chladni: CommandLine) -> None:
    refused = chladni("--json", "board", "show", "strip5")
    assert (refused.code, refused.out) == (2, "")
    assert "--json before a command does not go with board; it goes after the" in refused.err


def test_a_sweep_tells_the_plate_from_the_latch(chladni: CommandLine) -> None:
    """`prototype` has a latch at 160 Hz and its first natural frequency at 563 Hz."""
    swept = chladni("sweep", "prototype", "--from", "400", "--to", "700", "--json").json
    first, second = chladni("board", "show", "prototype", "--json").json["modes_hz"][:2]
    assert swept["plate"]["modes_hz"] == pytest.approx([first, second], rel=1e-3)
    # A step of the sweep is 2.5 Hz; the first mode is even, so the coil in the middle moves it.
    assert swept["plate"]["actuator"] == "centre"
    assert min(abs(swept["plate"]["loudest_hz"] - own) for own in (first, second)) < 10.0
    assert all(wave["peak_hz"] == 400.0 for wave in swept["waves"])
    assert chladni("sweep", TEMPLATE, "--json").json["waves"] == []


def test_a_sweep_begins_below_the_plates_first_mode(chladni: CommandLine, tmp_path: Path) -> None:
    soft = tmp_path / "soft.toml"
    text = TEMPLATE.read_text(encoding="utf-8")
    soft.write_text(text.replace("thickness_mm = 1.6", "thickness_mm = 0.8"), encoding="utf-8")
    first = chladni("modes", soft, "--json").json["modes_hz"][0]
    assert first < 100.0
    swept = chladni("sweep", soft, "--json").json["plate"]
    assert swept["modes_hz"][0] == pytest.approx(first)
    assert swept["loudest_hz"] == pytest.approx(first, rel=0.1)


def test_a_latch_takes_all_its_values(chladni: CommandLine, tmp_path: Path) -> None:
    lacking = ("rms_voltage = 1.8 ", "resonance_hz = 160.0\nrms_voltage = 1.8 ")
    refused = chladni("board", "show", changed(tmp_path, lacking))
    assert refused.code == 2
    assert "coil.moving_mass_g is required: a latch takes all of moving_mass_g" in refused.err


def test_the_template_stands_on_rubber_feet(chladni: CommandLine, tmp_path: Path) -> None:
    """As docs/own-board.md shows."""
    text = TEMPLATE.read_text(encoding="utf-8")
    text = re.sub(r"(?m)^\[\[screws\]\]", "[[springs]]", text)
    text = re.sub(r"(?m)^radius_mm = 1.5$", 'part = "rubber-foot-10x5"', text)
    text = text.replace("points = [201, 401]", "points = [51, 101]")  # enough for one place
    feet = tmp_path / "feet.toml"
    feet.write_text(text, encoding="utf-8")
    assert chladni("modes", feet, "--json").json["modes_hz"][0] == pytest.approx(107.1, abs=0.1)
    solved = chladni("solve", feet, "--target", "5,20", "--json").json
    assert solved["finger_um"] == pytest.approx(17.0, abs=0.5)
