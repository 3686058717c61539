"""Layouts under mirrors, and fields of candidates against a plate that is solved with them."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from chladni.design.evaluate import beyond, completed_board, document_of, evaluate
from chladni.design.layouts.exchange import best_layouts
from chladni.design.layouts.layouts import (
    Layout,
    Orbit,
    candidates,
    closest,
    lattices,
    makeups,
    spread_out,
)
from chladni.design.layouts.plain_plate import PlainPlate
from chladni.design.layouts.ratings import ANYWHERE, OFF, ApartRating, FocusRating
from chladni.design.pins import with_pins
from chladni.design.spec import read_spec, spec_of
from chladni.design.starts import chosen, document_at, layouts_of, point_of, spread_numbers
from chladni.design.variables import Choice, never_tried, variables_of
from chladni.drives.methods import SEED
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Image, Mass
from chladni.sim.errors import InputError
from chladni.sim.fields.transfer import transfer_fields
from conftest import ROOT
from made_specs import small


def board_with(places: list[tuple[float, float]]) -> Board:
    return completed_board(document_of(spec_of(small(design={"coils": len(places)})), [], places))


def test_a_layout_is_symmetric_and_comes_back_from_its_shares() -> None:
    layout = Layout(
        (True, True), (Orbit((False, False)), Orbit((False, True)), Orbit((True, True)))
    )
    assert layout.coils == 1 + 2 + 4
    assert layout.unknowns == 3
    places = layout.places([0.25, 0.5, 0.75], (8.0, 20.0))
    assert len(places) == layout.coils
    assert {(-x, y) for x, y in places} == {(x, -y) for x, y in places} == set(places)
    assert layout.shares([(0.0, 0.0), (0.0, 5.0), (-4.0, 15.0)], (8.0, 20.0)) == [0.25, 0.5, 0.75]


def test_without_mirrors_each_coil_goes_where_it_likes() -> None:
    layout = Layout((False, False), (Orbit((True, True)),) * 2)
    assert layout.places([0.0, 0.5, 1.0, 0.25], (8.0, 20.0)) == [(8.0, -10.0), (-8.0, 0.0)]


def test_makeups_are_all_there_are() -> None:
    found = list(makeups(5, Counter({4: 9, 2: 9, 1: 1})))
    # 4 + 1, and 2 + 2 + 1; two in the middle there cannot be.
    assert sorted(found) == [(1, 2, 2), (1, 4)]


@pytest.mark.parametrize("mirrors", [(True, True), (False, True), (False, False)])
def test_rows_and_columns_are_even_apart_enough_and_all_there(mirrors: tuple[bool, bool]) -> None:
    found = [
        sorted(place for one in own for place in one.images)
        for own in lattices(6, mirrors, (7e-3, 27e-3), 10e-3)
    ]
    # 14 × 54 mm: six in a row fit, two rows of three, and no three rows; at four spacings each.
    shapes = Counter((len({x for x, _ in own}), len({y for _, y in own})) for own in found)
    assert shapes == {(1, 6): 4, (2, 3): 16}
    for own in found:
        assert len(own) == 6
        assert closest(own) >= 10e-3 - 1e-9
        assert np.allclose(np.mean(own, axis=0), 0.0)
        assert max(x for x, _ in own) <= 7e-3 + 1e-9
        assert max(y for _, y in own) <= 27e-3 + 1e-9


def test_coils_are_spread_over_equal_cells() -> None:
    """Of five: a row each way, and every other cell of three by three, where that fits."""
    size = (75e-3, 140e-3)
    found = [
        sorted(place for one in own for place in one.images)
        for own in spread_out(5, (True, True), size, 14e-3)
    ]
    quincunx = [(-25e-3, -140e-3 / 3), (-25e-3, 140e-3 / 3), (0.0, 0.0)]
    quincunx += [(25e-3, -140e-3 / 3), (25e-3, 140e-3 / 3)]
    assert len(found) == 3
    assert any(np.allclose(own, quincunx) for own in found)
    assert [(0.0, round(28e-3 * k, 9)) for k in range(-2, 3)] in found
    wide = list(spread_out(5, (True, True), size, 16e-3))
    assert len(wide) == 2  # 15 mm apart, five in a row across are too close
    # Seven: the seven between eight of three by five cells; without mirrors each is its own.
    assert sorted(len(own) for own in spread_out(7, (False, False), size, 10e-3)) == [7] * 4


def test_a_quincunx_is_among_the_layouts_that_a_search_begins_with() -> None:
    """On feet exchange has others that look better by its measure."""
    feet = [{"at_mm": [x, y], "part": "rubber-foot-6x6"} for x in (-30, 30) for y in (-62, 62)]
    plate = {"size_mm": [75.0, 140.0], "thickness_mm": 2.0, "material": "acrylic"}
    document = small(design={"coils": 5, "coil_spacing_mm": 14.0}, plate=plate, springs=feet)
    del document["foundation"]
    spec = spec_of(document)
    (numbers,) = spread_numbers(spec, 1)
    points = chosen(layouts_of(spec, (5, numbers))["layouts"])
    at = [{tuple(one["at_mm"]) for one in document_at(spec, own)["actuators"]} for own in points]
    assert {(0.0, 0.0), *((x, y) for x in (-25.0, 25.0) for y in (-46.6667, 46.6667))} in at
    # On a middle line alone coils would not tell its sides apart.
    assert all(any(own[axis] for own in one) for one in at for axis in (0, 1))


def test_coils_are_placed_clear_of_feet() -> None:
    """A foot of 6 mm and a winding of 10: 8 mm, where a magnet of 6 needs 6."""
    at = [(x, y) for x in (-7.0, 7.0) for y in (-14.0, 14.0)]
    feet = [{"at_mm": list(one), "part": "rubber-foot-6x6"} for one in at]
    winding = {"turns": 300, "wire_mm": 0.1, "inner_mm": 3.0, "outer_mm": 10.0, "height_mm": 1.5}
    document = small(
        design={"coils": 2},
        plate={"size_mm": [30.0, 50.0]},
        springs=feet,
        magnet={"radius_mm": 3.0, "height_mm": 4.0, "remanence_t": 1.28},
        winding=winding | {"gap_mm": 1.0},
    )
    spec = spec_of(document)
    (numbers,) = spread_numbers(spec, 1)
    points = [point_of(row) for row in layouts_of(spec, (2, numbers))["layouts"]]
    apart = [
        math.dist(coil["at_mm"], foot)
        for own in points
        for coil in document_at(spec, own)["actuators"]
        for foot in at
    ]
    assert min(apart) >= 8.0
    own = document_of(spec, numbers, [(0.0, 0.0), (7.0, 21.5)])
    assert list(beyond(spec, own)) == ["feet"]  # 7.5 mm: such a draw of the search is not taken


def test_candidates_keep_their_images_apart() -> None:
    offered = candidates((True, True), (8e-3, 20e-3), 2e-3, 7e-3)
    assert all(closest(one.images) >= 7e-3 for one in offered)
    assert {len(one.images) for one in offered} == {1, 2, 4}
    # (0, 2 mm) has its image 4 mm away.
    assert not any(one.at == (0.0, 2e-3) for one in offered)


def test_fields_of_candidates_are_those_of_a_plate_with_their_masses() -> None:
    """One plate without coils, and its receptance, against one solved with the masses on it."""
    places = [(0.0, -9.0), (2.0, 4.0), (-3.0, 12.0)]
    mass = 0.8e-3
    plain = board_with(places)
    metres = [(1e-3 * x, 1e-3 * y) for x, y in places]
    found = PlainPlate.of(plain, metres)
    omega = 2.0 * np.pi * plain.drive.frequency_hz
    found = replace(found, delta=-(omega**2) * mass + 0.0j)
    got = found.with_coils([0, 1, 2], found.fields)
    points = (7, 17)
    heavy = replace(plain, masses=tuple(Mass(at, mass) for at in metres), image=Image(points))
    wanted = transfer_fields(heavy).values.reshape(3, -1)
    without = transfer_fields(replace(plain, image=Image(points))).values.reshape(3, -1)
    error = np.linalg.norm(got - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    # Receptances are means over a disc of 2 mm, which is 3 % of what a point's own is.
    assert np.all(error < 0.02)
    change = np.linalg.norm(without - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    assert np.all(change > 0.1)


def test_a_layouts_figure_is_the_loudest_far_point_place_by_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With three places in two products, of which the middle one has no far point."""
    monkeypatch.setattr("chladni.design.layouts.ratings.TOGETHER", 2)
    rng = np.random.default_rng(1)
    fields = rng.normal(size=(3, 30)) + 1j * rng.normal(size=(3, 30))
    fingers, far = rng.random((3, 30)), (rng.random((3, 30)) < 0.5).astype(float)
    far[1] = 0.0
    levels = []
    for k in (0, 2):
        beside, mean = fields[:, far[k] > 0.0], fields @ fingers[k]
        form = beside.conj() @ beside.T
        drive = np.linalg.solve(form, mean.conj())
        ratio = abs(drive @ mean) / np.max(np.abs(drive @ beside))
        levels.append(20.0 * np.log10(ratio))
    line = np.zeros(1)
    plain = PlainPlate(line, line, fields, np.zeros((3, 3), complex), 0.0j)
    wanted = np.quantile(levels, 0.1) + 0.1 * np.median(levels)
    # What is added to the forms' diagonals, a millionth, moves a level by as much.
    found = FocusRating(plain, fingers, far).figure([0, 1, 2])
    assert found == pytest.approx(wanted, abs=1e-3)


def test_a_layout_for_several_is_rated_by_the_best_drives_that_there_are() -> None:
    """Against the largest eigenvalue of each pair's forms, and fields that are off at random."""
    rng = np.random.default_rng(2)
    under = rng.normal(size=(3, 8)) + 1j * rng.normal(size=(3, 8))
    plain = PlainPlate(np.zeros(1), np.zeros(1), under, np.zeros((3, 3), complex), 0.0j)
    levels, own_um, left = [], [], []
    for k in range(8):
        own, other = under[:, k], under[:, (k + 4) % 8]
        off = OFF**2 * (np.abs(other) ** 2 + ANYWHERE * np.mean(np.abs(under) ** 2))
        form = np.outer(other.conj(), other) + np.diag(off)
        values, drives = scipy.linalg.eigh(np.outer(own.conj(), own), form)
        drive = drives[:, -1]
        levels.append(10.0 * np.log10(values[-1]))
        own_um.append(20.0 * np.log10(abs(own @ drive) / np.abs(drive).max()))
        noise = rng.normal(size=(20_000, 3, 2)) @ [1.0, 1.0j] / np.sqrt(2.0)
        found = np.mean(np.abs((other + np.sqrt(off) * noise) @ drive) ** 2)
        left.append(found / (drive.conj() @ form @ drive).real)
    # 20 000 draws of a mean square of a complex number: 0.7 %.
    assert np.allclose(left, 1.0, atol=0.03)
    rating = ApartRating(plain, under, (2.0, 0.5, 0.0))
    wanted = 2.0 * np.quantile(levels, 0.1) + 0.5 * np.quantile(own_um, 0.1)
    assert rating.figure([0, 1, 2]) == pytest.approx(wanted, abs=1e-9)


def test_layouts_for_several_are_rated_as_their_boards_score() -> None:
    """On six soft feet, where the rating for one finger's focus told nothing."""
    spec = read_spec(ROOT / "boards" / "specs" / "feet5.toml")
    spec = replace(spec, weights={"fingers_2_db": 1.0, "fingers_um_db": 0.3})
    numbers = spread_numbers(spec, 1)[0]
    board = completed_board(document_of(spec, numbers, [(0.0, 0.0)]))
    wide, close = (
        [(0.0, 0.0), *((x, y) for x in (-a, a) for y in (-b, b))]
        for a, b in ((47.0, 24.0), (12.0, 12.0))
    )
    metres = [(1e-3 * x, 1e-3 * y) for x, y in (*wide, *close)]
    rating = ApartRating.of(board, PlainPlate.of(board, metres), (1.0, 0.3, 0.0))
    assert rating.figure(range(5)) > rating.figure(range(5, 10)) + 6.0
    best = point_of(layouts_of(spec, (5, numbers))["layouts"][0])
    first, second, third = (
        evaluate(spec, document, SEED).robust_score
        for document in (
            document_of(spec, numbers, wide),
            document_of(spec, numbers, close),
            document_at(spec, best),
        )
    )
    assert first > second + 6.0
    assert third > second + 3.0  # four random boards tell a score to some 2 dB


def test_exchange_finds_the_best_of_all_pairs() -> None:
    """Of two coils along a strip all pairs can be tried."""
    board = board_with([(0.0, -9.0), (0.0, 9.0)])
    offered = candidates((False, True), (0.0, 14e-3), 2e-3, 7e-3)
    places = [place for one in offered for place in one.images]
    along = [(0.0, y) for y in (0.0, 4e-3, 8e-3, 12e-3)]
    rating = FocusRating.of(board, PlainPlate.of(board, places), along)
    found = best_layouts(rating, offered, 2, 7e-3)
    rows = np.cumsum([0, *(len(one.images) for one in offered)])
    every = {
        one.at: rating.figure(range(rows[k], rows[k + 1]))
        for k, one in enumerate(offered)
        if len(one.images) == 2
    }
    best = max(every, key=lambda at: every[at])
    assert found[0][1][0].at == best
    assert found[0][0] == pytest.approx(every[best])
    assert every[best] > min(every.values()) + 3.0


@pytest.mark.parametrize(
    ("material", "open_mm", "found"),
    [
        ("acrylic", "free", (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0)),
        ("acrylic", {"from": 1.5, "to": 3.5}, (1.5, 2.0, 3.0)),
        ("FR4", {"from": 0.7, "to": 3.5}, (0.8, 1.0, 1.2, 1.6)),
        ("glass", {"from": 0.6, "to": 3.5}, (0.7, 1.1, 2.0, 3.0)),
        ("steel", {"from": 0.7, "to": 2.5}, (0.8, 1.0, 1.5, 2.0)),
    ],
)
def test_sheets_are_as_thick_as_shops_sell_them(
    material: str, open_mm: object, found: tuple[float, ...]
) -> None:
    """Of acrylic half a millimetre was searched, which no one sells, and not 2 to 4."""
    (own,) = variables_of({"plate": {"material": material, "thickness_mm": open_mm}})
    assert isinstance(own, Choice)
    assert own.options == found


def test_values_of_a_list_that_no_board_had_are_found_with_a_driver_open() -> None:
    """A board of the other driver has no such key; one with it counts."""
    document = {
        "plate": {"material": {"any": ["FR4", "steel"]}},
        "electronics": {"lost_ns": {"any": [20, 40]}},
    }
    with_bridges = {"plate": {"material": "FR4"}, "electronics": {"lost_ns": 20}}
    with_switches = {"plate": {"material": "FR4"}, "electronics": {}}
    left = never_tried(variables_of(document), [with_switches, with_bridges])
    assert left == {"plate.material": ("steel",), "electronics.lost_ns": (40,)}


def test_straps_come_last_with_bridges_too() -> None:
    own = with_pins({"drive": "bridge"}, {"sda_pin": 21, "scl_pin": 22})
    assert not {2, 12} & {*own["pwm_pins"][:7], *own["sign_pins"][:7]}


def test_a_spec_may_have_a_list_where_a_board_has_one_of_some_names() -> None:
    with pytest.raises(InputError, match="soft-pu-foam, perhaps") as caught:
        spec_of(small(foundation={"material": "softpu-foam", "thickness_mm": 4.0}))
    assert "or { any = […] } of them, to be searched" in str(caught.value)


def test_where_clicks_are_weighed_harder_feet_come_first() -> None:
    """Tones are louder on the softer ones, clicks keep 10 dB and more on the others."""
    spec = read_spec(ROOT / "boards" / "specs" / "feet5.toml")
    places = [(0.0, 0.0), *((1e-3 * x, 1e-3 * y) for x in (-42.0, 42.0) for y in (-20.0, 20.0))]
    tones, clicks = [], []
    for feet in (0.0, 1.0):
        board = completed_board(document_of(spec, (0.0, feet), [(0.0, 0.0)]))
        plain = PlainPlate.of(board, places)
        drive = replace(board.drive, frequency_hz=200.0)
        at_200 = PlainPlate.of(replace(board, drive=drive), places)
        tones.append(ApartRating.of(board, plain, (1.0, 0.3, 0.0)).figure(range(5)))
        clicks.append(ApartRating.of(board, plain, (0.0, 0.3, 1.0), at_200).figure(range(5)))
    assert tones[0] > tones[1]
    assert clicks[1] > clicks[0] + 8.0
