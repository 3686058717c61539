"""A piece of TOML from a page is put into a shipped board file, or SPEC, and read as such."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import tomlkit

from chladni.design.evaluate import completed_board, document_of
from chladni.design.spec import spec_of
from chladni.sim.board.file import board_from_document, load_board
from chladni.sim.errors import ChladniError

BOARD = "strip5.toml"
SPEC = "specs/strip.toml"
OPEN = ({"from", "to"}, {"any"})


def piece_problem(text: str, boards: Path) -> str:
    """What is wrong with a piece: it is no TOML, or the file with it in is refused."""
    try:
        piece = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        return f"no TOML: {error}"
    is_spec = "design" in piece or leaves_open(piece)
    document = tomllib.loads((boards / (SPEC if is_spec else BOARD)).read_text("utf-8"))
    try:
        (_read_spec if is_spec else board_from_document)(merged(document, piece))
    except ChladniError as error:
        return str(error)
    return ""


def put_into(board: Path, text: str) -> str:
    """Write a piece's values into a board file; what is wrong with it then, or nothing."""
    document = merged(tomllib.loads(board.read_text("utf-8")), tomllib.loads(text))
    board.write_text(tomlkit.dumps(document), "utf-8")
    try:
        load_board(board)
    except ChladniError as error:
        return str(error)
    return ""


def leaves_open(value: object) -> bool:
    """Whether a value, or one within it, is for a design to choose."""
    if isinstance(value, dict):
        return value.keys() in OPEN or any(leaves_open(one) for one in value.values())
    return value == "free"


def _read_spec(document: dict[str, Any]) -> None:
    """The question, and one board of those that it leaves open: the first of all values."""
    spec = spec_of(document)
    count = spec.coils[0] if spec.places_are_free else 0
    spacing_mm = 1.05e3 * spec.settings.coil_spacing
    places = [(0.0, spacing_mm * (k - (count - 1) / 2.0)) for k in range(count)]
    completed_board(document_of(spec, [0.0] * len(spec.variables), places or None))


def merged(document: dict[str, Any], piece: dict[str, Any]) -> dict[str, Any]:
    """A document with the values of a piece in place of its own."""
    result = dict(document)
    for key, new in piece.items():
        own = result.get(key)
        if isinstance(own, dict) and isinstance(new, dict) and own.keys() not in OPEN:
            result[key] = merged(own, new)
        else:
            result[key] = new
    return result
