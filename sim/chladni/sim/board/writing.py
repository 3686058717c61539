"""Boards as the files that `load_board` reads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import tomlkit

from chladni.sim.board.board import Board, to_document

CHOICES = ("pwm_pins", "focus", "fingers")
"""No pins, and blocks that say by being there what tables are for."""
LEFT_OUT = "A key that is not here has its default: boards/template.toml explains them all."


def board_file(board: Board, about: Sequence[str] = ()) -> bytes:
    """A board's file, with lines of comment on top."""
    head = "".join(f"# {line}\n" for line in (*about, LEFT_OUT))
    text = tomlkit.dumps(_without_empty(to_document(board)))
    return f"{head}\n{text}".encode()


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
