"""The parts list of a board: counts, sizes, and masses that the plate's model has too."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

from chladni.host.manufacture.board_parts import (
    board_parts,
    foam_of,
    mechanical_parts,
    moving_mass_g,
)
from chladni.host.manufacture.wiring.parts import parts_list
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Panel
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Hole, Mass, Spring
from chladni.sim.fields.board_plate import plate_geometry
from chladni.sim.plate.mirrors import Mirrors
from chladni.sim.ritz.basis.parity import ParityBasis, parity_classes
from chladni.sim.ritz.basis.resolution import Resolution
from chladni.sim.ritz.solver import Solver
from conftest import CommandLine

FOOT = "rubber-foot-6x6"


def with_more(board: Board) -> Board:
    """On it a hole, a disc, a mass at a point, and round corners."""
    return replace(
        board,
        plate=replace(board.plate, corner_radius=6e-3),
        holes=(Hole((0.0, 20e-3), 2.5e-3),),
        masses=(Mass((0.0, -20e-3), 1.5e-3, 4e-3, 2e-3), Mass((10e-3, 0.0), 0.25e-3)),
    )


@pytest.mark.parametrize("name", ["strip5", "with more"])
def test_what_moves_weighs_what_the_plate_s_model_has(name: str) -> None:
    """A plate that goes up as a whole: the kinetic energy form of its constant polynomial.

    That polynomial is 1 over the root of the plate's area. Round corners are integrated to 1e-4.
    """
    board = load_board("phone15" if name == "with more" else name)
    if name == "with more":
        board = with_more(board)
    geometry = plate_geometry(board)
    solver = Solver(geometry, Mirrors(False, False), Resolution(6, 6, 2, 3, 2))
    (parity,) = [ParityBasis(solver.basis, own) for own in parity_classes(solver.mirrors)]
    form = solver.assembly.mass(parity, solver.assembly.overlap(parity))
    mass = form[0, 0] * geometry.width * geometry.length
    assert moving_mass_g(board) == pytest.approx(mass * 1e3, rel=1e-4)


def test_counts_and_sizes_are_the_board_file_s() -> None:
    parts = {part.part: part for part in board_parts(load_board("pad16"))}
    assert parts["plate"].value == "FR4, 50 × 50 × 0.2 mm"
    assert parts["plate"].mass_g == pytest.approx(0.95)
    assert (parts["magnet"].count, parts["magnet"].value) == (16, "NdFeB N42 disc ⌀6 × 4 mm")
    assert parts["magnet"].mass_g == pytest.approx(7.5e-3 * math.pi * 9.0 * 4.0)
    # 4 mm of magnet, 1 of gap and 1.5 of winding, on 2 of foam.
    under = "; coils reach 4.5 mm into the ground plate"
    assert parts["foam"].value == f"soft-pu-foam, 50 × 50 × 2 mm{under}"
    ground = "rigid, 50 × 50 mm or more; 16 holes wider than ⌀10, 4.5 mm deep"
    assert parts["ground plate"].value == ground
    foundation = load_board("pad16").foundation
    assert foundation
    assert foam_of(foundation) == "soft-pu-foam, 2 mm"
    assert parts["foam"].mass_g == pytest.approx(0.24e-3 * 2.0 * (2500.0 - 16.0 * math.pi * 9.0))
    assert parts["coil"].count == 16
    assert parts["coil"].value == "13.1 Ω, 300 turns of 0.1 mm copper, ⌀3 to ⌀10 × 1.5 mm"
    # 6.13 m of wire of 0.00785 mm².
    assert parts["coil"].mass_g == pytest.approx(8.96 * 6.126 * 0.00785398, rel=1e-3)


def test_a_ground_plate_reaches_beyond_the_holes_of_coils_at_an_edge() -> None:
    """A coil 3 mm from the edge has a hole of 5 mm radius, beside which something must be left."""
    board = load_board("pad16")
    first, *others = board.actuators
    board = replace(board, actuators=(replace(first, at=(-22e-3, first.at[1])), *others))
    ground = next(part for part in board_parts(board) if part.part == "ground plate")
    told = re.match(r"rigid, ([\d.]+) × 50 mm or more", ground.value)
    assert told
    assert float(told[1]) > 2.0 * (22.0 + 5.0)


def test_a_film_and_feet_are_listed_with_their_sizes(prototype: Board) -> None:
    """The film's mass is that which the plate's model has of it."""
    panel = prototype.panel or Panel((16, 16), prototype.plate.size)
    board = replace(
        prototype,
        panel=replace(panel, place="on", film=0.125e-3),
        screws=(),
        springs=(Spring((0.0, 0.06), 13e3, part=FOOT),),
    )
    parts = {part.part: part for part in mechanical_parts(board)}
    layer, foot = parts["panel's layer"], parts["foot"]
    assert layer.value == "pet, 71.5 × 146.7 × 0.125 mm"
    more = board.section.areal_mass - board.plate.areal_mass
    assert layer.mass_g == pytest.approx(1e3 * more * 71.5e-3 * 146.7e-3, rel=0.01)
    assert foot.value == "rubber-foot-6x6: ⌀6 × 6 mm, 40 Shore A"


@pytest.mark.parametrize("metal", [True, False])
def test_a_sheet_of_metal_is_earthed_under_a_panel(prototype: Board, *, metal: bool) -> None:
    material = "aluminium" if metal else "FR4"
    board = replace(prototype, plate=replace(prototype.plate, material=material))
    assert board.panel is not None
    names = [part.part for part in parts_list(board)]
    assert names.count("earth wire") == metal


def test_supports_of_no_known_height_are_listed_with_what_coils_need() -> None:
    """4 mm of magnet, 1 of gap and 1.5 of winding."""
    feet = [Spring((0.0, along), 13e3, part=part) for along, part in ((0.06, ""), (-0.06, FOOT))]
    board = replace(load_board("phone5"), foundation=None, springs=tuple(feet))
    values = [part.value for part in mechanical_parts(board) if part.part == "foot"]
    needed = "; coils need 6.5 mm under the plate"
    foot = "rubber-foot-6x6: ⌀6 × 6 mm, 40 Shore A; coils reach 0.5 mm into the ground plate"
    assert values == ["rubber or a spring" + needed, foot]


def test_a_coil_that_no_file_states_is_said_to_be_assumed(prototype: Board) -> None:
    board = replace(prototype, coil=None, winding=None)
    for own, begin in ((prototype, "the board file's"), (board, "assumed: the board file has no")):
        (coil,) = (part for part in parts_list(own) if part.part == "coil")
        assert coil.why.startswith(begin)


def test_electrical_parts_are_those_of_the_wiring(prototype: Board) -> None:
    """And screws of one kind are one line."""
    found = board_parts(prototype)
    assert found[-len(parts_list(prototype)) :] == parts_list(prototype)
    screws = [part for part in mechanical_parts(prototype) if part.part == "screw"]
    assert [(own.count, own.value, own.why) for own in screws] == [(6, "⌀3 mm", "clamped")]
    magnets = next(part for part in found if part.part == "magnet")
    assert magnets.value == "disc ⌀10 × 4 mm"


@pytest.mark.parametrize(("remanence", "grade"), [(1.17, "N35"), (1.2, "N38"), (1.43, "N52")])
def test_a_magnet_s_grade_is_the_weakest_that_does(remanence: float, grade: str) -> None:
    board = load_board("strip5")
    assert board.magnet is not None
    own = replace(board, winding=None, magnet=replace(board.magnet, remanence=remanence))
    (magnet,) = (part for part in mechanical_parts(own) if part.part == "magnet")
    assert magnet.value == f"NdFeB {grade} disc ⌀6 × 4 mm"


def test_the_command_lists_parts_for_programs_and_people(chladni: CommandLine) -> None:
    done = chladni("board", "parts", "strip5", "--json")
    assert done.code == 0
    assert done.json["moving_mass_g"] == pytest.approx(0.3192 + 5.0 * 0.8482, rel=1e-3)
    assert set(done.json["parts"][0]) == {
        "part",
        "count",
        "value",
        "why",
        "mass_g",
        "price_usd",
        "sold_by",
    }
    assert {"plate", "magnet", "foam", "coil", "full bridge, PH/EN"} <= {
        part["part"] for part in done.json["parts"]
    }
    plain = chladni("board", "parts", "strip5")
    assert "soft-pu-foam" in plain.out
    assert chladni("board", "parts", "nowhere").code == 2
