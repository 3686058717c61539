"""Everything drawn: fields, boards and their parts, searches, and touches of the emulated device.

Each function returns a matplotlib figure, which `save` writes (.png, .svg or .pdf); `draw_board`
and `draw_image` draw on axes of one's own. Names are loaded when they are first asked for.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # as in chladni.host
if TYPE_CHECKING:
    from typing import Any

    from chladni.host.figures.boards import score_figure, sensitivity_figure
    from chladni.host.figures.chains import Chain, chains_figure
    from chladni.host.figures.designs import front_figure
    from chladni.host.figures.drawing import board_drawing
    from chladni.host.figures.drawing_files import save_drawing
    from chladni.host.figures.fields import (
        at_largest_swing,
        draw_board,
        draw_displacement,
        draw_image,
        field_figure,
        modes_figure,
        save,
        sweep_figure,
    )
    from chladni.host.figures.searches import compare_figure, draw_trace
    from chladni.host.figures.solutions import solution_figure
    from chladni.host.figures.touches import swipe_figure
    from chladni.host.figures.wiring import wiring_figure

_PLACES = {
    "boards": ("score_figure", "sensitivity_figure"),
    "chains": ("Chain", "chains_figure"),
    "designs": ("front_figure",),
    "drawing": ("board_drawing",),
    "drawing_files": ("save_drawing",),
    "fields": (
        "at_largest_swing", "draw_board", "draw_displacement", "draw_image", "field_figure",
        "modes_figure", "save", "sweep_figure",
    ),
    "searches": ("compare_figure", "draw_trace"),
    "solutions": ("solution_figure",),
    "touches": ("swipe_figure",),
    "wiring": ("wiring_figure",),
}  # fmt: skip

__all__ = [
    "Chain",
    "at_largest_swing",
    "board_drawing",
    "chains_figure",
    "compare_figure",
    "draw_board",
    "draw_displacement",
    "draw_image",
    "draw_trace",
    "field_figure",
    "front_figure",
    "modes_figure",
    "save",
    "save_drawing",
    "score_figure",
    "sensitivity_figure",
    "solution_figure",
    "sweep_figure",
    "swipe_figure",
    "wiring_figure",
]


def __getattr__(name: str) -> Any:
    """A name of `__all__`, loaded now and kept."""
    places = [place for place, names in _PLACES.items() if name in names]
    if not places:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{places[0]}"), name)
    globals()[name] = value
    return value
