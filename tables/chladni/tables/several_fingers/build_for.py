"""Build the table that a board is for: drives of one finger, responses for several, or both."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from chladni.drives.methods import SEED, Progress
from chladni.sim.board.board import Board
from chladni.sim.errors import ArgumentError, ConflictError
from chladni.tables.build import build_table
from chladni.tables.report import TableReport
from chladni.tables.several_fingers.build import (
    ResponsesReport,
    responses_table,
    with_responses,
)
from chladni.tables.table import Table

KINDS = ("finger", "fingers", "both")
"""Drives of one finger alone; responses, of which a device makes drives for the fingers that are
there; both."""


def default_kind(board: Board, objective: str | None = None) -> str:
    """What a board's table has unless something else is asked for.

    `fingers` on a board whose file has a `[fingers]` block, `both` where it has `[focus]` too, or
    drives are asked to be best at something.
    """
    if board.fingers is None:
        return "finger"
    return "fingers" if board.focus is None and objective is None else "both"


def build_for(
    board: Board,
    kind: str | None = None,
    *,
    objective: str | None = None,
    seed: int = SEED,
    frequencies_hz: Sequence[float] = (),
    bits: int | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
    partial: Path | None = None,
    scheduler: str | None = None,
    allow_unmet: bool = False,
) -> tuple[Table, TableReport | None, ResponsesReport | None]:
    """Build a table of a kind; all else as of `build_table`, whose frequencies responses have too.

    Parameters
    ----------
    kind
        One of `KINDS`; by default the board's.

    Raises
    ------
    InputError
        There is no such kind, or it has no drives and these are to be best at something; all that
        `build_table` and `responses_table` raise.
    """
    kind = default_kind(board, objective) if kind is None else kind
    if kind not in KINDS:
        raise ArgumentError("kind", kind, f"one of: {', '.join(KINDS)}")
    if kind == "fingers":
        if objective is not None:
            raise ConflictError("objective", "responses alone", hint="they serve any drive")
        table, responses = responses_table(
            board,
            frequencies_hz=frequencies_hz,
            bits=bits,
            progress=progress,
            allow_unmet=allow_unmet,
        )
        return table, None, responses
    table, drives = build_table(
        board,
        objective=objective,
        seed=seed,
        frequencies_hz=frequencies_hz,
        bits=bits,
        jobs=jobs,
        progress=progress,
        partial=partial,
        scheduler=scheduler,
        allow_unmet=allow_unmet,
    )
    if kind == "finger":
        return table, drives, None
    both, responses = with_responses(
        table,
        board,
        frequencies_hz=frequencies_hz,
        bits=bits,
        progress=progress,
        allow_unmet=allow_unmet,
    )
    return both, drives, responses
