"""Drawings for manufacture: every circle and outline read back, in both formats."""

from __future__ import annotations

import itertools
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import ezdxf
import pytest
from ezdxf.document import Drawing as Document
from ezdxf.units import MM as UNIT_MM

from chladni.host.manufacture.drawing import LAYERS, Circle, Line, Text, board_drawing
from chladni.host.manufacture.drawing_files import save_drawing, svg_text
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.foundation import CutOut, Foundation, Strips
from chladni.sim.board.parts import Hole, Mass, Pin, Screw, Spring
from conftest import ROOT, CommandLine

SVG = "{http://www.w3.org/2000/svg}"
BOARDS = ("strip5", "pad16", "phone15", "prototype", "everything")
Circles = set[tuple[str, float, float, float]]


def board_to_draw(name: str) -> Board:
    """A shipped board, or one that has everything there is."""
    if name != "everything":
        return load_board(name)
    strip = load_board("strip5")
    return replace(
        strip,
        name=name,
        plate=replace(strip.plate, size=(40e-3, 60e-3), corner_radius=4e-3, material="FR4 (1/1)"),
        screws=(Screw((15e-3, 25e-3), 1.5e-3), Screw((-15e-3, -25e-3), 1.6e-3, "pinned")),
        holes=(Hole((-15e-3, 10.25e-3), 2e-3),),
        masses=(Mass((15e-3, 0.0), 1e-3, 3.5e-3, 2e-3), Mass((14e-3, -10e-3), 1e-3)),
        pins=(Pin((-15e-3, 0.0)),),
        foundation=Foundation(
            stiffness=3e7,
            coil_cut_out=3.5e-3,
            strips=Strips(left=12e-3, top=5e-3),
            cut_outs=(CutOut((-13e-3, 22e-3), 2e-3),),
        ),
    )


def expected_circles(board: Board) -> Circles:
    """Layer, middle and radius of everything round, mm, from the board itself."""
    found = [("screws", own.at, own.radius) for own in board.screws]
    found += [("holes", own.at, own.radius) for own in board.holes]
    found += [("masses", own.at, own.radius) for own in board.masses if own.radius]
    own = board.foundation
    if own:
        found += [("foam", cut.at, cut.radius) for cut in own.cut_outs]
    for actuator in board.actuators:
        if board.magnet:
            found.append(("magnets", actuator.at, board.magnet.radius))
        # Of the board that has everything only the topmost magnet reaches a strip.
        if own and own.coil_cut_out and (own.strips.is_none or actuator.at[1] > 23e-3):
            # A magnet of 6 mm goes through a hole of 6.5.
            magnet = board.magnet.radius + 0.25e-3 if board.magnet else 0.0
            found.append(("foam", actuator.at, max(own.coil_cut_out, magnet)))
        if board.winding:
            found.append(("coils", actuator.at, board.winding.inner / 2.0))
            found.append(("coils", actuator.at, board.winding.outer / 2.0))
    return {circle(layer, *(value * 1e3 for value in (*at, radius))) for layer, at, radius in found}


def circle(layer: object, x: float, y: float, radius: float) -> tuple[str, float, float, float]:
    """As files are compared: to a nanometre, and no zero below zero."""
    return str(layer), round(x, 6) + 0.0, round(y, 6) + 0.0, round(radius, 6)


def dxf(board: Board, folder: Path) -> Document:
    save_drawing(board_drawing(board), folder / "b.dxf")
    return ezdxf.readfile(folder / "b.dxf")  # type: ignore[attr-defined]


def svg(board: Board, folder: Path) -> ElementTree.Element:
    save_drawing(board_drawing(board), folder / "b.svg")
    return ElementTree.parse(folder / "b.svg").getroot()


@pytest.mark.parametrize("name", BOARDS)
def test_every_circle_of_a_dxf_is_the_board_file_s(name: str, tmp_path: Path) -> None:
    board = board_to_draw(name)
    document = dxf(board, tmp_path)
    circles = {
        circle(own.dxf.layer, own.dxf.center.x, own.dxf.center.y, own.dxf.radius)
        for own in document.modelspace().query("CIRCLE")
    }
    assert circles == expected_circles(board)
    assert document.units == UNIT_MM
    assert set(LAYERS) <= {layer.dxf.name for layer in document.layers}
    assert not document.audit().errors


@pytest.mark.parametrize("name", BOARDS)
def test_an_svg_has_the_same_circles_at_one_to_one(name: str, tmp_path: Path) -> None:
    """A unit of the view box is a millimetre of the page; y goes down."""
    board = board_to_draw(name)
    root = svg(board, tmp_path)
    circles = {
        circle(group.get("id"), x, -y, radius)
        for group in root.iter(f"{SVG}g")
        for own in group.iter(f"{SVG}circle")
        for x, y, radius in [[float(own.get(key, "")) for key in ("cx", "cy", "r")]]
    }
    assert circles == expected_circles(board)
    x, y, width, height = map(float, root.get("viewBox", "").split())
    assert (root.get("width"), root.get("height")) == (f"{width:g}mm", f"{height:g}mm")
    for text in root.iter(f"{SVG}text"):
        assert x < float(text.get("x", "")) < x + width
        assert y < float(text.get("y", "")) < y + height


def test_a_drawing_is_the_same_bytes_in_every_run(tmp_path: Path) -> None:
    """Whatever the time is, and whatever order Python's sets have."""
    script = (
        "import sys; from pathlib import Path; from chladni.sim.board.file import load_board; "
        "from chladni.host.manufacture.drawing import board_drawing; "
        "from chladni.host.manufacture.drawing_files import save_drawing; "
        "save_drawing(board_drawing(load_board('strip5')), Path(sys.argv[1]))"
    )
    files = [tmp_path / f"{seed}.dxf" for seed in range(1, 4)]
    for seed, file in enumerate(files, 1):
        subprocess.run(
            [sys.executable, "-c", script, str(file)],
            env={**os.environ, "PYTHONHASHSEED": str(seed)},
            check=True,
        )
    assert len({file.read_bytes() for file in files}) == 1


def test_an_outline_has_round_corners_and_foam_its_strips(tmp_path: Path) -> None:
    """The area of a polyline with arcs: ab − (4 − π) r²; strips are 12 and 5 mm wide."""
    board = board_to_draw("everything")
    space = dxf(board, tmp_path).modelspace()
    (outline,) = space.query('LWPOLYLINE[layer=="plate"]')
    points = outline.get_points("xyb")  # type: ignore[attr-defined]
    assert outline.closed  # type: ignore[attr-defined]
    area = 0.0
    for (x0, y0, bulge), (x1, y1, _) in zip(points, [*points[1:], points[0]], strict=True):
        area += (x0 * y1 - x1 * y0) / 2.0
        angle, chord = 4.0 * math.atan(bulge), math.hypot(x1 - x0, y1 - y0)
        if bulge:
            radius = chord / 2.0 / math.sin(angle / 2.0)
            assert radius == pytest.approx(4.0)
            area += radius**2 * (angle - math.sin(angle)) / 2.0
    assert area == pytest.approx(40.0 * 60.0 - (4.0 - math.pi) * 16.0)
    sides = [
        (max(xs) - min(xs), max(ys) - min(ys))
        for own in space.query('LWPOLYLINE[layer=="foam"]')
        for xs, ys in [zip(*own.get_points("xy"), strict=True)]  # type: ignore[attr-defined]
    ]
    assert sorted(sides) == [pytest.approx((12.0, 60.0)), pytest.approx((28.0, 5.0))]


def test_a_sheet_says_name_material_thickness_sizes_and_holes(tmp_path: Path) -> None:
    texts = [
        "".join(own.itertext())
        for own in svg(board_to_draw("everything"), tmp_path).iter(f"{SVG}text")
    ]
    for expected in (
        "everything",
        "plate: FR4 (1/1), 0.2 thick, corners R4",
        "40",
        "60",
        "24",
        "-24",
        "magnets: 5 of ⌀6 × 4",
        "coils: 5 of ⌀3 to ⌀10 × 1.5, 1 from the magnet",
        "hole 3 (plate, hole):  x -15  y 10.25  ⌀4",
        "hole 4 (foam):  x -13  y 22  ⌀4",
    ):
        assert expected in texts
    rows = [text for text in texts if text.startswith(("hole 5", "hole 6"))]
    assert rows == ["hole 5 (foam):  x 0  y 24  ⌀7"]
    assert len([text for text in texts if "⌀3.2" in text]) == 1


def test_the_page_about_parts_shows_the_board_that_ships() -> None:
    """If not: `chladni board drawing strip5 -o docs/images/strip5.svg`."""
    shown = (ROOT / "docs" / "images" / "strip5.svg").read_text(encoding="utf-8")
    assert shown == svg_text(board_drawing(load_board("strip5")))


def test_numbers_of_rows_that_lie_close_are_legible() -> None:
    """Rows 1.3 mm apart had their numbers one over the other."""
    board = load_board("pad16")
    first, *others = board.actuators
    moved = replace(first, at=(first.at[0], first.at[1] - 1.25888e-3))
    drawing = board_drawing(replace(board, actuators=(moved, *others)))
    rows = [one for one in drawing.shapes if isinstance(one, Text) and one.layer == "dimensions"]
    low, close, third, *_ = [one for one in rows if one.at[0] > 25.0]
    assert (low.text, close.text, third.text) == ("-17.76", "-16.5", "-5.5")
    assert low.at[0] == close.at[0] == third.at[0]
    assert close.at[1] - low.at[1] == pytest.approx(3.6)
    # Both gave way by as much, and a line leads from the row to each; the third stays.
    assert low.at[1] + close.at[1] == pytest.approx(-17.75888 - 16.5 - 2.0 * 0.8)
    assert third.at[1] == pytest.approx(-5.5 - 0.8)
    ends = [own.end for own in drawing.shapes if isinstance(own, Line)]
    assert pytest.approx((low.at[0] - 0.6, low.at[1] + 0.8)) in ends


def test_numbers_of_columns_that_lie_close_are_legible() -> None:
    """A pad of nine coils with columns 1 mm apart, as a search finds them."""
    board = load_board("quiet16")
    drawing = board_drawing(board)
    texts = [one for one in drawing.shapes if isinstance(one, Text) and one.layer == "dimensions"]
    above = sorted((one.at for one in texts if one.at[1] > 25.0), key=lambda at: (at[1], at[0]))
    assert len(above) == 8
    for (x, y), (right, level) in itertools.pairwise(above):
        assert level > y + 2.0 or right - x > 5 * 1.7


@pytest.mark.parametrize("ending", ["svg", "dxf"])
def test_the_command_draws_what_the_name_says(
    chladni: CommandLine, tmp_path: Path, ending: str
) -> None:
    out = tmp_path / f"pad.{ending}"
    done = chladni("board", "drawing", "pad16", "-o", out, "--json")
    assert done.code == 0
    assert done.json["path"] == str(out)
    assert done.json["holes"][5] == {"part": "foam", "at_mm": [-5.5, -5.5], "diameter_mm": 6.5}
    assert len(done.json["holes"]) == 16
    assert "ground plate: holes wider than ⌀10, 4.5 deep" in done.json["notes"]
    assert out.stat().st_size > 5000


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("b.pdf", "a name that ends in"),
        ("b", "a name that ends in"),
        ("missing/b.svg", "a file in a folder that exists"),
        ("folder.svg", "a file name"),
    ],
)
def test_a_drawing_that_cannot_be_is_refused(
    chladni: CommandLine, tmp_path: Path, name: str, expected: str
) -> None:
    (tmp_path / "folder.svg").mkdir()
    before = sorted(tmp_path.rglob("*"))
    done = chladni("board", "drawing", "strip5", "-o", tmp_path / name, "--json")
    assert done.code == 2
    assert done.out == ""
    assert f"-o: expected {expected}" in done.err
    assert sorted(tmp_path.rglob("*")) == before


def test_a_sheet_lists_the_feet_and_has_their_outlines(tmp_path: Path) -> None:
    strip = load_board("strip5")
    feet = (Spring((5e-3, 27e-3), 2e4), Spring((4e-3, 5.5e-3), 2e4, part="rubber-foot-6x6"))
    stood = replace(strip, winding=None, springs=feet, pins=(Pin((-5e-3, -27e-3)),))
    texts = ["".join(own.itertext()) for own in svg(stood, tmp_path).iter(f"{SVG}text")]
    assert "foot, 20 N/mm:  x 5  y 27" in texts
    outlines = [own for own in board_drawing(stood).shapes if isinstance(own, Circle)]
    assert Circle("supports", (4.0, 5.5), 3.0) in outlines
    assert len([own for own in outlines if own.layer == "supports"]) == 1
    assert "foot, held:  x -5  y -27" in texts
    assert "4 coil-5" in texts  # as the wiring and the board file call it


def test_holes_in_foam_have_room_for_coils_that_reach_into_it(tmp_path: Path) -> None:
    """6 mm of foam, and coils from 5 mm below the plate on; where holes are wide none is said."""
    board = load_board("phone8")
    assert board.coils_in_foam == pytest.approx(1e-3)
    words = "its holes from below ⌀10, 1 deep, for the coils"
    texts = ["".join(own.itertext()) for own in svg(board, tmp_path).iter(f"{SVG}text")]
    assert words in texts
    # 6.5 mm of magnet, gap and winding.
    assert "ground plate: holes wider than ⌀10, 0.5 deep" in texts
    feet = (Spring((0.0, 0.06), 47e3, part="silicone-foot-8x3"), Spring((0.0, -0.06), 47e3))
    stood = replace(board, foundation=None, springs=feet)
    texts = ["".join(own.itertext()) for own in svg(stood, tmp_path).iter(f"{SVG}text")]
    assert "ground plate: holes wider than ⌀10, 3.5 deep" in texts
    assert board.foundation is not None
    wide = replace(board.foundation, coil_cut_out=5e-3)
    thin = replace(board.foundation, thickness=5e-3)
    for own in (wide, thin):
        assert replace(board, foundation=own).coils_in_foam <= 1e-12
