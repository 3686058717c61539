"""The best drive for one place: ways to find it, and what it is worth."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from chladni.sim.lazy_names import lazy_names

if TYPE_CHECKING:
    from chladni.drives.methods import METHODS
    from chladni.drives.objectives import OBJECTIVES
    from chladni.drives.problem.problem import solved_board
    from chladni.drives.scoring.scorecard import Scorecard, score, score_field
    from chladni.drives.solve import Solution, solve

_PLACES = {
    "methods": ("METHODS",),
    "objectives": ("OBJECTIVES",),
    "problem.problem": ("solved_board",),
    "scoring.scorecard": ("Scorecard", "score", "score_field"),
    "solve": ("Solution", "solve"),
}

__all__ = [
    "METHODS",
    "OBJECTIVES",
    "Scorecard",
    "Solution",
    "score",
    "score_field",
    "solve",
    "solved_board",
]

__getattr__ = lazy_names(__name__, _PLACES)


class _Face(ModuleType):
    """Where `solve` is the function: Python would put the file of that name here once loaded."""

    def __setattr__(self, name: str, value: Any) -> None:
        is_file = name == "solve" and isinstance(value, ModuleType)
        super().__setattr__(name, value.solve if is_file else value)


sys.modules[__name__].__class__ = _Face
