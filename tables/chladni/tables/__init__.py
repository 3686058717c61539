"""The drive of every place: drive tables, packed and read."""

from chladni.tables.build import build_table
from chladni.tables.format import pack, read_table, unpack
from chladni.tables.report import TableReport
from chladni.tables.table import Section, Table

__all__ = [
    "Section",
    "Table",
    "TableReport",
    "build_table",
    "pack",
    "read_table",
    "unpack",
]
