"""What a board is built from: its wiring, its parts, and its drawing.

`wiring_figure` returns a matplotlib figure. `board_drawing` returns outlines and holes, which
`save_drawing` writes (.svg or .dxf). Names are loaded when they are first asked for.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # as in chladni.host
if TYPE_CHECKING:
    from typing import Any

    from chladni.host.manufacture.drawing import board_drawing
    from chladni.host.manufacture.drawing_files import save_drawing
    from chladni.host.manufacture.wiring.figure import wiring_figure

_PLACES = {
    "board_drawing": "drawing",
    "save_drawing": "drawing_files",
    "wiring_figure": "wiring.figure",
}

__all__ = ["board_drawing", "save_drawing", "wiring_figure"]


def __getattr__(name: str) -> Any:
    """A name of `__all__`, loaded now and kept."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    globals()[name] = value
    return value
