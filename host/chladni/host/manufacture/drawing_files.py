"""Drawings as files: SVG and DXF, in millimetres at a scale of 1:1."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from chladni.host.manufacture.drawing import LAYERS, Circle, Drawing, Line, Rectangle, Shape, Text
from chladni.sim.files import write_whole

if TYPE_CHECKING:
    from ezdxf.layouts.layout import Modelspace

LINE_MM = 0.15
CAPITALS = 0.72
"""Height of capitals over the size of a sans-serif font."""
QUARTER_BULGE = math.tan(math.pi / 8.0)
"""DXF's bulge of an arc is the tangent of a quarter of its angle."""


def save_drawing(drawing: Drawing, path: Path) -> None:
    """Write a drawing whole, in the format that its name asks for."""
    write_whole(path, FORMATS[path.suffix](drawing).encode())


def svg_text(drawing: Drawing) -> str:
    """As SVG: a group a layer, and a unit of the view box is a millimetre."""
    (x0, y0), (x1, y1) = drawing.low, drawing.high
    size = (x1 - x0, y1 - y0)
    root = ElementTree.Element(
        "svg",
        {
            "xmlns": "http://www.w3.org/2000/svg",
            "width": f"{size[0]:g}mm",
            "height": f"{size[1]:g}mm",
            "viewBox": f"{x0:g} {-y1:g} {size[0]:g} {size[1]:g}",
        },
    )
    ElementTree.SubElement(root, "title").text = f"{drawing.name}, 1:1 in mm"
    for layer, colour in LAYERS.items():
        own = [shape for shape in drawing.shapes if shape.layer == layer]
        if not own:
            continue
        style = {"fill": "none", "stroke": colour, "stroke-width": f"{LINE_MM:g}"}
        if layer == "foam":  # its edge is the plate's, and its holes are the magnets'
            style["stroke-dasharray"] = "1.2 0.8"
        group = ElementTree.SubElement(root, "g", {"id": layer, **style})
        for shape in own:
            _svg_shape(group, shape, colour)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def _svg_shape(group: ElementTree.Element, shape: Shape, colour: str) -> None:
    """One shape; SVG's y goes down."""
    match shape:
        case Circle(at=(x, y), radius=radius):
            numbers, name = {"cx": x, "cy": -y, "r": radius}, "circle"
        case Rectangle(low=(x0, y0), high=(x1, y1), corner=corner):
            numbers = {"x": x0, "y": -y1, "width": x1 - x0, "height": y1 - y0, "rx": corner}
            name = "rect"
        case Line(start=(x0, y0), end=(x1, y1)):
            numbers, name = {"x1": x0, "y1": -y0, "x2": x1, "y2": -y1}, "line"
        case Text(at=(x, y), height=height):
            numbers, name = {"x": x, "y": -y, "font-size": height / CAPITALS}, "text"
    element = ElementTree.SubElement(group, name, {k: f"{v + 0.0:.9g}" for k, v in numbers.items()})
    if isinstance(shape, Text):
        element.text = shape.text
        style = {"font-family": "sans-serif", "fill": colour, "stroke": "none"}
        if shape.centred:
            style["text-anchor"] = "middle"
        element.attrib |= style


@contextlib.contextmanager
def _without_time_and_chance() -> Iterator[None]:
    """Have ezdxf write no time and no random number, so that a board has the same bytes always."""
    from ezdxf._options import options  # noqa: PLC0415

    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


@_without_time_and_chance()
def dxf_text(drawing: Drawing) -> str:
    """As DXF of AutoCAD 2010, units in millimetres."""
    from ezdxf.document import Drawing as Document  # noqa: PLC0415  (takes half a second to load)
    from ezdxf.units import MM  # noqa: PLC0415

    document = Document.new("R2010")
    document.units = MM
    for layer, colour in LAYERS.items():
        document.layers.add(layer, true_color=int(colour[1:], 16))
    space = document.modelspace()
    for shape in drawing.shapes:
        _dxf_shape(space, shape)
    (x0, y0), (x1, y1) = drawing.low, drawing.high
    document.header["$EXTMIN"], document.header["$EXTMAX"] = (x0, y0, 0.0), (x1, y1, 0.0)
    # In an order of their own: ezdxf has a set of them.
    document.classes.add_required_classes(document.dxfversion)
    document.classes.classes = dict(sorted(document.classes.classes.items()))
    document.set_modelspace_vport((y1 - y0), ((x0 + x1) / 2.0, (y0 + y1) / 2.0))
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def _dxf_shape(space: Modelspace, shape: Shape) -> None:
    layer = {"layer": shape.layer}
    match shape:
        case Circle():
            space.add_circle(shape.at, shape.radius, dxfattribs=layer)
        case Rectangle():
            points = _rounded(shape)
            space.add_lwpolyline(points, "xyb", close=True, dxfattribs=layer)
        case Line():
            space.add_line(shape.start, shape.end, dxfattribs=layer)
        case Text():
            from ezdxf.enums import TextEntityAlignment as Align  # noqa: PLC0415

            # %%c is DXF's own sign for a diameter, which its fonts have.
            text = shape.text.replace("⌀", "%%c")
            own = space.add_text(text, height=shape.height, dxfattribs=layer)
            own.set_placement(shape.at, align=Align.CENTER if shape.centred else Align.LEFT)


def _rounded(shape: Rectangle) -> list[tuple[float, float, float]]:
    """Corners, or both ends of each round one, counter-clockwise, with the bulge after each."""
    (x0, y0), (x1, y1), r = shape.low, shape.high, shape.corner
    if not r:
        return [(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)]
    b = QUARTER_BULGE
    return [
        (x0 + r, y0, 0.0),
        (x1 - r, y0, b),
        (x1, y0 + r, 0.0),
        (x1, y1 - r, b),
        (x1 - r, y1, 0.0),
        (x0 + r, y1, b),
        (x0, y1 - r, 0.0),
        (x0, y0 + r, b),
    ]


FORMATS: dict[str, Callable[[Drawing], str]] = {".dxf": dxf_text, ".svg": svg_text}
