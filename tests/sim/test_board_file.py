"""Boards from files: what they hold, and how every fault is named."""

from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path
from typing import Any

import pytest

from chladni.sim.board.board import Board, to_document
from chladni.sim.board.file import (
    board_from_document,
    load_board,
    parse_board,
    shipped_boards,
)
from chladni.sim.board.fingers import FINGERS
from chladni.sim.board.parts import Isolation
from chladni.sim.board.writing import board_file
from chladni.sim.errors import ConflictError, FaultsError, InputError
from conftest import ROOT
from prototype_document import document, set_key


def test_shipped_boards_carry_the_published_numbers(paper: Board, prototype: Board) -> None:
    """Sizes and materials of the paper and of its authors' computation."""
    assert paper.plate.size == pytest.approx((71.5e-3, 146.7e-3))
    assert (paper.plate.youngs_modulus, paper.plate.poissons_ratio) == (3.2e9, 0.35)
    assert (paper.plate.density, paper.plate.loss_factor) == (1190.0, 0.0)
    assert (prototype.plate.youngs_modulus, prototype.plate.poissons_ratio) == (22e9, 0.15)
    assert (prototype.plate.density, prototype.plate.loss_factor) == (1900.0, 0.02)
    assert len(prototype.screws) == 6
    assert prototype.magnet is not None
    assert prototype.magnet.areal_mass == pytest.approx(30.0)
    for board in (paper, prototype):
        places = {tuple(round(v * 1e3, 6) for v in a.at) for a in board.actuators}
        assert places == {
            (0.0, 0.0),
            (24.25, 43.35),
            (-24.25, 43.35),
            (24.25, -43.35),
            (-24.25, -43.35),
        }


def test_paper_wavelength_is_141_mm_not_187(paper: Board) -> None:
    """physics.md: 1 mm acrylic at 160 Hz; the paper's 187 mm does not follow from its numbers."""
    assert paper.wavelength(160.0) == pytest.approx(0.141, abs=5e-4)


def test_template_is_a_board() -> None:
    board = load_board(ROOT / "boards" / "template.toml")
    assert board.name == "my-board"
    assert "template" not in shipped_boards()


def test_a_board_survives_the_way_through_its_document(prototype: Board) -> None:
    assert board_from_document(to_document(prototype)) == prototype


def test_fingerprint_follows_physics_and_nothing_else(prototype: Board) -> None:
    thicker = dataclasses.replace(
        prototype, plate=dataclasses.replace(prototype.plate, thickness=1.01e-3)
    )
    renamed = dataclasses.replace(prototype, name="other")
    assert thicker.fingerprint() != prototype.fingerprint()
    assert renamed.fingerprint() == prototype.fingerprint()


def test_boards_are_frozen(prototype: Board) -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        prototype.name = "x"  # type: ignore[misc]


FOAM = {"stiffness_n_per_mm3": 0.03}
COILS, APART = {"by": "its own coils", "date": "2026-11-27"}, {"fingers_2_db": 25.0}
FAULTS = [
    ("plate.thickness_mm", -1.0, "plate.thickness_mm"),
    ("plate.thickness_mm", True, "plate.thickness_mm"),
    ("plate.thickness_mm", float("nan"), "plate.thickness_mm"),
    ("plate.thickness_mm", 20.0, "plate.thickness_mm"),
    ("plate.thickness_mm", None, "plate.thickness_mm"),
    ("plate.thicknes_mm", 1.0, "plate.thicknes_mm"),
    ("plate.poissons_ratio", 0.6, "plate.poissons_ratio"),
    ("plate.loss_factor", -0.01, "plate.loss_factor"),
    ("plate.size_mm", [71.5], "plate.size_mm"),
    ("plate.edges", "glued", "plate.edges"),
    ("plate.edges", ["free", "clamped"], "plate.edges"),
    ("plate.edges", {"left": "free", "lefft": "clamped"}, "plate.edges.lefft"),
    ("plate.edges", {"left": "welded"}, "plate.edges.left"),
    ("screws.0.radius_mm", 0.0, "screws[0].radius_mm"),
    ("screws.0.support", "glued", "screws[0].support"),
    ("screws.0.support", "sprung", "screws[0].support"),
    ("screws.0.stiffness_n_per_mm", 5.0, "screws[0].support"),
    ("plate.corner_radius_mm", 36.0, "plate.corner_radius_mm"),
    ("plate.corner_radius_mm", -1.0, "plate.corner_radius_mm"),
    ("plate.corner_radius_mm", 33.0, "screws[0].at_mm"),
    ("pins", [{"at_mm": [0.0, 0.0]}], "actuators[0].at_mm"),
    ("pins", [{"at_mm": [99.0, 0.0]}], "pins[0].at_mm"),
    (
        "springs",
        [{"at_mm": [10.0, 0.0], "stiffness_n_per_mm": 1.0, "rotational_n_mm_per_rad": 1.0}],
        "springs[0].rotational_n_mm_per_rad",
    ),
    ("masses", [{"at_mm": [10.0, 0.0], "mass_g": 1.0, "height_mm": 1.0}], "masses[0].radius_mm"),
    ("holes", [{"at_mm": [33.0, 0.0], "radius_mm": 5.0}], "holes[0].at_mm"),
    ("holes", [{"at_mm": [25.0, 0.0], "radius_mm": 5.0}], "holes[0].at_mm"),
    ("actuators.1.at_mm", [40.0, 0.0], "actuators[1].at_mm"),
    ("actuators.1.at_mm", [35.0, 0.0], "actuators[1].at_mm"),
    ("actuators.1.at_mm", [0.0, 0.0], "actuators[1].at_mm"),
    ("actuators.1.at_mm", [25.0, 0.0], "actuators[1].at_mm"),
    ("actuators.1.name", "centre", "actuators[1].name"),
    ("actuators", [], "actuators"),
    ("screws.0.at_mm", [-35.5, -63.35], "screws[0].at_mm"),
    ("drive.frequency_hz", 0, "drive.frequency_hz"),
    ("drive.max_gain", 0, "drive.max_gain"),
    ("image.points", [179.5, 367], "image.points"),
    ("regions.pitch_mm", 100.0, "regions.pitch_mm"),
    ("electronics.pwm_pins", [2, 4], "electronics.pwm_pins"),
    ("electronics.touch_timeout_ms", 10.0, "electronics.touch_timeout_ms"),
    ("electronics.pwm_bits", 13, "electronics.pwm_bits"),
    ("electronics.chip", "esp32c3", "electronics.chip"),
    ("electronics.chip", [], "electronics.chip"),
    ("electronics.chip", {}, "electronics.chip"),
    ("electronics.drive", [], "electronics.drive"),
    ("name", "a name that is far too long", "name"),
    ("plate", None, "plate"),
    ("drive", 160.0, "drive"),
    ("coil.turns", 150, "coil.turns"),
    ("coil.resistance_ohm", 0.0, "coil.resistance_ohm"),
    ("motor", {"turns": 150}, "motor"),
    ("foundation", {"loss_factor": 0.1}, "foundation.stiffness_n_per_mm3"),
    ("foundation", {"stiffness_n_per_mm3": -0.03}, "foundation.stiffness_n_per_mm3"),
    ("foundation", {"material": "straw", "thickness_mm": 2.0}, "foundation.material"),
    ("foundation", {"material": "soft-pu-foam"}, "foundation.thickness_mm"),
    ("foundation", {**FOAM, "strips": {"left_mm": 40.0, "right_mm": 40.0}},
     "foundation.strips.left_mm and right_mm"),
    ("foundation", {**FOAM, "strips": {"let_mm": 4.0}}, "foundation.strips.let_mm"),
    ("foundation", {**FOAM, "cut_outs": [{"at_mm": [33.0, 0.0], "radius_mm": 3.0}]},
     "foundation.cut_outs[0]"),
    ("foundation", {**FOAM, "cut_outs": [{"at_mm": [24.0, 0.0], "radius_mm": 3.0}]},
     "foundation.cut_outs[0]"),
    ("foundation", {**FOAM, "coil_cut_out_mm": 40.0},
     "foundation.coil_cut_out_mm of actuators[0]"),
    ("foundation", {**FOAM, "coil_cut_out_mm": 3.9}, "foundation.coil_cut_out_mm"),
    ("foundation", {"material": "soft-pu-foam", "thickness_mm": 0.003}, "foundation.thickness_mm"),
    ("foundation", {**FOAM, "thickness_mm": 2.0}, "foundation.material"),
    ("foundation", {"sealed_air_mm": 1e-9}, "foundation.sealed_air_mm"),
    ("finger", 3, "finger"),
    ("electronics.coil_ohm", 4.0, "electronics.coil_ohm"),
    ("finger", "heavy", "finger"),
    ("finger", {"mass_g": -1.0, "damping_n_s_per_m": 1.0, "stiffness_n_per_mm": 0.5},
     "finger.mass_g"),
    ("finger", {"mass_g": 1.0, "stiffness_n_per_m": 1.0}, "finger.stiffness_n_per_m"),
    ("measured", {**COILS, "before": 25.0, "after": APART}, "measured.before"),
    ("measured", {**COILS, "before": APART}, "measured.after"),
    ("measured", {**COILS, "after": APART}, "measured.before"),
    ("measured", {**COILS, "before": {}, "after": APART}, "measured.before.fingers_2_db"),
    ("measured", {**COILS, "before": APART, "after": {"fingers_2_db": "39"}},
     "measured.after.fingers_2_db"),
    ("measured", {**COILS, "before": {**APART, "second_finger_20mm_db": 1e3}, "after": APART},
     "measured.before.second_finger_20mm_db"),
    ("measured", {**COILS, "values": [{"name": "foam", "ratio": 0, "low": 0, "high": 1}]},
     "measured.values[0].ratio"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "value", "field"), FAULTS)
def test_a_fault_is_named_by_its_key(path: str, value: Any, field: str) -> None:
    with pytest.raises(InputError) as caught:
        board_from_document(set_key(path, value))
    assert caught.value.field == field
    assert "expected" in str(caught.value) or "is required" in str(caught.value)


def test_a_stiffness_does_not_go_with_a_material() -> None:
    both = {**FOAM, "material": "poron-4701-30", "thickness_mm": 2.0}
    with pytest.raises(ConflictError, match=r"does not go with foundation\.material"):
        board_from_document(set_key("foundation", both))


def test_a_foundation_is_what_its_sheet_and_its_air_make() -> None:
    """2 mm of a 0.06 MPa foam are 3e7 N/m³; a closed gap of 1 mm adds γp/h, 1.4e8."""
    sheet = {"material": "soft-pu-foam", "thickness_mm": 2.0, "sealed_air_mm": 1.0}
    own = board_from_document(set_key("foundation", sheet)).foundation
    assert own is not None
    assert own.sheet_stiffness == pytest.approx(3e7)
    assert own.air_stiffness == pytest.approx(1.42e8, rel=2e-3)
    # Only the sheet loses: 0.2 of its share.
    assert own.total_loss_factor == pytest.approx(0.2 * 3e7 / (3e7 + own.air_stiffness))


def test_a_board_with_foam_and_finger_survives_the_way_through_its_document() -> None:
    changed = set_key(
        "foundation",
        {
            **FOAM,
            "loss_factor": 0.0,
            "coil_cut_out_mm": 6.0,
            "strips": {"top_mm": 4.0},
            "cut_outs": [{"at_mm": [0.0, 20.0], "radius_mm": 3.0}],
        },
    )
    for finger in ("firm", {"name": "firm"}):
        board = board_from_document({**changed, "finger": finger})
        assert board.finger == FINGERS["firm"]
        assert board_from_document(to_document(board)) == board


def test_what_was_measured_survives_the_way_through_a_file() -> None:
    """With and without how fingers do, which older files do not say."""
    values = [{"name": "foam", "ratio": 2.0, "low": 1.5, "high": 3.0}]
    after = {"fingers_2_db": 39.25, "second_finger_20mm_db": 21.5}
    for more in ({}, {"before": APART, "after": after}):
        board = board_from_document(set_key("measured", {**COILS, "values": values, **more}))
        again = parse_board(board_file(board).decode(), file="a.toml")
        assert again.measured == board.measured
        assert again.measured is not None
        assert again.measured.after == (Isolation(39.25, 21.5) if more else None)


def test_a_misspelt_key_suggests_the_right_one() -> None:
    with pytest.raises(InputError, match="'thickness_mm', perhaps"):
        board_from_document(set_key("plate.thicknes_mm", 1.0))


@pytest.mark.parametrize("size", [[7.15, 14.67], [30.0, 60.0], [146.7, 71.5]])
def test_coils_off_the_plate_are_named_or_their_size_asked_for(size: list[float]) -> None:
    with pytest.raises(InputError) as caught:
        board_from_document(set_key("plate.size_mm", size))
    faults = caught.value.errors if isinstance(caught.value, FaultsError) else [caught.value]
    named = [own.field for own in faults if own.field.startswith("actuators")]
    is_asked = str(caught.value).endswith(f"got {size}; centimetres? these are millimetres")
    assert (is_asked, len(named) >= 4) == ((True, False) if size[0] < 10 else (False, True))
    assert ("are the sides of plate.size_mm swapped?" in str(caught.value)) == (size[0] > 100.0)


@pytest.mark.parametrize(
    ("field", "value", "asked"),
    [
        ("drive.frequency_hz", 0.16, "; kHz? this is in Hz"),
        ("plate.thickness_mm", 400, "; µm? this is in mm"),
        ("plate.thickness_mm", "3 mm", "; the number alone, without quotes or a unit"),
        ("plate.youngs_modulus_gpa", 22000.0, "; MPa? this is in GPa"),
        ("plate.thickness_mm", -1.0, ""),
        ("plate.thickness_mm", 10**400, ""),
        ("drive.frequency_hz", 1e6, ""),
    ],
)
def test_a_number_in_another_unit_is_asked_about(field: str, value: object, asked: str) -> None:
    """Only where it is in range in that unit."""
    with pytest.raises(InputError) as caught:
        board_from_document(set_key(field, value))
    assert str(caught.value).endswith(f"got {value!r}{asked}") or value == 10**400
    assert ("? this is in" in str(caught.value)) == ("? this is in" in asked)


def test_a_near_name_is_suggested() -> None:
    with pytest.raises(InputError, match="quiet16, perhaps"):
        load_board("quite16")
    document = {**set_key("name", "b"), "plate": {"size_mm": [71.5, 146.7], "thickness_mm": 1.6}}
    document["plate"]["material"] = "aluminum"
    with pytest.raises(InputError, match="'aluminium', perhaps"):
        board_from_document(document)


def test_a_winding_alone_makes_a_coil() -> None:
    text = shipped_boards()["strip5"].read_text("utf-8")
    whole = parse_board(text, file="a")
    document = tomllib.loads(text)
    del document["coil"]
    alone = board_from_document(document)
    assert alone.coil is not None
    assert whole.coil is not None
    assert alone.coil.force_factor == whole.coil.force_factor


def test_errors_of_a_file_name_the_file(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text("name = [", encoding="utf-8")
    with pytest.raises(InputError, match=r"bad\.toml, syntax"):
        load_board(path)
    with pytest.raises(InputError, match="paper, phone15, phone5, phone8, prototype"):
        load_board(tmp_path / "missing.toml")


@pytest.mark.parametrize(
    ("block", "value", "field"),
    [
        ("focus", {"quieter_db": -1.0}, "focus.quieter_db"),
        ("focus", {"silent_from_mm": 0.0}, "focus.silent_from_mm"),
        ("focus", {"floor_um": "5"}, "focus.floor_um"),
        ("focus", {"quieter_from_mm": 21.0}, "focus.quieter_from_mm"),
        ("focus", {"loud_from_mm": 1.0}, "focus.loud_from_mm"),
        ("focus", 3, "focus"),
        ("active", {"margin_mm": -1.0}, "active.margin_mm"),
        ("active", {"margin_mm": 35.75}, "active.margin_mm"),
    ],
)
def test_faults_of_focus_and_active_area_are_named(block: str, value: Any, field: str) -> None:
    faulty = document() | {block: value}
    with pytest.raises(InputError) as caught:
        board_from_document(faulty)
    assert caught.value.field == field


def test_what_a_focus_keeps_to_is_part_of_a_board_and_where_fingers_go_is_not() -> None:
    """Drives depend on the one, only scores on the other."""
    plain = board_from_document(document())
    asked = board_from_document(document() | {"focus": {"quieter_db": 4.0}})
    assert asked.focus is not None
    assert asked.focus.quieter_db == 4.0
    assert asked.focus.silent_from == pytest.approx(20e-3)
    assert asked.fingerprint() != plain.fingerprint()
    active = board_from_document(document() | {"active": {"margin_mm": 6.0}})
    assert active.active is not None
    assert active.active.margin == pytest.approx(6e-3)
    assert active.fingerprint() == plain.fingerprint()
    assert board_from_document(to_document(asked)) == asked
    assert board_from_document(to_document(active)) == active


def test_a_spec_is_no_board(tmp_path: Path) -> None:
    """One error, and what makes a board of it, in place of one for each value left open."""
    spec = tmp_path / "spec.toml"
    spec.write_text('actuators = "free"\n[design]\ncoils = 5\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"a board file, got 'a SPEC'.*chladni design SPEC -o"):
        load_board(spec)


def test_words_that_there_are_not_are_named_with_all_else(tmp_path: Path) -> None:
    """Whether a block's or another's: only the first of them was."""
    text = shipped_boards()["phone8"].read_text(encoding="utf-8")
    for old, new in (
        ('"bridge"', '"brige"'),
        ('"esp32s3"', '"esp32-s3"'),
        ('"gt911"', '"gt-911"'),
        ("thickness_mm = 0.4", "thickness_mm = -1"),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    path = tmp_path / "own.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_board(path)
    told = str(caught.value).splitlines()
    named = ("plate.thickness_mm", "electronics.chip", "electronics.drive", "panel.controller")
    assert all(any(key in line for line in told) for key in named)
