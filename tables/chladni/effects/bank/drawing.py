"""Shapes of areas from a drawing: an SVG, in which each shape of interest has an `id`.

The drawing's middle is the board's centre, its upper edge the board's far end. Where it has no size
in millimetres its own units are millimetres.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import svgelements as svg

from chladni.effects.bank.areas import Circle, Point, Polygon, Shape
from chladni.sim.errors import ArgumentError, InputError
from chladni.sim.files import read_text

MOST_BYTES = 8 << 20
PER_CURVE = 6
"""Straight lines in place of a curve: 0.5 mm off at most for a quarter circle of 30 mm."""
PIXELS_PER_INCH = 25.4
"""So that what the library calls a pixel is a millimetre."""


def shapes_of_drawing(path: Path, field: str) -> dict[str, Shape | InputError]:
    """Circles and polygons by their `id`s, or why one can be no area: a logo need not.

    Parameters
    ----------
    field
        The argument, for errors.

    Raises
    ------
    InputError
        It cannot be read, is no SVG, or has no size.
    """
    text = read_text(path, field, MOST_BYTES, "an SVG drawing")
    drawing = _parsed(text, path, field)
    middle = complex(float(drawing.width), float(drawing.height)) / 2.0
    found: dict[str, Shape | InputError] = {}
    for element in drawing.elements():
        name = getattr(element, "id", None)
        if not isinstance(element, svg.Shape) or not name:
            continue
        try:
            found[str(name)] = _shape(element, middle)
        except InputError as error:
            own = InputError(f"#{name}", error.value, error.expected, file=str(path))
            found[str(name)] = own
    return found


def _parsed(text: str, path: Path, field: str) -> Any:
    try:
        root = ElementTree.fromstring(text)
        box = [float(one) for one in root.get("viewBox", "").replace(",", " ").split()]
        if root.get("width") is None or root.get("height") is None:
            if len(box) != 4 or min(box[2:]) <= 0.0:
                expected = 'width="80mm" and height="160mm", or a viewBox in millimetres'
                raise ArgumentError(field, "a drawing without a size", expected, file=str(path))
            root.set("width", f"{box[2]:g}mm")
            root.set("height", f"{box[3]:g}mm")
        whole = ElementTree.tostring(root, encoding="unicode")
        found = svg.SVG.parse(io.StringIO(whole), ppi=PIXELS_PER_INCH)
        if not isinstance(found, svg.SVG):
            raise ValueError("no svg element")
        return found
    except (ElementTree.ParseError, ValueError, TypeError, AttributeError, RecursionError) as error:
        # The library tells of what it cannot read in many ways.
        raise ArgumentError(field, str(error)[:80], "an SVG drawing", file=str(path)) from None


def _shape(element: Any, middle: complex) -> Shape:
    def on_board(point: Any) -> Point:
        return round(point.x - middle.real, 3), round(middle.imag - point.y, 3)

    if isinstance(element, svg.Circle):
        across, up, _, _ = (float(one) for one in element.bbox())
        right, down = (float(one) for one in element.bbox()[2:])
        if abs((right - across) - (down - up)) < 1e-3:
            centre = svg.Point((across + right) / 2.0, (up + down) / 2.0)
            return Circle(on_board(centre), round((right - across) / 2.0, 3))
    corners: list[Point] = []
    for piece in svg.Path(element):
        if isinstance(piece, svg.Move) and corners:
            raise ArgumentError("shape", "several outlines", "one outline")
        if isinstance(piece, svg.Line | svg.Close | svg.Move):
            points = [piece.end]
        else:
            points = [piece.point((k + 1) / PER_CURVE) for k in range(PER_CURVE)]
        for place in (on_board(point) for point in points if point is not None):
            if not corners or place not in (corners[-1], corners[0]):
                corners.append(place)
    return Polygon(tuple(corners))
