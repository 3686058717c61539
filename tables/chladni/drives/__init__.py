"""The best drive for one place: ways to find it, and what it is worth."""

from chladni.drives.methods import METHODS
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.scorecard import Scorecard, score, score_field
from chladni.drives.solve import Solution, solve

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
