"""Feet and grommets of rubber: their own loss factor, and stiffness from hardness and size."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from at_points import respond_at
from chladni.drives.scoring.tolerances import drawn_boards
from chladni.sim.board.board import Board, to_document
from chladni.sim.board.catalogue import FEET, GROMMETS, SHEETS
from chladni.sim.board.file import board_from_document
from chladni.sim.board.parts import EdgeKind, Edges
from chladni.sim.errors import InputError
from chladni.sim.fields.board_plate import plate_geometry, plate_model
from chladni.sim.fields.static import static_fields
from chladni.sim.plate.geometry import FoundationLayer, PlateGeometry, PointFeature, RimSupport
from chladni.sim.plate.loads import Load
from chladni.sim.ritz.basis.parity import find_mirrors
from chladni.sim.ritz.plate import RitzPlate
from conftest import ROOT
from levy import levy_displacement

SS: EdgeKind = "simply supported"
SUPPORTED = Edges(SS, SS, SS, SS)
PLATE_LOSS, FOOT_LOSS = 0.02, 0.4


def supported_field(
    hz: float, load: tuple[float, float], places: list[tuple[float, float]]
) -> np.ndarray:
    """Of a bare supported plate of 1 × 1.5, by Lévy's series."""
    stiffness = 1.0 + 1j * PLATE_LOSS
    omega = 2.0 * np.pi * hz
    return levy_displacement((1.0, 1.5), stiffness, 1.0, omega, load, np.array(places), 1e-9)


@pytest.mark.parametrize("hz", [0.5, 5.0])
def test_a_damped_spring_adds_what_its_receptance_says(hz: float) -> None:
    """w(q) = g(q, p) − g(q, s) k′ g(s, p)/(1 + k′ g(s, s)) with k′ = k(1 + iη′), exactly."""
    load, spring, place, k = (-0.2, 0.3), (0.13, -0.21), (0.31, 0.05), 200.0
    at_load = supported_field(hz, load, [place, spring])
    at_spring = supported_field(hz, spring, [place, spring])
    own = k * (1.0 + 1j * FOOT_LOSS)
    expected = at_load[0] - at_spring[0] * own * at_load[1] / (1.0 + own * at_spring[1])
    foot = PointFeature(*spring, stiffness=k, loss_factor=FOOT_LOSS)
    geometry = PlateGeometry(1.0, 1.5, 1.0, 0.3, 1.0, points=(foot,), edges=SUPPORTED)
    found = respond_at(RitzPlate(geometry, PLATE_LOSS), [Load(*load)], hz, [place], tolerance=1e-5)
    assert found[0, 0] == pytest.approx(expected, rel=2e-5)
    shared = dataclasses.replace(geometry, points=(dataclasses.replace(foot, loss_factor=None),))
    other = respond_at(RitzPlate(shared, PLATE_LOSS), [Load(*load)], hz, [place], tolerance=1e-5)
    assert abs(other[0, 0] / expected - 1.0) > 1e-2


@pytest.mark.parametrize("on_rims", [False, True])
def test_a_rigid_plate_on_feet_and_foam_is_a_mass_on_springs(on_rims: bool) -> None:
    """F/(Σ k(1 + iη) − ω² m), each with a loss factor of its own, the foam too."""
    k, foam, area, hz = 2e4, 1e6, 0.1 * 0.12, 140.0
    # Alike across the middle, so that nothing tilts.
    places = {(x, y): 0.2 if x * y > 0.0 else 0.5 for x in (-0.03, 0.03) for y in (-0.04, 0.04)}
    geometry = PlateGeometry(0.1, 0.12, 1e5, 0.2, 2.0, foundation=FoundationLayer(foam, 0.3))
    if on_rims:
        rims = [
            RimSupport(*at, 2e-3, False, False, k, loss_factor=own) for at, own in places.items()
        ]
        geometry = dataclasses.replace(geometry, rims=tuple(rims))
    else:
        feet = [PointFeature(*at, stiffness=k, loss_factor=own) for at, own in places.items()]
        geometry = dataclasses.replace(geometry, points=tuple(feet))
    plate = RitzPlate(geometry, 0.0)
    found = respond_at(plate, [Load(0.0, 0.0)], hz, [(0.03, 0.04)], tolerance=1e-5)
    stiffness = 2.0 * k * (2.0 + 0.2j + 0.5j) + foam * area * (1.0 + 0.3j)
    expected = 1.0 / (stiffness - (2.0 * np.pi * hz) ** 2 * 2.0 * area)
    assert found[0, 0] == pytest.approx(expected, rel=2e-3)


def test_feet_that_lose_unlike_parts_are_no_mirror_images() -> None:
    feet = tuple(PointFeature(x, 0.0, stiffness=1e3, loss_factor=x + 1.0) for x in (-0.1, 0.1))
    geometry = PlateGeometry(1.0, 1.5, 1.0, 0.3, 1.0, points=feet)
    assert not find_mirrors(geometry).x
    alike = tuple(dataclasses.replace(foot, loss_factor=0.1) for foot in feet)
    assert find_mirrors(dataclasses.replace(geometry, points=alike)).x


@pytest.mark.parametrize(
    ("name", "newtons_per_mm"),
    # By hand: E = 1.142, 2.456 and 1.692 MPa, S = 0.667, 0.5 and 0.25, times 1.3.
    [("silicone-foot-8x3", 47.0), ("rubber-foot-10x5", 75.2), ("rubber-foot-6x6", 11.64)],
)
def test_a_foot_is_as_stiff_as_gent_says(name: str, newtons_per_mm: float) -> None:
    assert FEET[name].stiffness == pytest.approx(newtons_per_mm, rel=2e-3)


@pytest.mark.parametrize(("shore_a", "mpa"), [(30.0, 0.92), (40.0, 1.5), (50.0, 2.2), (60.0, 4.45)])
def test_the_modulus_is_near_what_was_measured(shore_a: float, mpa: float) -> None:
    """P. B. Lindley, Engineering Design with Natural Rubber (1964), to the spread of compounds."""
    part = dataclasses.replace(FEET["rubber-foot-10x5"], shore_a=shore_a)
    assert part.modulus == pytest.approx(mpa, rel=0.25)


def test_the_page_has_every_sheet() -> None:
    text = (ROOT / "docs" / "parts.md").read_text("utf-8")
    for name, numbers in SHEETS.items():
        row = next(line for line in text.splitlines() if line.startswith(f"| {name} "))
        cells = [float(cell) for cell in row.split("|")[2:-1]]
        assert cells == list(numbers.values()), name


def test_the_page_has_every_part() -> None:
    text = (ROOT / "docs" / "parts.md").read_text("utf-8")
    for name, part in {**FEET, **GROMMETS}.items():
        row = next(line for line in text.splitlines() if line.startswith(f"| {name} "))
        cells = [cell.strip() for cell in row.split("|")[2:-1]]
        assert float(cells[0]) == part.shore_a
        assert cells[1].endswith(f"⌀{part.outer:g} × {part.height:g}")
        assert float(cells[2]) == pytest.approx(part.stiffness, abs=0.05)
        assert float(cells[3]) == part.loss_factor


def document(board: Board, **parts: Any) -> dict[str, Any]:
    return {**to_document(board), **parts}


def test_a_board_file_names_feet_and_grommets(prototype: Board) -> None:
    foot = {"at_mm": [10.0, 10.0], "part": "silicone-foot-8x3"}
    screw = {"at_mm": [-20.0, 30.0], "part": "silicone-grommet-m3"}
    named = board_from_document(document(prototype, springs=[foot], screws=[screw]))
    assert named.springs[0].stiffness == pytest.approx(47.0e3, rel=1e-3)
    assert (named.springs[0].loss_factor, named.screws[0].loss_factor) == (0.1, 0.1)
    assert named.screws[0].support == "sprung"
    assert named.screws[0].stiffness == pytest.approx(
        1e3 * GROMMETS["silicone-grommet-m3"].stiffness, rel=1e-3
    )
    again = board_from_document(to_document(named))
    assert plate_geometry(again) == plate_geometry(named)
    plain = {
        "at_mm": [10.0, 10.0],
        "stiffness_n_per_mm": named.springs[0].stiffness * 1e-3,
        "loss_factor": 0.1,
    }
    unnamed = board_from_document(document(named, springs=[plain]))
    assert unnamed.fingerprint() == named.fingerprint()
    softer = board_from_document(document(named, springs=[plain | {"loss_factor": 0.2}]))
    assert softer.fingerprint() != named.fingerprint()


def test_a_foot_that_was_measured_keeps_its_name(prototype: Board) -> None:
    """Calibration finds feet half to twice as stiff as their makers say."""
    foot = {"at_mm": [10.0, 10.0], "part": "silicone-foot-8x3", "stiffness_n_per_mm": 90.0}
    with pytest.raises(InputError, match=r"quarter.*; leave out its stiffness and loss_factor"):
        board_from_document(document(prototype, springs=[foot]))
    origin = {"by": "its own coils", "date": "2026-11-27"}
    measured = board_from_document(document(prototype, springs=[foot], measured=origin))
    assert measured.springs[0].stiffness == pytest.approx(90.0e3)
    assert board_from_document(to_document(measured)) == measured


def test_what_a_foot_loses_does_not_count_at_rest(prototype: Board) -> None:
    feet = [
        {"at_mm": at, "stiffness_n_per_mm": 20.0}
        for at in ([10.0, 10.0], [-30.0, 0.0], [0.0, -70.0])
    ]
    bare = {
        key: own for key, own in to_document(prototype).items() if key not in ("screws", "magnet")
    }
    boards = [
        board_from_document(
            bare | {"springs": [foot | more for foot in feet]} | {"image": {"points": [15, 31]}}
        )
        for more in ({}, {"loss_factor": 0.5})
    ]
    ends = [static_fields(board, plate_model(board)) for board in boards]
    assert ends[0] is not None
    assert ends[1] == pytest.approx(ends[0], rel=1e-5, abs=1e-9 * np.abs(ends[0]).max())


@pytest.mark.parametrize(
    ("key", "entry", "message"),
    [
        ("springs", {"at_mm": [0.0, 0.0], "part": "rubber-foot"}, r"springs\[0\].part"),
        ("springs", {"at_mm": [0.0, 0.0], "part": 3}, r"springs\[0\].part"),
        (
            "springs",
            {"at_mm": [0.0, 0.0], "part": "rubber-foot-6x6", "stiffness_n_per_mm": 20.0},
            r"springs\[0\].stiffness_n_per_mm: expected within a quarter of 11.6",
        ),
        (
            "springs",
            {"at_mm": [0.0, 0.0], "part": "rubber-grommet-m3"},
            r"springs\[0\].part: .*; this one goes into \[\[screws\]\]",
        ),
        ("screws", {"at_mm": [0.0, 0.0], "loss_factor": 0.1}, r"screws\[0\].loss_factor"),
        ("screws", {"at_mm": [0.0, 0.0], "part": "silicone-foot-8x3"}, r"screws\[0\].part"),
    ],
)
def test_what_is_no_rubber_part_is_refused_by_its_key(
    prototype: Board, key: str, entry: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        board_from_document(document(prototype, **{key: [entry]}))


@pytest.mark.parametrize(
    ("apart_mm", "message"),
    [
        (9.9, "clear of the magnet of 'centre', .*; their middles are 9.9 mm apart and need 10"),
        (10.1, ""),
    ],
)
def test_a_foot_stands_clear_of_magnets(prototype: Board, apart_mm: float, message: str) -> None:
    (centre,) = (own for own in prototype.actuators if own.name == "centre")
    assert prototype.magnet is not None
    assert prototype.magnet.radius == pytest.approx(5e-3)
    at = [centre.at[0] * 1e3 + apart_mm, centre.at[1] * 1e3]
    feet = [{"at_mm": at, "part": "rubber-foot-10x5"}]
    if not message:
        assert board_from_document(document(prototype, springs=feet)).springs
        return
    with pytest.raises(InputError, match=message):
        board_from_document(document(prototype, springs=feet))


def test_a_foot_stands_clear_of_windings(prototype: Board) -> None:
    """They stand on the ground that it reaches, and are wider than magnets."""
    (centre,) = (own for own in prototype.actuators if own.name == "centre")
    own = document(prototype)
    own |= {"magnet": {**own["magnet"], "radius_mm": 3.0, "height_mm": 4.0}}
    own |= {"winding": {"turns": 300, "wire_mm": 0.1, "inner_mm": 3.0, "outer_mm": 12.0}}
    own["winding"] |= {"height_mm": 1.5, "gap_mm": 1.0}
    own.pop("coil", None)
    for apart_mm in (10.9, 11.1):
        at = [centre.at[0] * 1e3 + apart_mm, centre.at[1] * 1e3]
        own["springs"] = [{"at_mm": at, "part": "rubber-foot-10x5"}]
        if apart_mm > 11.0:
            assert board_from_document(own).springs
            continue
        with pytest.raises(InputError, match=r"clear of the winding of 'centre', .* and need 11"):
            board_from_document(own)


def test_feet_are_under_the_plate_as_a_whole(prototype: Board) -> None:
    half_mm = prototype.plate.size[0] / 2.0 * 1e3
    feet = [{"at_mm": [half_mm - 4.9, 20.0], "part": "rubber-foot-10x5"}]
    with pytest.raises(
        InputError, match=f"the whole foot is under the plate: .x. up to {half_mm - 5.0:g},"
    ):
        board_from_document(document(prototype, springs=feet))
    feet[0]["at_mm"] = [half_mm - 5.0, 20.0]
    assert board_from_document(document(prototype, springs=feet)).springs


def test_a_foot_in_a_round_corner_is_refused(prototype: Board) -> None:
    """5 mm from both sides of a corner of 8 mm it sticks out by 1.2 mm."""
    own = document(prototype, springs=[{"at_mm": [30.75, 68.35], "part": "rubber-foot-10x5"}])
    assert board_from_document(own).springs
    own["plate"]["corner_radius_mm"] = 8.0
    with pytest.raises(InputError, match="the plate's corners are round, by 8 mm"):
        board_from_document(own)


def test_feet_stand_clear_of_each_other(prototype: Board) -> None:
    feet = [{"at_mm": [x, 20.0], "part": "rubber-foot-10x5"} for x in (-15.0, -5.1)]
    with pytest.raises(InputError, match=r"springs\[1\].at_mm: .*clear of springs\[0\]"):
        board_from_document(document(prototype, springs=feet))
    feet[1]["at_mm"] = [-4.9, 20.0]
    assert len(board_from_document(document(prototype, springs=feet)).springs) == 2


def test_every_wrong_part_is_named(prototype: Board) -> None:
    feet = [{"at_mm": [x, 0.0], "part": "rubber"} for x in (-10.0, 10.0)]
    with pytest.raises(InputError, match=r"(?s)springs\[0\]\.part.*springs\[1\]\.part"):
        board_from_document(document(prototype, springs=feet))


def test_feet_are_off_within_tolerances(prototype: Board) -> None:
    """Each by itself, by up to a quarter; boards without any are drawn as before."""
    feet = [{"at_mm": [x, 0.0], "part": "rubber-foot-10x5"} for x in (-20.0, 20.0)]
    board = board_from_document(document(prototype, springs=feet))
    drawn = [own.board for own in drawn_boards(board, 20, 1)]
    ratios = np.array([[foot.stiffness / 75.2e3 for foot in own.springs] for own in drawn])
    assert np.abs(ratios - 1.0).max() <= 0.25
    assert ratios.std() > 0.1
    assert np.all(ratios[:, 0] != ratios[:, 1])
    plain = [own.board.plate for own in drawn_boards(prototype, 2, 1)]
    assert plain[0] == drawn[0].plate
