"""A board's file, and its table, for foam that was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from chladni.host.cli.common.options import BoardArgument, JsonOption, LargeOption
from chladni.host.cli.common.output import answer, check_output, progress_bar
from chladni.host.cli.common.ranges import within
from chladni.sim.board.file import MOST_BYTES, file_of, load_board, parse_board, shipped_boards
from chladni.sim.board.quantity import MM
from chladni.sim.board.writing import refitted
from chladni.sim.errors import MissingError
from chladni.sim.files import read_text, write_whole
from chladni.tables.format import pack
from chladni.tables.several_fingers.build_for import build_for

LEAST, MOST = 0.1, 20.0


def board_refit(
    board: BoardArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Board file to write (.toml).")],
    foam: Annotated[
        float,
        typer.Option(
            callback=within(LEAST, MOST, "times as stiff"),
            help="Measured stiffness of the foam over that of the board file.",
        ),
    ],
    table: Annotated[Path | None, typer.Option(help="Also build its table (.chl).")] = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write a board, and its table, for foam whose stiffness was measured."""
    path = file_of(board, shipped_boards(), "board", "a board file")
    check_output(output, "-o", (".toml",))
    if table is not None:
        check_output(table, "--table", inputs=[path])
    loaded = load_board(board)
    if loaded.foundation is None or not loaded.foundation.sheet_stiffness:
        raise MissingError("foundation", "a sheet of foam, whose stiffness was measured")
    text = read_text(path, "board", MOST_BYTES, "a board file", encoding="utf-8-sig")
    ratio = foam * loaded.foundation.measured_ratio
    written = refitted(text, ratio)
    own = parse_board(written.decode(), file=str(output))
    assert own.foundation is not None
    result = {
        "path": str(output),
        "stiffness_ratio": ratio,
        "stiffness_n_per_mm3": own.foundation.total_stiffness * MM**3,
    }
    if table is not None:
        with progress_bar("solving") as progress:
            found, _, _ = build_for(own, progress=progress, allow_unmet=True)
        data = pack(found)
        write_whole(table, data)
        result |= {"table": str(table), "bytes": len(data)}
    write_whole(output, written)
    answer(result, as_json=as_json, title=f"{own.name}: on the foam that was measured")
