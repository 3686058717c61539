"""Boards as the files that `load_board` reads."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

import tomlkit

from chladni.sim.board.board import Board, to_document

CHOICES = ("pwm_pins", "focus", "fingers")
"""No pins, and blocks that say by being there what tables are for."""
MEASURED_DIGITS = 5
"""Significant: no value of a board is measured to 0.01 %."""
LEFT_OUT = "A key that is not here has its default: boards/template.toml explains them all."


def board_file(board: Board, about: Sequence[str] = ()) -> bytes:
    """A board's file, with lines of comment on top."""
    return _file(to_document(board), about)


def measured_file(drawn: Board, measured: Board, about: Sequence[str] = ()) -> bytes:
    """A measured board's file: what differs from the drawn board has `MEASURED_DIGITS`."""
    return _file(_rounded(to_document(measured), to_document(drawn)), about)


def _file(document: dict[str, Any], about: Sequence[str]) -> bytes:
    head = "".join(f"# {line}\n" for line in (*about, LEFT_OUT))
    return f"{head}\n{tomlkit.dumps(_without_empty(document))}".encode()


def _rounded(value: Any, drawn: Any) -> Any:
    if value == drawn:
        return value
    if isinstance(value, dict):
        own = drawn if isinstance(drawn, dict) else {}
        return {k: _rounded(v, own.get(k)) for k, v in value.items()}
    if isinstance(value, list | tuple):
        parts = drawn if isinstance(drawn, list | tuple) else ()
        return [_rounded(*pair) for pair in zip_longest(value, parts[: len(value)])]
    return float(f"{value:.{MEASURED_DIGITS}g}") if isinstance(value, float) else value


def refitted(text: str, foam: float) -> bytes:
    """A board's file on foam that was measured, all else and its comments as they were.

    Drives are then for that foam and no stiffer one.

    Parameters
    ----------
    text
        The file.
    foam
        Its stiffness over that of its data sheet.
    """
    document = tomlkit.parse(text)
    document["foundation"]["stiffness_ratio"] = foam
    if "foam_ratio" in document.get("focus", {}):
        document["focus"]["foam_ratio"] = 1.0
    return tomlkit.dumps(document).encode()


def _without_empty(document: dict[str, Any]) -> dict[str, Any]:
    """What blocks and lists have nothing in them need not be written, unless they are a choice."""
    blocks = {k: _without_empty(v) if isinstance(v, dict) else v for k, v in document.items()}
    return {k: v for k, v in blocks.items() if v not in ({}, [], ()) or k in CHOICES}
