"""What a SPEC may say, and what each wrong one is told."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomlkit

from chladni.design.evaluate import completed_board, document_of, evaluate
from chladni.design.spec import parse_spec, spec_of
from chladni.design.variables import Choice, Range
from chladni.drives.objectives import default_objective
from chladni.sim.board.catalogue import SHEETS
from chladni.sim.board.file import board_from_document
from chladni.sim.board.writing import board_file
from chladni.sim.errors import FaultsError, InputError
from conftest import ROOT, CommandLine
from made_specs import small


def test_ranges_lists_and_free_are_found_where_they_stand() -> None:
    spec = spec_of(
        small(
            plate={"thickness_mm": "free", "size_mm": [12.0, {"from": 30.0, "to": 60.0}]},
            foundation={"stiffness_n_per_mm3": {"from": 0.01, "to": 0.09}},
            drive={"frequency_hz": {"any": [100.0, 160.0, 250.0]}},
        )
    )
    kinds = {variable.where: type(variable) for variable in spec.variables}
    assert kinds == {
        ("plate", "size_mm", 1): Range,
        ("plate", "thickness_mm"): Choice,
        ("foundation", "stiffness_n_per_mm3"): Range,
        ("drive", "frequency_hz"): Choice,
    }
    # In the document's order: half-way of 30 to 60, of the standard sheets the sixth, between 0.01
    # and 0.09 by ratios 0.03, of the frequencies the last.
    document = document_of(spec, [0.5, 5.0, 0.5, 2.0], [(0.0, -9.0), (0.0, 9.0)])
    assert document["plate"]["size_mm"] == [12.0, 45.0]
    assert document["plate"]["thickness_mm"] == 0.6
    assert document["foundation"]["stiffness_n_per_mm3"] == pytest.approx(0.03)
    assert document["drive"]["frequency_hz"] == 250.0
    board = completed_board(document)
    assert len(board.electronics.pwm_pins) == len(board.actuators) == 2
    assert board.image.points == (25, 91)


def test_feet_with_the_same_list_of_parts_are_one_choice() -> None:
    kinds, other = ["rubber-foot-10x5", "rubber-foot-6x6"], ["rubber-foot-6x6", "silicone-foot-8x3"]
    lists = [kinds, other, kinds]
    feet = [
        {"at_mm": [0.0, y], "part": {"any": own}}
        for y, own in zip((-12.0, 0.0, 12.0), lists, strict=True)
    ]
    spec = spec_of(small(springs=feet))
    assert len(spec.variables) == 2
    document = document_of(spec, [1.0, 1.0], None)
    assert [one["part"] for one in document["springs"]] == [kinds[1], other[1], kinds[1]]


def test_each_number_of_a_foots_place_is_a_choice_of_its_own() -> None:
    """Two feet that face each other may come to lie otherwise (docs/own-board.md)."""
    feet = [
        {"at_mm": [x, {"from": 4.0, "to": 12.0}], "part": "silicone-foot-8x3"} for x in (-4.5, 4.5)
    ]
    spec = spec_of(small(springs=feet))
    document = document_of(spec, [0.0, 1.0], None)
    assert [one["at_mm"] for one in document["springs"]] == [[-4.5, 4.0], [4.5, 12.0]]


def test_a_board_that_cannot_be_is_named_before_any_layout(
    tmp_path: Path, chladni: CommandLine
) -> None:
    spec = tmp_path / "s.toml"
    feet = [{"at_mm": [0.0, 20.0], "part": "rubber-foot-6x6"}]
    spec.write_text(tomlkit.dumps(small(springs=feet)), encoding="utf-8")
    done = chladni("design", spec, "-o", tmp_path / "own.toml", "--jobs", "1")
    assert done.code == 2
    limits = "the whole foot is under the plate: |x| up to 3, |y| up to 13, got [0.0, 20.0]"
    assert f"springs[0].at_mm: expected a place where {limits}" in done.err
    assert [one.name for one in tmp_path.iterdir()] == ["s.toml"]


def test_a_material_stands_for_its_numbers_and_is_replaced_by_those_given() -> None:
    places = [(0.0, -9.0), (0.0, 9.0)]
    own = small(plate={"material": "aluminium", "loss_factor": 0.01})
    plate = completed_board(document_of(spec_of(own), [], places)).plate
    sheet = SHEETS["aluminium"]
    assert plate.youngs_modulus == sheet["youngs_modulus_gpa"] * 1e9
    assert (plate.density, plate.loss_factor) == (sheet["density_kg_m3"], 0.01)


def test_coils_stand_as_close_as_they_can_be_wound() -> None:
    magnet = {"radius_mm": 3.0, "height_mm": 4.0, "density_kg_m3": 7500.0, "stiffness_ratio": 1e3}
    winding = {
        "turns": 100,
        "wire_mm": 0.1,
        "inner_mm": 3.0,
        "outer_mm": 9.0,
        "height_mm": 1.0,
        "gap_mm": 1.0,
    }
    assert spec_of(small()).settings.coil_spacing == pytest.approx(8e-3)
    assert spec_of(small(magnet=magnet)).settings.coil_spacing == pytest.approx(6.5e-3)
    both = small(magnet=magnet, winding=winding)
    assert spec_of(both).settings.coil_spacing == pytest.approx(9.5e-3)
    own = small(magnet=magnet, design={"coil_spacing_mm": 12.0})
    assert spec_of(own).settings.coil_spacing == pytest.approx(12e-3)


def test_the_feet_of_a_sheet_may_be_open() -> None:
    """All feet's part as one, as catalogued; a part that there is not is refused at once."""
    text = (ROOT / "boards" / "specs" / "feet5.toml").read_text("utf-8")
    one = text.replace('{ any = ["rubber-foot-6x6", "rubber-foot-10x5"] }', '"rubber-foot-6x6"')
    assert len(parse_spec(one, file="feet5.toml").variables) == 1
    assert len(parse_spec(text, file="feet5.toml").variables) == 2
    with pytest.raises(InputError, match=r"springs\[0\]\.part: expected one of"):
        parse_spec(text.replace('x5"]', 'x9"]'), file="feet5.toml")


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "nothing free": (small(actuators=[{"name": "a", "at_mm": [0.0, 0.0]}], design={"coils": None}),
                     "nothing free"),
    "empty range": (small(plate={"thickness_mm": {"from": 0.4, "to": 0.2}}), "plate.thickness_mm"),
    "range of one": (small(plate={"thickness_mm": {"from": 0.2, "to": 0.2}}), "less than"),
    "empty list": (small(plate={"thickness_mm": {"any": []}}), "plate.thickness_mm.any"),
    "free without a meaning": (small(regions={"pitch_mm": "free"}), "regions.pitch_mm"),
    "coils that cannot fit": (small(design={"coils": 16}), "at most 14"),
    "no layout": (small(design={"coils": 7, "coil_spacing_mm": 12.0}), "no layout"),
    "more coils than channels": (small(design={"coils": 17}), "1 to 16 coils"),
    "more coils than bridges": (
        small(design={"coils": 9}, electronics={"drive": "bridge", "chip": "esp32s3"}),
        "take 8 coils, or drive = 'switch' on an ESP32",
    ),
    "more pins than coils": (small(electronics={"pwm_pins": [2, 4, 5]}),
        "electronics.pwm_pins: expected 2 pins, one per coil, got [2, 4, 5]; leave the key out"),
    "more pins than given coils": (
        small(actuators=[{"name": "a", "at_mm": [0.0, 0.0]}], design={"coils": None},
              plate={"thickness_mm": "free"}, electronics={"pwm_pins": [2, 4]}),
        "electronics.pwm_pins: expected 1 pin, one per coil",
    ),
    "how many": (small(design={"coils": None}), "design.coils"),
    "coils given": (small(actuators=[], plate={"thickness_mm": "free"}), "actuators are given"),
    "its own question": (small(fingers={"apart_mm": {"any": [16, 40]}}), "fingers.apart_mm"),
    "mass": (small(design={"mass_g": 0.01}), "mass_g by"),
    "all kept out": (small(design={"keep_out": [{"at_mm": [0.0, 0.0], "size_mm": [50.0, 50.0]}]}),
                     "no layout"),
    "kept out off the plate": (small(design={"keep_out": [{"at_mm": [0, 99], "size_mm": [5, 5]}]}),
                               "design.keep_out[0].at_mm: expected a rectangle that lies on the"),
    "centimetres": (small(plate={"size_mm": [1.4, 2.0]}), "centimetres? these are millimetres"),
    "weights": (small(design={"weights": {"loudness": 1.0}}), "design.weights.loudness"),
    "misspelt": (small(design={"evaluation": 5}), "evaluations"),
    "of [design]": (small(plate={"coils": 5}),
                    "plate.coils: expected a known key: this one goes into [design], got 5"),
    "of a board": (small(design={"supply_v": 5.0}), "this one goes into [electronics]"),
    "material": (small(plate={"material": "wood"}), "plate.material"),
    "missing block": (small() | {"plate": {}}, "plate.size_mm"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_spec_is_told_what_is_wrong(
    name: str, tmp_path: Path, chladni: CommandLine
) -> None:
    document, expected = WRONG[name]
    path = tmp_path / "spec.toml"
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    done = chladni("design", path, "-o", tmp_path / "b.toml", "--jobs", "1", "--json")
    assert done.code == 2
    assert expected in done.err
    assert str(path) in done.err
    assert not (tmp_path / "b.toml").exists()
    assert done.out == ""


@pytest.mark.parametrize("arguments", [
    ("-o", "b.json"), ("-o", "no/such/folder/b.toml"), ("-o", "b.toml", "--samples", "0"),
    ("-o", "b.toml", "--front", "no/folder"), ("-o", "b.toml", "--jobs", "0"),
    ("-o", "b.toml", "--scheduler", "tcp://127.0.0.1:9"), ("-o", "b.toml", "--scheduler", "there"),
])  # fmt: skip
def test_a_wrong_option_is_told_what_is_wrong(
    arguments: tuple[str, ...],
    tmp_path: Path,
    chladni: CommandLine,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("chladni.drives.workers.SCHEDULER_S", 0.5)
    (tmp_path / "spec.toml").write_text(tomlkit.dumps(small()), encoding="utf-8")
    done = chladni("design", "spec.toml", *arguments)
    assert done.code == 2
    assert "Traceback" not in done.err
    assert not list(tmp_path.glob("b.toml*"))


def test_an_error_names_what_was_wanted_there() -> None:
    with pytest.raises(InputError, match=r"magnet\.radius_mm"):
        spec_of(small(plate={"poissons_ratio": "free"}))


@pytest.mark.parametrize(("number", "drive"), [(0.0, "switch"), (1.0, "bridge")])
def test_a_driver_may_be_left_open_and_takes_its_own_keys(number: float, drive: str) -> None:
    electronics = {
        "drive": {"any": ["switch", "bridge"]},
        "least_duty": 0.085,
        "diode_v": 0.3,
        "lost_ns": 60.0,
    }
    spec = spec_of(small(electronics=electronics))
    assert [own.where for own in spec.variables] == [("electronics", "drive")]
    found = completed_board(document_of(spec, [number], [(0.0, -9.0), (0.0, 9.0)])).electronics
    assert found.drive == drive
    assert len(found.pwm_pins) == 2
    if drive == "bridge":
        assert (len(found.sign_pins), found.lost_ns, found.least_duty) == (2, 60.0, 0.0)
    else:
        assert (found.sign_pins, found.least_duty, found.diode_v) == ((), 0.085, 0.3)


def test_a_given_driver_refuses_what_is_the_other_s() -> None:
    with pytest.raises(InputError, match="least_duty does not go with"):
        spec_of(small(electronics={"drive": "bridge", "least_duty": 0.085}))


@pytest.mark.parametrize("chip", ["esp32", "esp32s3"])
def test_pins_are_found_for_eight_bridges_and_no_more(chip: str) -> None:
    """Beside a panel; a large plate, so that only pins are short."""
    own = {
        "plate": {"size_mm": [100.0, 100.0]},
        "electronics": {"drive": "bridge", "chip": chip},
        "panel": {"pixels": [320, 480], "size_mm": [50.0, 90.0]},
    }
    places = [(-30.0 + 20.0 * (k % 4), -10.0 + 20.0 * (k // 4)) for k in range(8)]
    spec = spec_of(small(**own, design={"coils": 8}))
    found = completed_board(document_of(spec, [], places)).electronics
    assert len(set(found.pwm_pins) | set(found.sign_pins)) == 16
    with pytest.raises(InputError, match="1 to 8 coils"):
        spec_of(small(**own, design={"coils": 9}))


@pytest.mark.parametrize("drive", ["switch", "bridge"])
def test_free_pins_keep_off_a_panel_that_is_wired_elsewhere(drive: str) -> None:
    panel = {"pixels": [320, 480], "size_mm": [12.0, 32.0], "sda_pin": 4, "scl_pin": 5}
    spec = spec_of(small(panel=panel, electronics={"drive": drive}))
    pins = spec.document["electronics"]
    assert not {4, 5} & {*pins["pwm_pins"], *pins.get("sign_pins", [])}
    assert drive == "bridge" or not {2, 12} & {*pins["pwm_pins"][:10]}  # straps come last
    # Of 17 gates 15 are left, two of them for each bridge.
    assert len(pins["pwm_pins"]) == (7 if drive == "bridge" else 15)


@pytest.mark.parametrize(
    ("weights", "blocks"),
    [
        (None, {"focus"}),
        ({"second_finger_db": 1.0, "mass_g": 0.1}, {"focus"}),
        ({"fingers_2_db": 1.0, "coils": 0.5}, {"fingers"}),
        ({"fingers_um_db": 1.0, "focal_error_mm": 1.0}, {"focus", "fingers"}),
        ({"mass_g": 1.0}, {"focus"}),
    ],
)
def test_a_board_carries_what_it_was_searched_for(
    weights: dict[str, float] | None, blocks: set[str]
) -> None:
    spec = spec_of(small(design={"weights": weights}))
    found = completed_board(document_of(spec, [], [(0.0, -8.0), (0.0, 8.0)]))
    text = board_file(found, ["Own."]).decode()
    assert text.startswith("# Own.\n# A key that is not here has its default: ")
    written = tomllib.loads(text)
    assert {"focus", "fingers"} & written.keys() == blocks
    assert default_objective(board_from_document(written)) == "focus"


def test_a_focus_that_a_spec_gives_stays_as_it_is() -> None:
    spec = spec_of(small(focus={"quieter_db": 1.5}))
    assert spec.document["focus"] == {"quieter_db": 1.5}


def test_all_that_is_wrong_with_a_spec_is_named_at_once() -> None:
    wrong = small(
        plate={"thickness_mm": {"any": [0.2, -1.0]}, "colour": "red"},
        drive={"frequency_hz": 0.0},
        design={"coil": 3, "finger_um": -1.0, "symmetric": 1, "weights": {"loudness": 1.0}},
    )
    with pytest.raises(FaultsError) as caught:
        spec_of(wrong)
    assert [one.field for one in caught.value.errors] == [
        "design.coil",
        "design.finger_um",
        "design.symmetric",
        "design.weights.loudness",
        "plate.colour",
        "drive.frequency_hz",
    ]
    assert "'coils', perhaps" in str(caught.value)


def test_each_value_of_a_list_is_checked() -> None:
    """Not only the first, of which a board is made to begin with."""
    with pytest.raises(InputError, match=r"plate\.thickness_mm: .* got -1"):
        spec_of(small(plate={"thickness_mm": {"any": [0.3, 0.4, -1.0]}}))
    with pytest.raises(InputError, match=r"foundation\.material: .* got 'sponge'"):
        spec_of(small(foundation={"material": {"any": ["sponge-rubber", "sponge"]}}))


def test_a_value_that_a_search_could_choose_is_told_so() -> None:
    for wrong in ("fre", {"form": 0.1, "to": 0.4}):
        with pytest.raises(InputError, match=r'or "free", \{ any = ') as caught:
            spec_of(small(plate={"thickness_mm": wrong}))
        assert caught.value.field == "plate.thickness_mm"


def test_the_smallest_spec_of_the_page_runs() -> None:
    """The first block of docs/design.md: one board of it, scored as a search does."""
    page = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
    spec = parse_spec(page.split("```toml\n")[1].split("```")[0], file="design.md")
    (count,) = spec.coils
    places = [(0.0, 11.0 * (k - (count - 1) / 2.0)) for k in range(count)]
    document = document_of(spec, [0.0] * len(spec.variables), places)
    found = evaluate(spec, document, seed=1)
    assert found.broken is None
    assert found.terms["second_finger_20mm_db"] > 3.0


def test_a_range_of_what_is_sold_has_only_what_is_sold() -> None:
    """No one sells a sheet of 0.20241 mm; of frequencies there is any."""
    thick = {"thickness_mm": {"from": 0.15, "to": 0.45}}
    spec = spec_of(small(plate=thick, drive={"frequency_hz": {"from": 100.0, "to": 200.0}}))
    sheet, frequency = spec.variables
    assert isinstance(sheet, Choice)
    assert sheet.options == (0.2, 0.3, 0.4)
    assert isinstance(frequency, Range)
    (between,) = spec_of(small(plate={"thickness_mm": {"from": 0.21, "to": 0.29}})).variables
    assert isinstance(between, Range)


def test_micrometres_are_weighed_only_with_a_coil() -> None:
    """Without one they counted as −40 dB, and no word was said. A winding makes one."""
    text = (ROOT / "boards" / "specs" / "pad-open.toml").read_text("utf-8")
    document = tomllib.loads(text)
    document["design"]["weights"] = {"second_finger_20mm_db": 1.0, "finger_db": 0.2}
    assert spec_of(document).weights["finger_db"] == 0.2
    without = {key: value for key, value in document.items() if key != "coil"}
    assert spec_of(without).weights["finger_db"] == 0.2
    del without["winding"]
    with pytest.raises(InputError, match=r"coil is required.*design\.weights\.finger_db"):
        spec_of(without)
