"""What is plotted: fields, boards' scores, searches, designs, and touches of the emulated device.

Each function returns a matplotlib figure, which `save` writes (.png, .svg or .pdf); `draw_board`
and `draw_image` draw on axes of one's own. Names are loaded when they are first asked for.
"""

from __future__ import annotations

import warnings
from importlib import import_module

from chladni.sim.lazy_names import lazy_names

TYPE_CHECKING = False  # as in chladni.host
if TYPE_CHECKING:
    from typing import Any

    from chladni.host.figures.boards import score_figure, sensitivity_figure
    from chladni.host.figures.chains import Chain, chains_figure
    from chladni.host.figures.designs import front_figure
    from chladni.host.figures.fields import (
        at_largest_swing,
        draw_board,
        draw_displacement,
        draw_image,
        field_figure,
        modes_figure,
        save,
    )
    from chladni.host.figures.searches import compare_figure, draw_trace
    from chladni.host.figures.solutions import solution_figure
    from chladni.host.figures.sweeps import sweep_figure
    from chladni.host.figures.touches import swipe_figure

_PLACES = {
    "boards": ("score_figure", "sensitivity_figure"),
    "chains": ("Chain", "chains_figure"),
    "designs": ("front_figure",),
    "fields": (
        "at_largest_swing", "draw_board", "draw_displacement", "draw_image", "field_figure",
        "modes_figure", "save",
    ),
    "searches": ("compare_figure", "draw_trace"),
    "solutions": ("solution_figure",),
    "sweeps": ("sweep_figure",),
    "touches": ("swipe_figure",),
}  # fmt: skip
_MOVED = ("board_drawing", "save_drawing", "wiring_figure")
"""To chladni.host.manufacture. These names go with 0.3.0."""

__all__ = [
    "Chain",
    "at_largest_swing",
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
    "score_figure",
    "sensitivity_figure",
    "solution_figure",
    "sweep_figure",
    "swipe_figure",
]


def __getattr__(name: str) -> Any:
    """A name of `__all__`, loaded now and kept."""
    if name in _MOVED:
        place = "chladni.host.manufacture"
        message = f"{__name__}.{name} goes with 0.3.0: import it from {place}"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(import_module(place), name)
    return _load(name)


_load = lazy_names(__name__, _PLACES)
