"""`chladni table`: build, show, verify, score, diff and export drive tables."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from chladni.drives.checkpoint import remove_checkpoint
from chladni.drives.methods import SEED
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.felt import felt, remark_on
from chladni.drives.scoring.survey import SAMPLES
from chladni.drives.solve import check_request, turned
from chladni.host.cli.common.command_group import CommandGroup
from chladni.host.cli.common.drive_options import OwnObjectiveOption
from chladni.host.cli.common.options import (
    PARTIAL,
    BoardArgument,
    FigureOption,
    JobsOption,
    JsonOption,
    LargeOption,
    PerturbedOption,
    SamplesOption,
    SchedulerOption,
    SeedOption,
    check_figure,
)
from chladni.host.cli.common.output import (
    Place,
    answer,
    check_output,
    parse_place,
    progress_bar,
    say_unmet,
    write_figure,
)
from chladni.host.cli.common.ranges import PITCHES, TABLE_FREQUENCIES
from chladni.host.emulation.table_score import PITCH, score_table
from chladni.sim.board.file import load_board, shipped_boards
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.files import write_whole
from chladni.tables.build import build_table
from chladni.tables.format import pack, read_table, read_table_bytes, unpack
from chladni.tables.halfway_points import OWN_TOLERANCE
from chladni.tables.inspection.difference import difference
from chladni.tables.inspection.drives_csv import drives_as_csv
from chladni.tables.inspection.owner import board_for
from chladni.tables.inspection.verify import verify_table
from chladni.tables.layout import BITS, VERSION_MAJOR, VERSION_MINOR, one_of_bits
from chladni.tables.table import Section, Table

TableArgument = Annotated[Path, typer.Argument(metavar="TABLE", help="Table file (.chl).")]


table_app = typer.Typer(cls=CommandGroup, help="Build and read drive tables.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.add_typer(table_app, name="table")


def build(
    board: BoardArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Table to write (.chl).")],
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
    """Solve every region of a board and pack the drives into a table."""
    check_output(output, "-o")
    if objective is not None:
        check_request("phasor", objective, seed, None, None)
    if bits is not None and bits not in BITS:
        raise InputError("--bits", bits, one_of_bits())
    loaded = load_board(board)
    partial = output.with_name(output.name + PARTIAL)
    with progress_bar("solving", kept=partial) as progress:
        table, report = build_table(
            loaded,
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
    say_unmet(report.error_estimate, OWN_TOLERANCE)
    if not report.is_within_limits:
        typer.echo(f"warning: integers of {report.bits} bits lose {report.lost}", err=True)
    answer(asdict(report), as_json=as_json, title=f"Table {output} for {loaded.name}")


def show(
    table: TableArgument,
    at: Annotated[str | None, typer.Option(help="Show the drive for X,Y (mm).")] = None,
    frequency: Annotated[
        float | None,
        typer.Option(
            callback=TABLE_FREQUENCIES, help="Of the drives to show, Hz; the first by default."
        ),
    ] = None,
    board: Annotated[
        str | None, typer.Option(help="The table's board, if not shipped: what a finger feels.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a table's header, or what the device plays at a place."""
    data = read_table_bytes(table)
    loaded = unpack(data, file=str(table))
    section = loaded.section(frequency)
    grid = loaded.grid
    result: dict[str, Any] = {
        "version": f"{VERSION_MAJOR}.{VERSION_MINOR}",
        "board_name": loaded.board_name,
        "board_fingerprint": f"{loaded.board_fingerprint:#018x}",
        "frequency_hz": section.frequency_hz,
        "objective": section.objective,
        "frequencies_hz": [one.frequency_hz for one in loaded.sections],
        "actuators": loaded.actuators,
        "columns": grid.columns,
        "rows": grid.rows,
        "regions": grid.count,
        "size_mm": [grid.width_um / 1000.0, grid.length_um / 1000.0],
        "full_scale_gain": section.full_scale_gain,
        "stored_regions": loaded.regions.count,
        "labels": len(section.crossings),
        "bits": loaded.bits,
        "bytes": len(data),
        **asdict(loaded.limits),
    }
    if at is not None:
        place = parse_place(at, "--at")
        limits = (grid.width_um / 2000.0, grid.length_um / 2000.0)
        if any(abs(value) > limit for value, limit in zip(place, limits, strict=True)):
            expected = f"a place on the board: |x| up to {limits[0]:g}, |y| up to {limits[1]:g}"
            raise InputError("--at", at, expected)
        x_um, y_um = (round(value * 1000.0) for value in place)
        region = grid.region_at(x_um, y_um)
        result["region"] = region
        result["region_centre_mm"] = list(grid.centre_mm(region))
        result |= _drive_at(loaded, section, place, board, file=str(table))
    answer(result, as_json=as_json, title=str(table))


def _drive_at(
    table: Table, section: Section, place: Place, board: str | None, *, file: str
) -> dict[str, Any]:
    """The drive for a place, and what a finger there feels, where the table's board is known.

    Its phases are then those of `chladni solve`: the place itself moves in phase 0.
    """
    drive = table.drive_at(section, *(round(value * 1000.0) for value in place))
    known: dict[str, Any] = {}
    if board is None and table.board_name not in shipped_boards():
        sys.stderr.write(
            "chladni: --board says what a finger feels; the board is not shipped, "
            "and phases are as the table has them\n"
        )
    else:
        owner = board_for(table, board, file=file)
        problem = solved_board(owner).at_frequency(section.frequency_hz).problem(place)
        drive = turned(problem, drive)
        known = asdict(felt(problem, drive)) | {"remark": remark_on(problem, drive)}
    entries = [
        {"channel": k, "gain": float(abs(c)), "phase_deg": float(np.degrees(np.angle(c)))}
        for k, c in enumerate(drive)
    ]
    return {"drive": entries} | known


def verify(
    table: TableArgument,
    board: Annotated[str | None, typer.Option(help="The table's board, if not shipped.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Check a table: its bytes, its board, and the firmware's drive at every place."""
    result = asdict(verify_table(table, board)) | {"verified": True}
    answer(result, as_json=as_json, title=f"{table}: bytes, board and the firmware's reading agree")


def score(
    table: TableArgument,
    board: Annotated[str | None, typer.Option(help="The table's board, if not shipped.")] = None,
    pitch: Annotated[
        float,
        typer.Option(
            callback=PITCHES, help="Between places, mm; those half-way between are added."
        ),
    ] = PITCH / MM,
    frequency: Annotated[
        float | None,
        typer.Option(
            callback=TABLE_FREQUENCIES, help="Of the drives, Hz; the table's first by default."
        ),
    ] = None,
    samples: SamplesOption = SAMPLES,
    perturbed: PerturbedOption = True,
    figure: FigureOption = None,
    seed: SeedOption = SEED,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Score a table like `board score`, from the pins of the emulated firmware."""
    check_figure(figure)
    data = read_table_bytes(table)
    loaded = unpack(data, file=str(table))
    owner = board_for(loaded, board, file=str(table))
    with progress_bar("boards") as progress:
        found = score_table(
            loaded,
            owner,
            size=len(data),
            pitch=pitch * MM,
            frequency_hz=frequency,
            samples=samples if perturbed else 0,
            border=True,
            seed=seed,
            progress=progress,
        )
    say_unmet(found.error_estimate, TOLERANCE)
    if figure is not None:
        from chladni.host.figures.boards import score_figure  # noqa: PLC0415

        write_figure(score_figure(owner, found), figure)
    result = {"name": owner.name} | asdict(found)
    del result["maps"]
    answer(result, as_json=as_json, title=f"{table}: what the pins make of it on {owner.name}")


def diff(
    first: TableArgument,
    second: Annotated[Path, typer.Argument(metavar="OTHER", help="Another table.")],
    as_json: JsonOption = False,
) -> None:
    """Compare two tables: header fields, and drives of a frequency both have, up to their phase."""
    result = asdict(difference(read_table(first), read_table(second)))
    if result["compared_hz"] is None:
        del result["largest_at_region"]
    answer(result, as_json=as_json, title=f"{first} and {second}")


def export(
    table: TableArgument,
    output: Annotated[Path, typer.Option("--csv", help="File to write: a row per channel.")],
    as_json: JsonOption = False,
) -> None:
    """Write every drive of a table as CSV: frequency, region, place, channel, gain and phase."""
    check_output(output, "--csv")
    loaded = read_table(table)
    write_whole(output, drives_as_csv(loaded))
    rows = len(loaded.sections) * loaded.grid.count * loaded.actuators
    answer({"path": str(output), "rows": rows}, as_json=as_json, title=f"Drives of {table}")


for command in (build, show, verify, score, diff, export):
    table_app.command()(command)
