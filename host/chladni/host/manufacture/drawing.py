"""A board for its makers: every outline and hole in millimetres, a layer for each part.

Shapes only; `drawing_files` writes them. Places are measured from the plate's centre, y upwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from chladni.host.manufacture.board_parts import ground_holes_mm
from chladni.sim.board.board import Board
from chladni.sim.board.catalogue import foot_radius
from chladni.sim.board.foundation import CutOut
from chladni.sim.board.quantity import MM
from chladni.sim.board.support_checks import has_foam_at_coils

Point = tuple[float, float]

TEXT_MM, TITLE_MM = 2.2, 3.5
MARGIN_MM, ROW_MM = 6.0, 3.6
DIMENSION_MM = 8.0
"""From the plate's edge to its overall dimensions."""
ORDINATE_MM = 5.0
"""From the plate's edge to numbers of columns and rows, which a slant line leads to."""
CLEARANCE = 0.25e-3
"""m, round a magnet in its hole of the foam: a punch and a glued magnet are each as far off."""
LETTER_MM = 1.7
"""Width of a letter of the list, of a wide font."""
LAYERS = {
    "plate": "#000000", "holes": "#000000", "screws": "#7a3db8", "supports": "#7a3db8",
    "magnets": "#c00000", "masses": "#8a5a00", "coils": "#b06000", "foam": "#1f7a3d",
    "dimensions": "#5a6b7b", "text": "#000000",
}  # fmt: skip
"""Name to colour."""
HOW_DRAWN = (
    "1:1, in mm from the plate's middle, seen from above",
    "above coils: channel and name",
)


@dataclass(frozen=True)
class Circle:
    """A circle, by its middle and radius."""

    layer: str
    at: Point
    radius: float


@dataclass(frozen=True)
class Rectangle:
    """A rectangle along the axes, by two corners; its own corners may be round."""

    layer: str
    low: Point
    high: Point
    corner: float = 0.0


@dataclass(frozen=True)
class Line:
    """A straight line."""

    layer: str
    start: Point
    end: Point


@dataclass(frozen=True)
class Text:
    """A line of text, its height that of its capitals; centred, or from its left."""

    layer: str
    at: Point
    text: str
    height: float = TEXT_MM
    centred: bool = False


Shape = Circle | Rectangle | Line | Text


@dataclass(frozen=True)
class HoleRow:
    """A round hole or place of the list: what it is in, its middle and diameter, mm."""

    part: str
    at_mm: Point
    diameter_mm: float


@dataclass(frozen=True)
class Drawing:
    """Shapes of a board on a sheet from `low` to `high`, mm; its holes, and what its parts are."""

    name: str
    low: Point
    high: Point
    shapes: tuple[Shape, ...]
    holes: tuple[HoleRow, ...]
    notes: tuple[str, ...]


def board_drawing(board: Board) -> Drawing:
    """Draw a board for manufacture."""
    width, length = (_mm(side) for side in board.plate.size)
    holes = hole_list(board)
    title, notes = _title(board), [_hole_text(k, hole) for k, hole in enumerate(holes, 1)]
    shapes = [*_outlines(board), *_discs(board), *_dimensions(board)]
    left, top = width / 2.0 + DIMENSION_MM + 3.0 * MARGIN_MM, length / 2.0
    shapes.append(Text("text", (left, top - TITLE_MM), title[0], TITLE_MM))
    rows = [*title[1:], "", *notes, *_feet(board)]
    for k, row in enumerate(rows):
        shapes.append(Text("text", (left, top - TITLE_MM - (k + 1.5) * ROW_MM), row))
    side = width / 2.0 + DIMENSION_MM + 2.0 * MARGIN_MM
    bottom = min(
        -length / 2.0 - DIMENSION_MM - MARGIN_MM, top - TITLE_MM - (len(rows) + 1) * ROW_MM
    )
    widest = LETTER_MM * max(map(len, rows))
    high = (left + widest, length / 2.0 + ORDINATE_MM + 2.0 * MARGIN_MM)
    of_parts = tuple(title[1 : -len(HOW_DRAWN)])
    return Drawing(board.name, (-side, bottom - MARGIN_MM), high, tuple(shapes), holes, of_parts)


def hole_list(board: Board) -> tuple[HoleRow, ...]:
    """Every round hole of plate and foam, in the file's order; screws go through the plate."""
    rows = [("plate, screw", own.at, own.radius) for own in board.screws]
    rows += [("plate, hole", own.at, own.radius) for own in board.holes]
    rows += [("foam", own.at, own.radius) for own in _foam_holes(board)]
    return tuple(HoleRow(part, _place(at), 2.0 * _mm(radius)) for part, at, radius in rows)


def _foam_holes(board: Board) -> list[CutOut]:
    """Cut-outs that there is foam for: of strips those that reach one. Magnets get clearance."""
    pieces = board.foundation_strips
    least = {own.at: _magnet_radius(board) + CLEARANCE for own in board.actuators}
    return [
        replace(cut, radius=max(cut.radius, least.get(cut.at, 0.0)))
        for cut in board.all_cut_outs
        if not pieces or any(_apart(cut.at, piece) < cut.radius for piece in pieces)
    ]


def cut_hole_mm(board: Board) -> float:
    """Diameter that the foam's holes round coils are cut with: the file's, or what magnets need."""
    cut = board.foundation.coil_cut_out if board.foundation else 0.0
    return 2.0 * _mm(max(cut, _magnet_radius(board) + CLEARANCE)) if cut else 0.0


def _magnet_radius(board: Board) -> float:
    return board.magnet.radius if board.magnet else 0.0


def _apart(at: Point, piece: tuple[float, float, float, float]) -> float:
    """Distance of a place from a rectangle (x from, x to, y from, y to)."""
    x0, x1, y0, y1 = piece
    return math.hypot(max(x0 - at[0], at[0] - x1, 0.0), max(y0 - at[1], at[1] - y1, 0.0))


def _outlines(board: Board) -> list[Shape]:
    """Plate, and the foam under it or its strips."""
    width, length = (_mm(side) for side in board.plate.size)
    low, high = (-width / 2.0, -length / 2.0), (width / 2.0, length / 2.0)
    corner = _mm(board.plate.corner_radius)
    shapes: list[Shape] = [Rectangle("plate", low, high, corner)]
    if board.foundation and board.foundation.sheet_stiffness:
        shapes += [
            Rectangle("foam", (_mm(x0), _mm(y0)), (_mm(x1), _mm(y1)))
            for x0, x1, y0, y1 in board.foundation_strips
        ] or [Rectangle("foam", low, high, corner)]
    return shapes


def _discs(board: Board) -> list[Shape]:
    """All that is round, and points with a cross."""
    shapes: list[Shape] = [Circle("holes", _place(o.at), _mm(o.radius)) for o in board.holes]
    shapes += [Circle("screws", _place(own.at), _mm(own.radius)) for own in board.screws]
    shapes += [Circle("foam", _place(own.at), _mm(own.radius)) for own in _foam_holes(board)]
    for mass in board.masses:
        own = Circle("masses", _place(mass.at), _mm(mass.radius))
        shapes += [own] if mass.radius else _cross("masses", _place(mass.at))
    for at in [pin.at for pin in board.pins] + [spring.at for spring in board.springs]:
        shapes += _cross("supports", _place(at))
    shapes += [
        Circle("supports", _place(own.at), _mm(foot_radius(own)))
        for own in board.springs
        if own.part
    ]
    for channel, actuator in enumerate(board.actuators):
        at = _place(actuator.at)
        if board.magnet:
            shapes.append(Circle("magnets", at, _mm(board.magnet.radius)))
        if board.winding:
            around = (board.winding.inner, board.winding.outer)
            shapes += [Circle("coils", at, _mm(d) / 2.0) for d in around if d > 0.0]
        shapes += _cross("magnets", at)
        widest = max(board.winding.outer / 2.0 if board.winding else 0.0, _magnet_radius(board))
        # The plate's outline is cut: no name lies on it.
        above = min(at[1] + _mm(widest) + 0.5, _mm(board.plate.size[1]) / 2.0 - 2.0)
        name = f"{channel} {actuator.name}"
        shapes.append(Text("text", (at[0], above), name, 1.6, centred=True))
    return shapes


def _cross(layer: str, at: Point, half: float = 0.8) -> list[Shape]:
    x, y = at
    return [Line(layer, (x - half, y), (x + half, y)), Line(layer, (x, y - half), (x, y + half))]


def _dimensions(board: Board) -> list[Shape]:
    """Overall size below and on the left; columns above and rows on the right, from the middle."""
    x, y = (_mm(side) / 2.0 for side in board.plate.size)
    below, beside = -y - DIMENSION_MM, -x - DIMENSION_MM
    layer = "dimensions"
    shapes: list[Shape] = [
        Line(layer, (-x, below), (x, below)), Line(layer, (beside, -y), (beside, y)),
        Text(layer, (0.0, below - 3.2), f"{2.0 * x:g}", centred=True),
        Text(layer, (beside - 6.0, -0.8), f"{2.0 * y:g}", centred=True),
    ]  # fmt: skip
    for sign in (-1.0, 1.0):
        shapes.append(Line(layer, (sign * x, -y - 1.0), (sign * x, below - 1.0)))
        shapes.append(Line(layer, (-x - 1.0, sign * y), (beside - 1.0, sign * y)))
    places = [_place(own.at) for own in board.actuators]
    columns, rows = (sorted({place[axis] for place in places}) for axis in (0, 1))
    wide = LETTER_MM * max((len(_told(own)) for own in columns), default=0)
    # Numbers of columns stand by turns in two lines.
    spread = _apart_by(columns, wide / 2.0 + 1.0)
    for k, (column, at) in enumerate(zip(columns, spread, strict=True)):
        end = y + ORDINATE_MM + 3.0 * (k % 2)
        shapes.append(Line(layer, (column, y + 1.0), (at, end)))
        shapes.append(Text(layer, (at, end + 0.6), _told(column), centred=True))
    for row, at in zip(rows, _apart_by(rows, ROW_MM), strict=True):
        shapes.append(Line(layer, (x + 1.0, row), (x + ORDINATE_MM, at)))
        shapes.append(Text(layer, (x + ORDINATE_MM + 0.6, at - 0.8), _told(row)))
    return shapes


def _apart_by(places: Sequence[float], least: float) -> list[float]:
    """Places in their order, moved as little as keeps them so far apart, those together by half."""
    groups: list[list[float]] = []
    for place in places:
        groups.append([place])
        while len(groups) > 1 and _middle(groups[-1]) - _middle(groups[-2]) < least / 2.0 * (
            len(groups[-1]) + len(groups[-2])
        ):
            groups[-2:] = [groups[-2] + groups[-1]]
    return [
        _middle(own) + least * (k - (len(own) - 1) / 2.0) for own in groups for k in range(len(own))
    ]


def _middle(places: Sequence[float]) -> float:
    return sum(places) / len(places)


def _told(along_mm: float) -> str:
    """As tables of places have it: no one measures more."""
    return f"{round(along_mm, 2) + 0.0:g}"


def _title(board: Board) -> list[str]:
    """What the sheet shows, line by line."""
    plate, magnet, winding, foundation = (
        board.plate,
        board.magnet,
        board.winding,
        board.foundation,
    )
    rows = [
        board.name,
        f"plate: {plate.material or f'E = {plate.youngs_modulus / 1e9:g} GPa'}, "
        f"{_mm(plate.thickness):g} thick"
        + (f", corners R{_mm(plate.corner_radius):g}" if plate.corner_radius else ""),
    ]
    count = len(board.actuators)
    if magnet:
        rows.append(f"magnets: {count} of ⌀{2.0 * _mm(magnet.radius):g} × {_mm(magnet.height):g}")
    if winding:
        rows.append(
            f"coils: {count} of ⌀{_mm(winding.inner):g} to ⌀{_mm(winding.outer):g} × "
            f"{_mm(winding.height):g}, {_mm(winding.gap):g} from the magnet"
        )
    if foundation and foundation.sheet_stiffness:
        what = foundation.material or f"{foundation.sheet_stiffness * MM**3:g} N/mm³"
        thick = f", {_mm(foundation.thickness):g} thick" if foundation.thickness else ""
        rows.append(f"foam: {what}{thick}")
        own, cut = 2.0 * _mm(foundation.coil_cut_out), cut_hole_mm(board)
        if cut > own and has_foam_at_coils(board, 0.5 * MM * cut):
            rows.append(f"its holes ⌀{cut:g}: ⌀{own:g} of the board file, and room for the magnets")
        is_near = winding is not None and has_foam_at_coils(board, 0.5 * winding.outer)
        if winding and board.coils_in_foam and is_near:
            rows.append(
                f"its holes from below ⌀{_mm(winding.outer):g}, {_mm(board.coils_in_foam):g} deep, "
                "for the coils"
            )
    if winding and (deep := ground_holes_mm(board)):
        rows.append(f"ground plate: holes wider than ⌀{_mm(winding.outer):g}, {deep:g} deep")
    return [*rows, *HOW_DRAWN]


def _hole_text(number: int, hole: HoleRow) -> str:
    x, y = hole.at_mm
    return f"hole {number} ({hole.part}):  x {x:g}  y {y:g}  ⌀{hole.diameter_mm:g}"


def _feet(board: Board) -> list[str]:
    """What the plate stands on at points: springs with their stiffness, pins held."""
    feet = [(own.at, own.part or f"{own.stiffness * MM:g} N/mm") for own in board.springs]
    feet += [(own.at, "held") for own in board.pins]
    return ["foot, {}:  x {:g}  y {:g}".format(how, *_place(at)) for at, how in feet]


def _mm(value: float) -> float:
    return round(value / MM, 9) + 0.0  # no zero below zero


def _place(at: Point) -> Point:
    return _mm(at[0]), _mm(at[1])
