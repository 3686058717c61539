"""What a board file may leave out, and what it is told of all that is wrong with it."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from chladni.design.spec import parse_spec
from chladni.sim.board.board import to_document
from chladni.sim.board.catalogue import SHEETS, SOLD_AS, metal_of, with_material
from chladni.sim.board.file import board_from_document, load_board
from chladni.sim.errors import MOST_FAULTS, FaultsError, InputError
from conftest import ROOT, CommandLine
from prototype_document import document, set_key

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
        ('material = "FR44"', "plate.material: expected one of: 'FR4', "),
        ("", "plate.material is required: 'FR4', 'aluminium', "),
    ],
)
def test_an_unknown_sheet_hides_nothing_else(
    tmp_path: Path, chladni: CommandLine, sheet: str, said: str
) -> None:
    path = tmp_path / "bad.toml"
    assert 'material = "FR4"' in SMALLEST
    text = SMALLEST.replace('material = "FR4"', f'{sheet}\nedges = "fre"\nloss_factor = -1')
    path.write_text(text.replace("size_mm = [", "size_mm = [-1, ", 1), encoding="utf-8")
    told = chladni("board", "show", path).err
    assert said in told
    for field in ("plate.edges", "plate.loss_factor", "plate.size_mm"):
        assert f"{path}, {field}" in told


def test_what_does_not_fit_is_named_at_once_too() -> None:
    wrong = set_key("actuators.1.at_mm", [99.0, 0.0])
    wrong["electronics"]["pwm_pins"] = [2, 4]
    wrong["regions"]["pitch_mm"] = 100.0
    with pytest.raises(FaultsError) as caught:
        board_from_document(wrong)
    assert [one.field for one in caught.value.errors] == [
        "electronics.pwm_pins",
        "actuators[1].at_mm",
        "regions.pitch_mm",
    ]
    assert caught.value.field == "electronics.pwm_pins"


def test_a_message_lists_so_many_faults_and_no_more() -> None:
    wrong = document() | {f"block-{k}": {} for k in range(100)}
    with pytest.raises(FaultsError) as caught:
        board_from_document(wrong)
    lines = str(caught.value.in_file("b.toml")).splitlines()
    assert len(lines) == MOST_FAULTS + 1
    assert lines[-1] == f"and {100 - MOST_FAULTS} more"


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("plate.size_mm", [0.0715, 0.1467]),
        ("plate.thickness_mm", 0.001),
        ("magnet.radius_mm", 0.004),
    ],
)
def test_lengths_in_metres_are_asked_about(path: str, value: Any) -> None:
    with pytest.raises(InputError, match=r"metres\? these are millimetres"):
        board_from_document(set_key(path, value))


def test_places_in_metres_are_asked_about() -> None:
    least = tomllib.loads(SMALLEST)
    for actuator, y in zip(least["actuators"], (-0.01, 0.01), strict=True):
        actuator["at_mm"] = [0.0, y]
    with pytest.raises(InputError, match=r"actuators: .* metres\? these are millimetres"):
        board_from_document(least)
    # One coil may be in the middle, and a length may be wrong without being in metres.
    one = least | {"actuators": [{"at_mm": [0.1, 0.0]}]}
    assert board_from_document(one).actuators[0].at[0] == pytest.approx(1e-4)
    with pytest.raises(InputError) as caught:
        board_from_document(set_key("plate.size_mm", [0.5, 146.7]))
    assert "metres" not in str(caught.value)


def test_coils_that_overlap_are_told_the_distance_they_need() -> None:
    near = set_key("actuators.1.at_mm", [6.0, 0.0])
    with pytest.raises(InputError, match=r"place 10.1 mm .* magnets of 10 mm overlap at 6"):
        board_from_document(near)
    holed = near | {"foundation": {"stiffness_n_per_mm3": 0.03, "coil_cut_out_mm": 7.0}}
    with pytest.raises(InputError, match=r"place 14 mm .* magnets of 10 mm overlap at 6"):
        board_from_document(holed)
    wound = {
        "turns": 100,
        "wire_mm": 0.1,
        "inner_mm": 3.0,
        "outer_mm": 12.0,
        "height_mm": 2.0,
        "gap_mm": 1.0,
    }
    least = tomllib.loads(SMALLEST) | {"winding": wound}
    assert board_from_document(least).winding is not None
    for distance, fits in ((11.9, False), (12.0, True)):
        least["actuators"] = [{"at_mm": [0.0, 0.0]}, {"at_mm": [0.0, distance]}]
        if fits:
            assert len(board_from_document(least).actuators) == 2
            continue
        wanted = "12 mm or more from 'coil-1', .* windings of 12 mm overlap at 11.9"
        with pytest.raises(InputError, match=wanted):
            board_from_document(least)


def test_a_board_is_found_without_its_ending(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text(SMALLEST, encoding="utf-8")
    (tmp_path / "paper.toml").write_text(SMALLEST, encoding="utf-8")
    assert load_board("own").name == "least"
    assert load_board(tmp_path / "own").name == "least"
    assert load_board("paper").name == "paper"
    assert load_board("paper.toml").name == "least"
    with pytest.raises(InputError, match="a board file that is there, or one of"):
        load_board("other")


def test_a_missing_value_whose_name_says_little_is_explained() -> None:
    panel = {"place": "beside", "controller": "gt911"}
    with pytest.raises(InputError, match=r"panel.pixels is required: how many places"):
        board_from_document(tomllib.loads(SMALLEST) | {"name": "own", "panel": panel})
    feet = [{"at_mm": [0.0, 0.0]}, {"at_mm": [1.0, 0.0]}]
    with pytest.raises(InputError, match=r"springs.1..stiffness_n_per_mm is required: .* `part`"):
        board_from_document(tomllib.loads(SMALLEST) | {"name": "own", "springs": feet})


def test_a_key_in_another_block_is_told_where_it_goes() -> None:
    with pytest.raises(InputError) as caught:
        board_from_document(set_key("drive.rms_voltage", 1.0))
    assert caught.value.field == "drive.rms_voltage"
    assert caught.value.expected == "a known key: this one goes into [coil]"
    with pytest.raises(InputError, match=r"supply_v: expected a known key: .* \[electronics\]"):
        board_from_document(tomllib.loads(SMALLEST) | {"supply_v": 5.0})
    with pytest.raises(InputError, match=r"image.thickness_mm.*\[plate\] or \[foundation\]"):
        board_from_document(set_key("image.thickness_mm", 0.2))
    with pytest.raises(InputError, match=r"plate.name: .*: this one goes above all blocks"):
        board_from_document(set_key("plate.name", "own"))
    with pytest.raises(InputError, match=r"loss_facto.*'loss_factor', perhaps"):
        board_from_document(set_key("plate.loss_facto", 0.1))


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("plexiglass", "acrylic"),
        ("PMMA", "acrylic"),
        ("fr4", "FR4"),
        ("Stainless-Steel", "stainless-steel"),
        ("aluminum", "aluminium"),
        ("acryl", "acrylic"),
    ],
)
def test_a_sheet_is_known_by_what_people_buy_it_as(given: str, meant: str) -> None:
    """Plexiglass was taken for glass, which is twenty times as stiff."""
    with pytest.raises(InputError) as refused:
        with_material({"material": given})
    assert str(refused.value).endswith(f"'{meant}', perhaps")


def test_every_trade_name_is_of_a_sheet_that_is_known() -> None:
    assert set(SOLD_AS.values()) <= set(SHEETS)
    assert not {own.casefold() for own in SHEETS} & SOLD_AS.keys()
    assert all(own == own.casefold().strip() for own in SOLD_AS)


@pytest.mark.parametrize(
    ("sheet", "said"),
    [
        ({"material": "brass"}, "brass"),
        ({"material": "glass"}, ""),
        ({"material": "Aluminium", **COPPER}, "aluminium"),
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
