"""Areas of an effect bank, where they lie on the board."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle as CirclePatch
from matplotlib.patches import Polygon as PolygonPatch

from chladni.effects.bank.areas import Area, Bank, Circle, Polygon, reach_mm
from chladni.host.figures.fields import INK

ELSEWHERE = "elsewhere"
COLOURS = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#0072b2", "#d55e00")


def areas_figure(bank: Bank) -> Figure:
    """Each area with its name and effects; those that have the same effects have one colour."""
    reached = [corner for area in bank.areas for corner in reach_mm(area.shape)]
    xs, ys = zip(*reached, strict=True) if reached else ((-1.0, 1.0), (-1.0, 1.0))
    width, length = max(xs) - min(xs), max(ys) - min(ys)
    scale = 7.5 / max(width, length)
    size = (max(3.2, scale * width) + 1.2, max(2.4, scale * length) + 1.0)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    kinds = list(dict.fromkeys(tuple(area.effects.items()) for area in bank.areas))
    # The first counts where areas overlap, so it is drawn last.
    for area in reversed(bank.areas):
        colour = COLOURS[kinds.index(tuple(area.effects.items())) % len(COLOURS)]
        _draw(axes, area, colour)
    axes.set_aspect("equal")
    margin = 0.04 * max(width, length)
    axes.set_xlim(min(xs) - margin, max(xs) + margin)
    axes.set_ylim(min(ys) - margin, max(ys) + margin)
    axes.set_xlabel("x / mm")
    axes.set_ylabel("y / mm")
    axes.set_title(f"Areas of {bank.name}", color=INK, fontsize=11)
    return figure


def _draw(axes: Axes, area: Area, colour: str) -> None:
    look = {"facecolor": colour, "alpha": 0.35, "edgecolor": INK, "linewidth": 0.8}
    match area.shape:
        case Circle(centre_mm=centre, radius_mm=radius):
            axes.add_patch(CirclePatch(centre, radius, **look))
        case Polygon(corners_mm=corners):
            axes.add_patch(PolygonPatch(corners, closed=True, **look))
        case _:
            axes.set_facecolor((colour, 0.15))
            name = area.name if area.name == ELSEWHERE else f"{ELSEWHERE}, {area.name}"
            told = f"{name}: {_played(area, ', ')}"
            axes.annotate(told, (0.01, 0.01), xycoords="axes fraction", fontsize=7, color=INK)
            return
    (left, low), (right, high) = reach_mm(area.shape)
    middle = (0.5 * (left + right), 0.5 * (low + high))
    told = f"{area.name}\n{_played(area, chr(10))}"
    axes.annotate(told, middle, ha="center", va="center", fontsize=6.5, color=INK)


def _played(area: Area, between: str) -> str:
    rows = [f"{occasion} {name}" for occasion, name in area.effects.items()]
    if area.every_mm > 0.0:
        rows.append(f"every {area.every_mm:g} mm along {area.along}")
    if area.level_db < 0.0:
        rows.append(f"{area.level_db:g} dB")
    return between.join(rows) or "nothing"
