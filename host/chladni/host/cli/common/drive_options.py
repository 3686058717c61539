"""Arguments of commands that look for drives; the others need not load every method."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from chladni.drives.methods import METHODS
from chladni.drives.objectives import OBJECTIVES, objective_of
from chladni.drives.problem.search_cost import for_focus
from chladni.host.cli.common.output import say
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import Focus
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ConflictError
from chladni.tables.table import Table

MethodOption = Annotated[str, typer.Option(help="One of: " + ", ".join(METHODS) + ".")]
OwnObjectiveOption = Annotated[
    str | None,
    typer.Option(
        "--objective",
        help="What the drives optimise: " + ", ".join(OBJECTIVES) + ". By default focus "
        "on a board whose file has [focus] or [fingers], else ssim.",
    ),
]
QuieterFromOption = Annotated[
    float | None, typer.Option(help="focus: mm from which a second finger gets less.")
]
QuieterOption = Annotated[float | None, typer.Option(help="focus: how much less at least, dB.")]
SilentFromOption = Annotated[
    float | None, typer.Option(help="focus: mm from which it gets as little as possible.")
]
FloorOption = Annotated[
    float | None, typer.Option(help="focus: µm under the finger at least, at the coils' limit.")
]


def with_focus(
    board: Board,
    objective: str | None,
    method: str,
    *,
    quieter_from_mm: float | None,
    quieter_db: float | None,
    silent_from_mm: float | None,
    floor_um: float | None,
) -> tuple[Board, str]:
    """A board with the demands of its focus replaced by those of the options, and the objective.

    Without an objective it is the board's own.

    Raises
    ------
    InputError
        A value is out of its range, or the zones are not in order.
    ConflictError
        Drives are asked to be best at something else.
    """
    given: dict[str, float] = {}
    if quieter_from_mm is not None:
        given["quieter_from"] = quieter_from_mm * MM
    if quieter_db is not None:
        given["quieter_db"] = quieter_db
    if silent_from_mm is not None:
        given["silent_from"] = silent_from_mm * MM
    if floor_um is not None:
        given["floor_um"] = floor_um
    objective = objective or objective_of(board, method)
    if objective == "focus":
        board = on_less(board)
    if not given:
        return board, objective
    if objective != "focus":
        raise ConflictError(
            "--quieter-from-mm, --quieter-db, --silent-from-mm or --floor-um",
            f"--objective {objective}",
            hint="they are of --objective focus",
        )
    return replace(board, focus=replace(board.focus or Focus(), **given)), objective


def on_less_for(table: Table, board: Board) -> Board:
    """The same for what a table plays on its board: drives for an image need all of it."""
    is_of_images = any(section.objective != "focus" for section in table.sections)
    return board if is_of_images else on_less(board)


def on_less(board: Board) -> Board:
    """With an image that a focus needs; says so where it is not the board's own."""
    less = for_focus(board)
    if less is not board:
        own, used = (" × ".join(map(str, one.image.points)) for one in (board, less))
        say(f"a finger needs no image of {own} points: {used} are used")
    return less
