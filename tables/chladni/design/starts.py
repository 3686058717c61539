"""Where a search begins: layouts found by exchange, for values of all else spread evenly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product, zip_longest
from typing import Any

import numpy as np

from chladni.design.evaluate import completed_board, document_of
from chladni.design.keep_out import KeepOut, KeptFoot, kept_feet
from chladni.design.layouts.exchange import best_layouts
from chladni.design.layouts.layouts import (
    Candidate,
    Layout,
    Orbit,
    Place,
    candidates,
    lattices,
    spread_out,
)
from chladni.design.layouts.plain_plate import PlainPlate
from chladni.design.layouts.ratings import ApartRating, FocusRating, Rating
from chladni.design.spec import Spec
from chladni.design.variables import Choice, Document
from chladni.design.weights import FINGER_CLICK, FINGER_LEVEL, FINGER_TERMS
from chladni.drives.scoring.kept_focus import CLICK_HZ
from chladni.drives.scoring.survey import active_lattice
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Actuator
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ArgumentError, InputError
from chladni.sim.fields.board_mirrors import board_mirrors

SCANNED = 16
"""Values of all that is open besides places, for which layouts are looked for by exchange."""
KEPT = 4
"""Layouts of each number of coils, by exchange or in even rows and columns, that are solved."""
SPREAD = 2
"""And of those in the middles of equal cells, one of a shape."""
STEPS = 12
"""Of the grid of candidates, from the middle to the edge, at most."""
LEAST_STEP = 2e-3
EDGE = 1e-3
"""m from a magnet to the edge, unless the SPEC gives another: a field takes long there."""
SCAN_PITCH = 5e-3
"""m between places while layouts are looked for, at least."""


Kind = tuple[str, tuple[float, list[Candidate]]]
"""Of what kind a layout is, how good it is by a rough measure, and its coils."""


@dataclass(frozen=True)
class Point:
    """A board of the search: its layout, a number for each variable, and for each coordinate."""

    layout: Layout | None
    numbers: tuple[float, ...]
    shares: tuple[float, ...]

    def at(self, x: Sequence[float]) -> Point:
        """The point with these numbers and shares, one after the other."""
        cut, end = len(self.numbers), len(self.numbers) + len(self.shares)
        return Point(self.layout, tuple(map(float, x[:cut])), tuple(map(float, x[cut:end])))


def document_at(spec: Spec, point: Point) -> Document:
    """The board file of a point."""
    if point.layout is None:
        return document_of(spec, point.numbers, None)
    places = point.layout.places(point.shares, _reach(spec, point.numbers))
    return document_of(spec, point.numbers, places)


def _reach(spec: Spec, numbers: Sequence[float]) -> Place:
    """How far from the middle a coil may stand, mm."""
    document = document_of(spec, numbers, None)
    edge = spec.settings.edge
    if edge is None:
        magnet = document.get("magnet")
        edge = float(magnet["radius_mm"]) * MM + EDGE if isinstance(magnet, dict) else 0.0
    half = [float(side) / 2.0 - edge / MM for side in document["plate"]["size_mm"]]
    return max(half[0], 0.0), max(half[1], 0.0)


def spread_numbers(spec: Spec, seed: int) -> list[tuple[float, ...]]:
    """Numbers of all variables, each once, spread over what they may be, the middle first."""
    from scipy.stats import qmc  # noqa: PLC0415  (a third of a second to load)

    most = np.array([one.most for one in spec.variables])
    if not most.size:
        return [()]
    count = min(SCANNED, max(1, spec.settings.evaluations // 10))
    shares = qmc.Sobol(most.size, seed=seed).random(SCANNED)[: count - 1]
    whole = np.array([one.is_whole for one in spec.variables])
    rows = np.vstack([np.full(most.size, 0.5), shares]) * np.where(whole, most, 1.0)
    rows = np.where(whole, np.round(rows), rows)
    # Of few choices many draws are the same board.
    return list(dict.fromkeys(tuple(map(float, row)) for row in rows))


def boards_asked(spec: Spec) -> int:
    """How many boards a search looks at if there is time: of lists alone no more than there are."""
    counts, most = _counts_of_lists(spec), spec.settings.evaluations
    return min(most, math.prod(counts)) if counts else most


def _counts_of_lists(spec: Spec) -> list[int]:
    """How many choices each list has, where a SPEC leaves lists alone open; else none."""
    if spec.places_are_free or not all(isinstance(one, Choice) for one in spec.variables):
        return []
    return [round(one.most) + 1 for one in spec.variables]


def every_point(spec: Spec, seed: int) -> list[Point]:
    """All boards of a SPEC that leaves lists alone open, if a search may look at all of them.

    In an order of chance: time may end the search, and the first ones of each list are alike.
    """
    counts = _counts_of_lists(spec)
    if not counts or math.prod(counts) > spec.settings.evaluations:
        return []
    found = [Point(None, tuple(map(float, own)), ()) for own in product(*map(range, counts))]
    return [found[k] for k in np.random.default_rng(seed).permutation(len(found))]


def check_boards(spec: Spec, seed: int) -> None:
    """Raise what is wrong with the first board of a SPEC whose coils are to be placed.

    Raises
    ------
    InputError
        None of the boards for which layouts would be looked for can be, whatever its coils' places.
    """
    faults = []
    for numbers in spread_numbers(spec, seed) if spec.places_are_free else []:
        try:
            completed_board(document_of(spec, numbers, [(0.0, 0.0)]))
        except InputError as error:
            faults.append(error)
        else:
            return
    if faults:
        raise faults[0]


def layouts_of(spec: Spec, task: tuple[int, tuple[float, ...]]) -> dict[str, Any]:
    """Layouts of so many coils by exchange, with these numbers for all else."""
    count, numbers = task
    reach = _reach(spec, numbers)
    document = document_of(spec, numbers, [(0.0, 0.0)])
    try:
        board = completed_board(document)
    except InputError:
        return {"layouts": []}
    mirrors = _mirrors(spec, board)
    span = (reach[0] * MM, reach[1] * MM)
    step = max(LEAST_STEP, max(span) / STEPS)
    least = spec.settings.coil_spacing
    areas: list[KeepOut | KeptFoot] = [*spec.keep_out, *kept_feet(document)]
    offered = [one for one in candidates(mirrors, span, step, least) if _is_allowed(areas, one)]
    regular = [
        own for own in _regular(count, mirrors, span, board, least) if _fits(own, areas, span)
    ]
    places = [
        place
        for place in active_lattice(board, max(spec.settings.pitch, SCAN_PITCH)).places
        if all(along > -1e-9 or not own for along, own in zip(place, mirrors, strict=True))
    ]
    if not offered:
        return {"layouts": []}
    looked_at = [*offered, *(one for _, own in regular for one in own)]
    coils = [place for one in looked_at for place in one.images]
    try:
        rating = _rating(spec, board, coils, places)
    except ArgumentError:
        return {"layouts": []}  # this plate has no room for two fingers, another one may
    exchanged = [("exchanged", one) for one in best_layouts(rating, offered, count, least)]
    widest = 2.0 * np.abs(places).max(axis=0)
    sides = [k for k in (0, 1) if mirrors[k] and widest[k] >= board.fingers_apart]
    told = _telling([*exchanged, *_scored(rating, offered, regular)], sides)
    rows = []
    for kind, (figure, chosen) in _ranked(told):
        layout = Layout(mirrors, tuple(one.orbit for one in chosen))
        at = [(one.at[0] / MM, one.at[1] / MM) for one in chosen]
        rows.append(
            {
                "figure": figure,
                "kind": kind,
                "mirrors": list(mirrors),
                "numbers": list(numbers),
                "leaves": [list(one.leaves) for one in layout.orbits],
                "shares": layout.shares(at, reach),
            }
        )
    return {"layouts": rows}


def chosen(rows: Sequence[dict[str, Any]]) -> list[Point]:
    """Layouts to solve, of all of one number of coils.

    A rating on a plate without magnets is rough: regular layouts may look worse than they are.
    """
    ranked = sorted(rows, key=lambda one: -float(one["figure"]))
    by_kind = [
        [one for one in ranked if one["kind"] == kind][:KEPT] for kind in ("exchanged", "even")
    ]
    first = [one for pair in zip_longest(*by_kind) for one in pair if one][:KEPT]
    shapes: dict[str, dict[str, Any]] = {}
    for one in ranked:
        if one["kind"] == "spread":
            shapes.setdefault(str(one["leaves"]), one)
    return [point_of(one) for one in (*first, *list(shapes.values())[:SPREAD])]


def _regular(
    count: int, mirrors: tuple[bool, bool], span: Place, board: Board, least: float
) -> list[tuple[str, list[Candidate]]]:
    """Layouts in even rows and columns, and in the middles of equal cells, with their kinds."""
    even = lattices(count, mirrors, span, least)
    spread = spread_out(count, mirrors, board.plate.size, least)
    return [*(("even", own) for own in even), *(("spread", own) for own in spread)]


def _fits(
    layout: tuple[str, list[Candidate]], areas: Sequence[KeepOut | KeptFoot], span: Place
) -> bool:
    """Whether a regular layout keeps off all areas, and within reach."""
    return all(
        _is_allowed(areas, one)
        and all(abs(along) <= far + 1e-9 for along, far in zip(one.at, span, strict=True))
        for one in layout[1]
    )


def _is_allowed(areas: Sequence[KeepOut | KeptFoot], one: Candidate) -> bool:
    return not any(area.depth(place) > 0.0 for area in areas for place in one.images)


def _telling(layouts: list[Kind], sides: Sequence[int]) -> list[Kind]:
    """Those with a coil off the middle line of each side; all, if there are none.

    Of coils that all stand on a middle line fingers feel the same to its left and right.
    """
    return [
        one
        for one in layouts
        if all(any(own.orbit.leaves[axis] for own in one[1][1]) for axis in sides)
    ] or layouts


def _rating(spec: Spec, board: Board, coils: Sequence[Place], places: Sequence[Place]) -> Rating:
    """By what the SPEC weighs, or by one finger's focus if it weighs that as well."""
    plain = PlainPlate.of(board, coils)
    if not spec.is_for_several:
        return FocusRating.of(board, plain, places)
    tones = sum(spec.weights.get(name, 0.0) for name in FINGER_TERMS)
    level, clicks = (spec.weights.get(name, 0.0) for name in (FINGER_LEVEL, FINGER_CLICK))
    drive = replace(board.drive, frequency_hz=CLICK_HZ)
    at_clicks = PlainPlate.of(replace(board, drive=drive), coils) if clicks else None
    return ApartRating.of(board, plain, (tones, level, clicks), at_clicks)


def _scored(
    rating: Rating, offered: Sequence[Candidate], regular: Sequence[tuple[str, list[Candidate]]]
) -> list[Kind]:
    """Regular layouts, whose images come after those of `offered`, with their figures."""
    first, found = sum(len(one.images) for one in offered), []
    for kind, own in regular:
        count = sum(len(one.images) for one in own)
        found.append((kind, (rating.figure(range(first, first + count)), own)))
        first += count
    return found


def _ranked(layouts: Sequence[Kind]) -> list[Kind]:
    """The best by exchange, the best even ones, then all that are spread, each the best first."""
    best = sorted(layouts, key=lambda one: -one[1][0])
    exchanged, even, spread = (
        [own for own in best if own[0] == kind] for kind in ("exchanged", "even", "spread")
    )
    return [*exchanged[:KEPT], *even[:KEPT], *spread]


def steps_of(spec: Spec, point: Point, step: float) -> list[float]:
    """A step of a coil, m, as a share of each open coordinate."""
    if point.layout is None:
        return []
    reach, mirrors = _reach(spec, point.numbers), point.layout.mirrors
    return [
        step / MM / max(reach[axis] * (1.0 if mirrors[axis] else 2.0), 1e-9)
        for orbit in point.layout.orbits
        for axis in (0, 1)
        if orbit.leaves[axis]
    ]


def point_of(row: dict[str, Any]) -> Point:
    """Of a row of `layouts_of`."""
    orbits = tuple(Orbit((bool(x), bool(y))) for x, y in row["leaves"])
    mirrors = (bool(row["mirrors"][0]), bool(row["mirrors"][1]))
    return Point(Layout(mirrors, orbits), tuple(row["numbers"]), tuple(row["shares"]))


def _mirrors(spec: Spec, board: Board) -> tuple[bool, bool]:
    """Which mirrors coils are to keep: those of the plate and the keep-outs, unless told not to."""
    if spec.symmetric is False:
        return False, False
    middle = replace(
        board,
        actuators=(Actuator("middle", (0.0, 0.0)),),
        electronics=replace(board.electronics, pwm_pins=(), sign_pins=()),
    )
    own = board_mirrors(middle)
    areas = {(round(a.at[0], 9), round(a.at[1], 9), a.size) for a in spec.keep_out}
    alike = [
        all((sx * x + 0.0, sy * y + 0.0, size) in areas for x, y, size in areas)
        for sx, sy in ((-1.0, 1.0), (1.0, -1.0))
    ]
    found = (own.x is not None and alike[0], own.y is not None and alike[1])
    if spec.symmetric and not all(found):
        raise InputError("design.symmetric", True, "a plate and keep-outs that are symmetric")
    return found
