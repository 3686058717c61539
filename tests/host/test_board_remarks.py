"""What `board show` and `design` remark on in a board that is valid and yet not what was meant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from chladni.design.spec import spec_of
from chladni.host.cli.common.board_reports import (
    actuator_rows,
    say_leftovers,
    say_of_coils,
    say_panel,
)
from chladni.host.cli.common.finger_remarks import say_mirrored, say_worse
from chladni.host.cli.designing.remarks import say_first
from chladni.host.manufacture.drawing import Text, board_drawing
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import SeveralFingers
from chladni.sim.board.foundation import Strips
from chladni.sim.board.panel_layer import layered_plate
from chladni.sim.board.parts import Isolation, Measured, Spring
from chladni.sim.board.quantity import MM
from chladni.sim.board.writing import board_file
from conftest import CommandLine, shipped_board
from made_specs import small

Change = Callable[[Board], Board]


def without_holes(board: Board) -> Board:
    assert board.foundation is not None
    return replace(board, foundation=replace(board.foundation, coil_cut_out=0.0))


def with_wider_holes(board: Board) -> Board:
    assert board.foundation is not None
    return replace(board, foundation=replace(board.foundation, coil_cut_out=3.25e-3))


def with_cool_coils(board: Board) -> Board:
    return replace(board, electronics=replace(board.electronics, coil_k_per_w=60.0))


def on_steel(board: Board) -> Board:
    return replace(board, plate=replace(board.plate, material="steel"))


def without_remanence(board: Board) -> Board:
    assert board.magnet is not None
    return replace(board, coil=None, magnet=replace(board.magnet, remanence=0.0))


def on_two_milliamperes(board: Board) -> Board:
    return replace(board, electronics=replace(board.electronics, supply_limit_ma=2.0))


def on_low_feet(board: Board) -> Board:
    foot = Spring((0.0, 0.06), 1e4, part="rubber-foot-6x6")
    return replace(board, foundation=None, springs=(foot,))


def with_swapped_pixels(board: Board) -> Board:
    assert board.panel is not None
    return replace(board, panel=replace(board.panel, pixels=(2160, 1080)))


CHANGES: dict[str, Change] = {
    "foam, which has no holes: foundation.coil_cut_out_mm is their radius, 3 or": without_holes,
    "1 mm into 6 mm of foam, whose holes are ⌀6.5 (coil_cut_out_mm is a radius)": with_wider_holes,
    "coil_k_per_w, 60, is of a coil of ⌀15 mm: one of ⌀10 gets hotter": with_cool_coils,
    "steel is magnetic": on_steel,
    "supply_limit_ma, 2 mA, is less than a tenth": on_two_milliamperes,
    "winding need 6.5 mm under the plate, and feet of 6 mm leave less": on_low_feet,
    "no force is known, so no micrometres: give magnet.remanence_t": without_remanence,
}


@pytest.mark.parametrize(("words", "change"), CHANGES.items())
def test_what_coils_and_sheet_lack_is_remarked_on(
    words: str, change: Change, capsys: pytest.CaptureFixture[str]
) -> None:
    board = shipped_board("phone8")
    say_of_coils(board)
    assert words not in capsys.readouterr().err
    say_of_coils(change(board))
    assert words in capsys.readouterr().err


def test_foam_in_strips_is_no_foam_at_coils_beside_them(capsys: pytest.CaptureFixture[str]) -> None:
    """Phone8's outermost magnets begin some 8 mm from the long edges."""
    board = without_holes(shipped_board("phone8"))
    assert board.foundation is not None
    assert board.magnet is not None
    edge = board.plate.size[0] / 2.0 - max(abs(own.at[0]) for own in board.actuators)
    reach = board.magnet.radius
    for width, is_told in ((edge - reach - 1e-4, False), (edge - reach + 1e-4, True)):
        strips = Strips(left=width, right=width)
        say_of_coils(replace(board, foundation=replace(board.foundation, strips=strips)))
        assert ("hang into the foam" in capsys.readouterr().err) == is_told


def test_a_plate_that_resonates_among_effects_is_remarked_on(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """On feet a plate of 1.5 mm has modes from 50 Hz on, which a score at 160 Hz does not show."""
    board = shipped_board("prototype")
    soft = replace(board, screws=(), springs=tuple(Spring(own.at, 2e4) for own in board.screws))
    words = "is kept from other fingers only below it"
    for purpose, own in ((SeveralFingers(), soft), (None, soft), (SeveralFingers(), board)):
        path = tmp_path / "b.toml"
        path.write_bytes(board_file(replace(own, fingers=purpose)))
        said = chladni("board", "show", path).err
        assert (words in said) == (purpose is not None and own is soft)
        assert "a stiffer sheet or stiffer supports raise it" in said or words not in said


@pytest.mark.parametrize(("x_mm", "width_mm"), [(0.0, 40.0), (0.0, 14.0), (5.0, 40.0)])
def test_coils_on_a_middle_line_are_remarked_on(
    x_mm: float, width_mm: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where two fingers have room beside it."""
    strip = shipped_board("strip5")
    coils = tuple(
        replace(own, at=(x_mm * MM * (-1.0) ** k, own.at[1]))
        for k, own in enumerate(strip.actuators)
    )
    plate = replace(strip.plate, size=(width_mm * MM, strip.plate.size[1]))
    board = replace(strip, actuators=coils, plate=plate)
    say_mirrored(board)
    said = "fingers left and right of it, mirrored, feel the same" in capsys.readouterr().err
    assert said == (x_mm == 0.0 and width_mm > 16.0)
    # Between two hands there is none on either side of it.
    say_mirrored(replace(board, fingers=SeveralFingers(apart=38e-3)))
    assert capsys.readouterr().err == ""


def test_a_measured_board_whose_drives_are_worse_is_remarked_on(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def said(before: Isolation | None, after: Isolation | None) -> str:
        measured = Measured("a microphone", "2026-11-29", (), before, after)
        say_worse(replace(shipped_board("phone5"), measured=measured))
        return capsys.readouterr().err

    worse = said(Isolation(34.3), Isolation(29.9))
    assert "keep two fingers 30 dB apart on its plate, and the drawn board's 34" in worse
    assert said(Isolation(29.9), Isolation(34.3)) == said(None, None) == ""


def test_feet_are_shown(chladni: CommandLine, tmp_path: Path) -> None:
    feet = tuple(Spring((x, 20e-3), 8e3) for x in (-5e-3, 5e-3))
    path = tmp_path / "b.toml"
    path.write_bytes(board_file(replace(shipped_board("strip5"), springs=feet)))
    assert chladni("board", "show", path, "--json").json["feet"] == "2 × 8 N/mm"


@pytest.mark.parametrize(
    ("size_mm", "rotation", "asked"),
    [
        ((71.5, 146.7), 0, ""),
        ((61.0, 130.0), 0, ""),
        ((76.0, 152.0), 0, ""),
        ((80.5, 156.0), 0, "is panel.size_mm of another board?"),
        ((54.0, 94.0), 0, "is panel.size_mm of another board?"),
        ((120.0, 200.0), 0, "is panel.size_mm of another board?"),
        ((71.5, 146.7), 90, "is it to be turned, by panel.rotation_deg?"),
        ((146.7, 71.5), 0, "is it to be turned, by panel.rotation_deg?"),
        ((146.7, 71.5), 270, ""),
    ],
)
def test_a_panel_that_leaves_much_of_the_plate_out_is_asked_about(
    capsys: pytest.CaptureFixture[str], size_mm: tuple[float, float], rotation: int, asked: str
) -> None:
    """`phone5` is 71.5 × 146.7 mm; a panel that is a little smaller or larger can be bought."""
    board = load_board("phone5")
    assert board.panel is not None
    size = (1e-3 * size_mm[0], 1e-3 * size_mm[1])
    panel = replace(board.panel, size=size, rotation_deg=rotation)
    say_leftovers(replace(board, panel=panel))
    said = capsys.readouterr().err
    assert ("the panel senses x" in said) == bool(asked)
    assert asked in said


def test_a_panel_whose_pixels_are_long_is_remarked_on(capsys: pytest.CaptureFixture[str]) -> None:
    """Twice as many along its short side as along its long one."""
    board = shipped_board("phone8")
    say_leftovers(board, [])
    assert "a pixel of the panel" not in capsys.readouterr().err
    say_leftovers(with_swapped_pixels(board), [])
    assert "a pixel of the panel is 0.033 × 0.14 mm" in capsys.readouterr().err


def test_a_panel_longer_than_any_that_is_sold_is_remarked_on(
    chladni: CommandLine, tmp_path: Path
) -> None:
    board = shipped_board("phone5")
    assert board.panel is not None
    own = tmp_path / "own.toml"
    for longest, is_told in ((146.7e-3, False), (240e-3, True)):
        panel = replace(board.panel, size=(71.5e-3, longest))
        own.write_bytes(board_file(replace(board, panel=panel)))
        told = "there is one of 240 mm before you order" in chladni("board", "show", own).err
        assert told == is_told


@pytest.mark.parametrize(("several", "words"), [(True, "a finger moves less"), (False, "a focus")])
def test_a_stiff_panel_is_told_before_a_search_by_what_the_board_is_for(
    several: bool, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    panel = {"place": "on", "film_mm": 0.3, "pixels": [320, 480]}
    weights = {"fingers_2_db": 1.0} if several else None
    say_first(spec_of(small(panel=panel, design={"weights": weights})), 1, 1)
    assert f"times as stiff: {words}" in capsys.readouterr().err


def test_under_a_stiff_panel_a_metal_is_told_no_place_that_it_shields(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The remark has the sheet that it is about: a SPEC leaves several open."""
    board = shipped_board("phone5")
    assert board.panel is not None
    panel = replace(board.panel, place="on", film=0.5e-3)
    for material, places in (("aluminium", "says usual ones)\n"), ("fr4", ", or place 'in' or 'b")):
        sheet = replace(board.plate, material=material, thickness=0.3e-3)
        layered = layered_plate(replace(board, plate=sheet, panel=panel))
        assert layered is not None
        say_panel(layered, for_several=True)
        told = capsys.readouterr().err
        assert f"the plate (0.3 mm {material})" in told
        assert places in told


def test_a_hole_is_told_as_it_is_cut_too(capsys: pytest.CaptureFixture[str]) -> None:
    """The file has a magnet's radius, and the drawing's list what clears it."""
    board = shipped_board("phone5")
    say_of_coils(board)
    assert "⌀6 (coil_cut_out_mm is a radius; cut ⌀6.5, to clear" in capsys.readouterr().err
    texts = [own.text for own in board_drawing(board).shapes if isinstance(own, Text)]
    assert "its holes ⌀6.5: ⌀6 of the board file, and room for the magnets" in texts


def test_a_measured_board_shows_what_its_coils_push() -> None:
    board = shipped_board("phone5")
    assert "force_ratio" not in actuator_rows(board)[0]
    weak, dead, *others = board.actuators
    weak, dead = replace(weak, polarity=-1, trim_db=6.0), replace(dead, is_dead=True)
    own = Measured("a recording", "2026-11-27")
    rows = actuator_rows(replace(board, actuators=(weak, dead, *others), measured=own))
    assert [row["force_ratio"] for row in rows[:3]] == [pytest.approx(-0.5012, abs=1e-4), 0.0, 1.0]


@pytest.mark.parametrize(("n_per_mm", "is_told"), [(75.2, False), (75_200.0, True)])
def test_a_foot_in_newtons_per_metre_is_remarked_on(
    n_per_mm: float, is_told: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    board = load_board("phone5")
    say_leftovers(replace(board, springs=(Spring((0.0, 20e-3), 1e3 * n_per_mm),)))
    said = capsys.readouterr().err
    assert ("a spring of 75200 N/mm hardly gives" in said) == is_told


def test_a_board_without_gpios_is_told_that_a_device_needs_them(
    chladni: CommandLine, tmp_path: Path
) -> None:
    board = load_board("phone5")
    electronics = replace(board.electronics, pwm_pins=(), sign_pins=())
    path = tmp_path / "b.toml"
    for own, is_told in ((board, False), (replace(board, electronics=electronics), True)):
        path.write_bytes(board_file(own, []))
        shown = chladni("board", "show", path)
        assert shown.code == 0, shown.err
        assert ("no electronics.pwm_pins: a device needs a GPIO" in shown.err) == is_told
