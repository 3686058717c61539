"""What a board file may leave out, and what it is told of all that is wrong with it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from chladni.design.spec import parse_spec
from chladni.sim.board.board import to_document
from chladni.sim.board.catalogue import metal_of
from chladni.sim.board.file import board_from_document, load_board
from chladni.sim.errors import InputError
from conftest import ROOT, CommandLine

SMALLEST = """
name = "least"
[plate]
size_mm = [14.0, 60.0]
thickness_mm = 0.2
material = "FR4"
[[actuators]]
at_mm = [0.0, -10.0]
[[actuators]]
at_mm = [0.0, 10.0]
"""
COPPER = {"youngs_modulus_gpa": 110.0, "poissons_ratio": 0.34, "density_kg_m3": 8800.0}


def test_what_a_board_file_leaves_out_has_its_default() -> None:
    """As the template's comments have them; an image point every half a millimetre."""
    least = tomllib.loads(SMALLEST)
    given = least | {
        "drive": {"frequency_hz": 160.0, "max_gain": 10.0},
        "image": {"points": [29, 121]},
        "regions": {"pitch_mm": 3.0},
        "electronics": {"pwm_pins": [], "pwm_bits": 10, "ramp_ms": 4.0, "touch_timeout_ms": 100.0,
                        "max_on_s": 10.0},
    }  # fmt: skip
    for k, actuator in enumerate(given["actuators"], 1):
        given["actuators"][k - 1] = {"name": f"coil-{k}"} | actuator
    assert board_from_document(least) == board_from_document(given)
    magnet = board_from_document(least | {"magnet": {"radius_mm": 3.0, "height_mm": 4.0}}).magnet
    assert magnet is not None
    assert (magnet.density, magnet.stiffness_ratio) == (7500.0, 1000.0)
    panel = board_from_document(least | {"panel": {"pixels": [160, 40], "rotation_deg": 90}}).panel
    assert panel is not None
    assert panel.area == ((-7e-3, 7e-3), (-30e-3, 30e-3))


def test_a_large_image_left_out_has_no_more_points_than_a_phone_s_twice() -> None:
    large = tomllib.loads(SMALLEST.replace("[14.0, 60.0]", "[1000.0, 2000.0]"))
    assert board_from_document(large).image.points == (201, 401)


def test_a_written_file_has_what_a_file_may_leave_out() -> None:
    """So that it says all that its tables depend on, whatever defaults come to be."""
    written = to_document(board_from_document(tomllib.loads(SMALLEST)))
    assert written["drive"] == {"frequency_hz": 160.0, "max_gain": 10.0}
    assert written["regions"] == {"pitch_mm": 3.0}
    assert written["electronics"]["ramp_ms"] == 4.0


def test_all_that_is_wrong_is_named_at_once_each_on_its_line(
    tmp_path: Path, chladni: CommandLine
) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(
        SMALLEST.replace("thickness_mm = 0.2", "thicknes_mm = 0.2\npoissons_ratio = 7.0")
        .replace('name = "least"', "name = 3")
        .replace("at_mm = [0.0, 10.0]", "at_mm = 3")
        + "[drive]\nfrequency_hz = 0.0\n[magnet]\nradius_mm = 3.0\n[motor]\n",
        encoding="utf-8",
    )
    told = chladni("board", "show", path)
    assert told.code == 2
    start = f"chladni: {path}, "
    lines = told.err.splitlines()
    assert all(line.startswith(start) for line in lines)
    fields = {line.removeprefix(start).split(" ")[0].rstrip(":") for line in lines}
    assert fields == {
        "motor",
        "plate.thicknes_mm",
        "plate.thickness_mm",
        "plate.poissons_ratio",
        "drive.frequency_hz",
        "magnet.height_mm",
        "actuators[1].at_mm",
    }
    assert len(lines) == len(fields)


def test_a_board_without_a_name_is_called_like_its_file(tmp_path: Path) -> None:
    """Where that can be a name: letters, digits, - and _, fifteen at most."""
    text = SMALLEST.replace('name = "least"', "")
    (tmp_path / "own-pad_2.toml").write_text(text, encoding="utf-8")
    assert load_board(tmp_path / "own-pad_2.toml").name == "own-pad_2"
    assert load_board(tmp_path / "own-pad_2").name == "own-pad_2"
    (tmp_path / "own pad.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="name is required"):
        load_board(tmp_path / "own pad.toml")
    spec = (ROOT / "docs" / "design.md").read_text("utf-8").split("```toml\n")[1].split("```")[0]
    assert (
        parse_spec(spec.replace('name = "my-strip"', ""), file="a/b.toml").document["name"] == "b"
    )


@pytest.mark.parametrize(
    ("sheet", "said"),
    [
        ({"material": "brass"}, "brass"),
        ({"material": "glass"}, ""),
        # A copper alloy of no name here, numbers alone, and a laminate of carbon fibre.
        ({"material": "bronze", **COPPER}, "bronze, if it is a metal,"),
        (COPPER, "this sheet, if it is a metal,"),
        ({"material": "CFRP", **COPPER, "density_kg_m3": 1550.0}, ""),
    ],
)
def test_a_sheet_that_may_conduct_is_told(sheet: dict[str, Any], said: str) -> None:
    least = tomllib.loads(SMALLEST)
    plate = {key: least["plate"][key] for key in ("size_mm", "thickness_mm")}
    assert metal_of(board_from_document(least | {"plate": plate | sheet}).plate) == said
