"""The drive of every place: drive tables, packed and read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chladni.sim.lazy_names import lazy_names

if TYPE_CHECKING:
    from chladni.tables.build import build_table
    from chladni.tables.format import pack, read_table, unpack
    from chladni.tables.inspection.difference import TableDifference, difference
    from chladni.tables.inspection.drives_csv import drives_as_csv
    from chladni.tables.inspection.owner import board_for
    from chladni.tables.inspection.verify import Verification, verify_table
    from chladni.tables.report import TableReport
    from chladni.tables.table import Section, Table

_PLACES = {
    "build": ("build_table",),
    "format": (
        "pack",
        "read_table",
        "unpack",
    ),
    "inspection.difference": (
        "TableDifference",
        "difference",
    ),
    "inspection.drives_csv": ("drives_as_csv",),
    "inspection.owner": ("board_for",),
    "inspection.verify": (
        "Verification",
        "verify_table",
    ),
    "report": ("TableReport",),
    "table": (
        "Section",
        "Table",
    ),
}

__all__ = [
    "Section",
    "Table",
    "TableDifference",
    "TableReport",
    "Verification",
    "board_for",
    "build_table",
    "difference",
    "drives_as_csv",
    "pack",
    "read_table",
    "unpack",
    "verify_table",
]

__getattr__ = lazy_names(__name__, _PLACES)
