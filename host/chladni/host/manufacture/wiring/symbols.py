"""Symbols of a circuit diagram, on matplotlib axes; the unit is a quarter of an inch or so."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, Polygon, Rectangle

from chladni.host.figures.fields import INK

Point = tuple[float, float]
THIN, THICK = 1.0, 1.6
SMALL, PLAIN = 7.5, 8.5
"""Text, points."""


class Sheet:
    """Draws symbols; places are of the sheet, x to the right and y up.

    Parameters
    ----------
    axes
        Without frame, both directions to one scale.
    """

    def __init__(self, axes: Axes) -> None:
        self.axes = axes

    def wire(self, *points: Point, width: float = THIN, colour: str = INK) -> None:
        """Straight wires through points."""
        x, y = zip(*points, strict=True)
        self.axes.plot(
            x, y, color=colour, linewidth=width, solid_capstyle="round", solid_joinstyle="miter"
        )

    def dot(self, x: float, y: float, colour: str = INK) -> None:
        """A joint of wires."""
        self.axes.add_patch(Circle((x, y), 0.11, color=colour, linewidth=0.0))

    def text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        size: float = SMALL,
        left: bool = True,
        middle: bool = False,
        colour: str = INK,
        bold: bool = False,
    ) -> None:
        """Text beside a place: to the right of it, to its left, or over the middle of it."""
        # Names come from files: a $ in them is no formula, and what cannot be printed is no text.
        plain = "".join(letter if letter.isprintable() else "·" for letter in text)
        self.axes.text(
            x,
            y,
            plain,
            fontsize=size,
            color=colour,
            va="center",
            parse_math=False,
            ha="center" if middle else "left" if left else "right",
            fontweight="bold" if bold else "normal",
        )

    def lines(self, x: float, y: float, texts: Sequence[str], *, colour: str = INK) -> None:
        """Lines of small text, the first at `y`."""
        for k, text in enumerate(texts):
            self.text(x, y - 0.5 * k, text, colour=colour)

    def box(self, left: float, bottom: float, width: float, height: float, *, fill: str) -> None:
        """A block."""
        self.axes.add_patch(
            Rectangle((left, bottom), width, height, facecolor=fill, edgecolor=INK, linewidth=THIN)
        )

    def ground(self, x: float, y: float) -> None:
        """Common ground, hanging from a place."""
        for k, half in enumerate((0.34, 0.22, 0.1)):
            self.wire((x - half, y - 0.13 * k), (x + half, y - 0.13 * k))

    def rail(self, x: float, y: float, name: str) -> None:
        """A supply's name over the end of a wire."""
        self.wire((x - 0.3, y), (x + 0.3, y), width=THICK)
        self.text(x, y + 0.32, name, middle=True)

    def resistor(self, centre: Point, *, upright: bool) -> None:
        """A resistor of length 1.2 with its leads, 2 in all."""
        x, y = centre
        along, across = (0.2, 0.6) if upright else (0.6, 0.2)
        reach = (0.0, 1.0) if upright else (1.0, 0.0)
        self.wire((x - reach[0], y - reach[1]), (x + reach[0], y + reach[1]))
        self.axes.add_patch(
            Rectangle(
                (x - along, y - across),
                2 * along,
                2 * across,
                facecolor="white",
                edgecolor=INK,
                linewidth=THIN,
                zorder=2.5,
            )
        )

    def fuse(self, centre: Point) -> None:
        """A fuse of length 1.2, with leads of 0.4 each: the wire goes through it."""
        self.resistor(centre, upright=False)
        x, y = centre
        self.axes.plot([x - 0.6, x + 0.6], [y, y], color=INK, linewidth=THIN, zorder=2.6)

    def capacitor(self, x: float, y: float, *, polarised: bool = True) -> None:
        """A capacitor, its + up if it has one; leads end 0.8 above and below."""
        self.wire((x, y + 0.8), (x, y + 0.12))
        self.wire((x - 0.5, y + 0.12), (x + 0.5, y + 0.12), width=THICK)
        self.wire((x - 0.5, y - 0.12), (x + 0.5, y - 0.12), width=THICK)
        self.wire((x, y - 0.12), (x, y - 0.8))
        if polarised:
            self.text(x - 0.42, y + 0.42, "+", middle=True)

    def coil(self, left: float, right: float, y: float) -> None:
        """A coil between two places at one height: four turns in the middle, leads beside."""
        start, turn = (left + right) / 2.0 - 1.0, 0.5
        self.wire((left, y), (start, y))
        self.wire((start + 4 * turn, y), (right, y))
        for k in range(4):
            self.axes.add_patch(
                Arc(
                    (start + (k + 0.5) * turn, y),
                    turn,
                    0.6,
                    theta1=0.0,
                    theta2=180.0,
                    color=INK,
                    linewidth=1.3,
                )
            )

    def diode(self, left: float, right: float, y: float) -> None:
        """A Schottky diode that conducts from left to right."""
        middle = (left + right) / 2.0
        self.wire((left, y), (right, y))
        self.axes.add_patch(
            Polygon(
                [(middle - 0.3, y + 0.3), (middle - 0.3, y - 0.3), (middle + 0.3, y)],
                closed=True,
                facecolor=INK,
                edgecolor=INK,
                linewidth=THIN,
            )
        )
        bar, hook = middle + 0.3, 0.18
        self.wire(
            (bar - hook, y + hook),
            (bar - hook, y + 0.3),
            (bar, y + 0.3),
            (bar, y - 0.3),
            (bar + hook, y - 0.3),
            (bar + hook, y - hook),
            width=1.3,
        )

    def mosfet(self, x: float, y: float) -> Point:
        """An N-channel enhancement MOSFET with its gate at a place; returns the drain's.

        The drain is 0.9 above and 1.1 to the right of the gate, the source as far below.
        """
        self.wire((x, y), (x + 0.4, y))
        self.wire((x + 0.4, y + 0.45), (x + 0.4, y - 0.45), width=1.3)
        for low, high in ((0.3, 0.62), (-0.16, 0.16), (-0.62, -0.3)):
            self.wire((x + 0.58, y + low), (x + 0.58, y + high), width=1.3)
        self.wire((x + 0.58, y + 0.45), (x + 1.1, y + 0.45), (x + 1.1, y + 0.9))
        self.wire((x + 0.58, y - 0.45), (x + 1.1, y - 0.45), (x + 1.1, y - 0.9))
        self.wire((x + 0.58, y), (x + 1.1, y), (x + 1.1, y - 0.45))
        self.axes.add_patch(
            Polygon(
                [(x + 0.62, y), (x + 0.86, y + 0.12), (x + 0.86, y - 0.12)],
                closed=True,
                facecolor=INK,
                edgecolor=INK,
                linewidth=0.5,
            )
        )
        return x + 1.1, y + 0.9
