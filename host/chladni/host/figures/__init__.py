"""Everything drawn: boards and fields, and how searches for drives went."""

from chladni.host.figures.chains import Chain, chains_figure
from chladni.host.figures.fields import (
    at_largest_swing,
    chain_figure,
    draw_board,
    draw_displacement,
    draw_image,
    field_figure,
    modes_figure,
    save,
    sweep_figure,
)
from chladni.host.figures.searches import compare_figure, trace_figure

__all__ = [
    "Chain",
    "at_largest_swing",
    "chain_figure",
    "chains_figure",
    "compare_figure",
    "draw_board",
    "draw_displacement",
    "draw_image",
    "field_figure",
    "modes_figure",
    "save",
    "sweep_figure",
    "trace_figure",
]
