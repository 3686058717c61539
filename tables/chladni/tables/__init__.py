"""Drives and drive tables: find the best drive for a place, and pack one for every place."""

from chladni.tables.build import TableReport, build_table
from chladni.tables.format import pack, read_table, unpack
from chladni.tables.methods import METHODS
from chladni.tables.objectives import OBJECTIVES
from chladni.tables.scene import scene_of
from chladni.tables.scorecard import Scorecard, score, score_field
from chladni.tables.solve import Solution, solve
from chladni.tables.table import Section, Table

__all__ = [
    "METHODS",
    "OBJECTIVES",
    "Scorecard",
    "Section",
    "Solution",
    "Table",
    "TableReport",
    "build_table",
    "pack",
    "read_table",
    "scene_of",
    "score",
    "score_field",
    "solve",
    "unpack",
]
