"""`chladni table build`: a board's table, of drives, of responses, or of both."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.drives.checkpoint import remove_checkpoint
from chladni.drives.methods import SEED
from chladni.drives.problem.problem import TOGETHER
from chladni.drives.solve import check_request
from chladni.host.cli.common.drive_options import OwnObjectiveOption
from chladni.host.cli.common.finger_remarks import say_worse
from chladni.host.cli.common.options import (
    PARTIAL,
    BoardArgument,
    JobsOption,
    JsonOption,
    LargeOption,
    SchedulerOption,
    SeedOption,
)
from chladni.host.cli.common.output import answer, check_output, progress_bar, say_unmet
from chladni.host.cli.common.ranges import TABLE_FREQUENCIES
from chladni.host.cli.common.table_verdicts import of_responses, of_table
from chladni.sim.board.file import file_of, load_board, shipped_boards
from chladni.sim.errors import ConflictError, InputError
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.files import write_whole
from chladni.tables.format import pack
from chladni.tables.halfway_points import OWN_TOLERANCE
from chladni.tables.layout import BITS, one_of_bits
from chladni.tables.report import TableReport
from chladni.tables.several_fingers.build import ResponsesReport
from chladni.tables.several_fingers.build_for import KINDS, build_for
from chladni.tables.several_fingers.isolation import LIMIT_DB


def build(
    board: BoardArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Table to write (.chl).")],
    kind: Annotated[
        str | None,
        typer.Option(
            "--for",
            help="One finger alone (drives), several (responses), or both: finger, fingers, both. "
            "By default finger; with a block [fingers] in the board file fingers, or both with "
            "[focus] too.",
        ),
    ] = None,
    objective: OwnObjectiveOption = None,
    frequency: Annotated[
        list[float] | None,
        typer.Option(
            callback=TABLE_FREQUENCIES,
            help="Drive frequency, Hz; again for more sections. The board's by default.",
        ),
    ] = None,
    bits: Annotated[
        int | None,
        typer.Option(
            help="Of each stored integer: 8, 12 or 16. By default the fewest that lose little."
        ),
    ] = None,
    seed: SeedOption = SEED,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Solve every region of a board and pack the drives, or what coils do there, into a table."""
    check_output(output, "-o", inputs=[file_of(board, shipped_boards(), "board", "a board file")])
    if output.suffix in (".toml", ".che"):
        raise InputError("-o", str(output), "a name for a table, as in board.chl")
    if kind is not None and kind not in KINDS:
        raise InputError("--for", kind, f"one of: {', '.join(KINDS)}")
    if objective is not None:
        check_request("phasor", objective, seed, None, None)
        if kind == "fingers":
            raise ConflictError("--objective", "--for fingers", hint="responses serve any drive")
    if bits is not None and bits not in BITS:
        raise InputError("--bits", bits, one_of_bits())
    loaded = load_board(board)
    say_worse(loaded)
    partial = output.with_name(output.name + PARTIAL)
    with progress_bar("solving", kept=partial, batch=TOGETHER) as progress:
        table, drives, responses = build_for(
            loaded,
            kind,
            objective=objective,
            frequencies_hz=frequency or (),
            bits=bits,
            seed=seed,
            jobs=jobs,
            progress=progress,
            partial=partial,
            scheduler=scheduler,
            allow_unmet=True,
        )
    write_whole(output, pack(table))
    remove_checkpoint(partial)
    verdict = {"verdict": _verdict(drives, responses)}
    answer(
        verdict | _told(drives, responses),
        as_json=as_json,
        title=f"Table {output} for {loaded.name}",
    )


def _verdict(drives: TableReport | None, responses: ResponsesReport | None) -> str:
    told = []
    if drives is not None:
        own = drives.fingers
        told.append(
            of_table(
                drives.objective,
                own.looks_better_than_it_is,
                own.places,
                second_finger_db=own.second_finger_20mm_db.median,
                for_fingers=responses is not None,
            )
        )
    if responses is not None:
        told.append(of_responses(responses, with_drives=drives is not None))
    return " ".join(told)


def _told(drives: TableReport | None, responses: ResponsesReport | None) -> dict[str, Any]:
    """Both reports in one, and warnings of what they fall short of on stderr."""
    result: dict[str, Any] = {}
    if drives is not None:
        say_unmet(drives.error_estimate, OWN_TOLERANCE)
        if not drives.is_within_limits:
            typer.echo(f"warning: integers of {drives.bits} bits lose {drives.lost}", err=True)
        result |= asdict(drives)
    if responses is not None:
        say_unmet(responses.error_estimate, TOLERANCE)
        if not responses.is_within_limits:
            lost = f"{responses.isolation_lost_db:.2f} dB of isolation (limit {LIMIT_DB:g})"
            typer.echo(f"warning: responses of {responses.bits} bits lose {lost}", err=True)
        of_both = {"bits": responses.bits, "bytes": responses.bytes}
        result |= of_both if drives is not None else {}
        result |= {"responses": asdict(responses)} if drives is not None else asdict(responses)
    return result
