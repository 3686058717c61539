"""`chladni table`: show, verify, score, diff and export drive tables; table_build.py builds."""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from chladni.drives.methods import SEED
from chladni.drives.objectives import default_objective
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.felt import felt, remark_on, remedy
from chladni.drives.scoring.scorecard import focusing_objective
from chladni.drives.scoring.survey import SAMPLES
from chladni.drives.solve import turned
from chladni.host.cli.common.command_group import CommandGroup
from chladni.host.cli.common.drive_options import on_less_for
from chladni.host.cli.common.finger_remarks import say_tones
from chladni.host.cli.common.options import (
    FigureOption,
    JsonOption,
    LargeOption,
    PerturbedOption,
    SamplesOption,
    SeedOption,
    check_figure,
)
from chladni.host.cli.common.output import (
    Place,
    answer,
    check_output,
    parse_place,
    progress_bar,
    say,
    say_unmet,
    write_figure,
)
from chladni.host.cli.common.ranges import PITCHES, TABLE_FREQUENCIES
from chladni.host.cli.common.verdicts import of_places
from chladni.host.cli.table_build import build
from chladni.host.emulation.table_score import PITCH, score_table
from chladni.sim.board.board import fingerprint_text
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.files import write_whole
from chladni.tables.format import read_table, read_table_bytes, unpack
from chladni.tables.inspection.difference import difference
from chladni.tables.inspection.drives_csv import drives_as_csv
from chladni.tables.inspection.owner import board_for, known_board
from chladni.tables.inspection.verify import verify_table
from chladni.tables.layout import DRIVES_MINOR, RESPONSES, VERSION_MAJOR, VERSION_MINOR
from chladni.tables.responses import METRE_PM, TableResponses
from chladni.tables.table import ResponsesSection, Section, Table

TableArgument = Annotated[Path, typer.Argument(metavar="TABLE", help="Table file (.chl).")]


table_app = typer.Typer(cls=CommandGroup, help="Build and read drive tables.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.add_typer(table_app, name="table")


def show(
    table: TableArgument,
    at: Annotated[str | None, typer.Option(help="Show the drive for X,Y (mm).")] = None,
    frequency: Annotated[
        float | None,
        typer.Option(
            callback=TABLE_FREQUENCIES, help="Of the section to show, Hz; the first by default."
        ),
    ] = None,
    board: Annotated[
        str | None,
        typer.Option(help="The table's board, if not shipped nor beside it: what a finger feels."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a table's header, or what the device plays and knows at a place."""
    data = read_table_bytes(table)
    loaded = unpack(data, file=str(table))
    section, known = loaded.sections_at(frequency)
    grid = loaded.grid
    result: dict[str, Any] = {
        "version": f"{VERSION_MAJOR}.{VERSION_MINOR if loaded.responses else DRIVES_MINOR}",
        "board_name": loaded.board_name,
        "board_fingerprint": f"{loaded.board_fingerprint:#018x}",
        **_header(section, known),
        "frequencies_hz": [one.frequency_hz for one in loaded.sections],
        "responses_hz": [one.frequency_hz for one in loaded.responses],
        "actuators": loaded.actuators,
        "columns": grid.columns,
        "rows": grid.rows,
        "regions": grid.count,
        "size_mm": [grid.width_um / 1000.0, grid.length_um / 1000.0],
        "stored_regions": loaded.regions.count,
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
        if section is not None:
            result |= _drive_at(loaded, section, place, board, file=str(table))
        if known is not None:
            result |= _responses_at(TableResponses(loaded.regions, known), place)
    if not as_json:
        result["board_fingerprint"] = fingerprint_text(loaded.board_fingerprint)
        result["board_name"] = _named(loaded, board, file=str(table))
        result = {key: value for key, value in result.items() if value != []}
    answer(result, as_json=as_json, title=str(table))


def _named(table: Table, board: str | None, *, file: str) -> str:
    """A table's board, and how its values are known; a table shows without its board, too."""
    with suppress(InputError):
        return f"{table.board_name}, {board_for(table, board, file=file).known_as}"
    return table.board_name


def _header(section: Section | None, known: ResponsesSection | None) -> dict[str, Any]:
    """What the headers of the sections say."""
    result: dict[str, Any] = {}
    if known is not None:
        result |= {
            "frequency_hz": known.frequency_hz,
            "objective": RESPONSES,
            "full_scale_um_per_n": known.full_scale_pm / METRE_PM * 1e6,
            "own_full_scale_um_per_n": known.own_full_scale_pm / METRE_PM * 1e6,
            "full_force_n": known.finger.full_force_un / 1e6,
            "threshold_um": known.finger.threshold_pm / 1e6,
        }
    if section is not None:
        result |= {
            "frequency_hz": section.frequency_hz,
            "objective": section.objective,
            "full_scale_gain": section.full_scale_gain,
            "labels": len(section.crossings),
        }
    return result


def _responses_at(known: TableResponses, place: Place) -> dict[str, Any]:
    """What each coil does at a place, and a fingertip there by its own push."""
    at = np.array([place]) * MM
    own = known.own_at(at)[0]
    return {
        "responses": [
            {
                "channel": k,
                "response_um_per_n": float(abs(c)) * 1e6,
                "phase_deg": float(np.degrees(np.angle(c))),
            }
            for k, c in enumerate(known.at(at)[0])
        ],
        "own_um_per_n": float(abs(own)) * 1e6,
        "own_phase_deg": float(np.degrees(np.angle(own))),
    }


def _drive_at(
    table: Table, section: Section, place: Place, board: str | None, *, file: str
) -> dict[str, Any]:
    """The drive for a place, and what a finger there feels, where the table's board is known.

    Its phases are then those of `chladni solve`: the place itself moves in phase 0.
    """
    drive = table.drive_at(section, *(round(value * 1000.0) for value in place))
    known: dict[str, Any] = {}
    if board is None and known_board(table, file) is None:
        sys.stderr.write(
            "chladni: --board says what a finger feels; the board is not shipped, "
            "and phases are as the table has them\n"
        )
    else:
        owner = board_for(table, board, file=file)
        problem = solved_board(owner).at_frequency(section.frequency_hz).problem(place)
        drive = turned(problem, drive)
        remark = remark_on(problem, drive)
        if remark:
            remark += " " + remedy(focusing_objective(problem))
        known = asdict(felt(problem, drive)) | {"remark": remark}
    entries = [
        {"channel": k, "gain": float(abs(c)), "phase_deg": float(np.degrees(np.angle(c)))}
        for k, c in enumerate(drive)
    ]
    return {"drive": entries} | known


def verify(
    table: TableArgument,
    board: Annotated[
        str | None, typer.Option(help="The table's board, if not shipped nor beside it.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Check a table: its bytes, its board, and the firmware's drive at every place."""
    result = asdict(verify_table(table, board)) | {"verified": True}
    answer(result, as_json=as_json, title=f"{table}: bytes, board and the firmware's reading agree")


def score(
    table: TableArgument,
    board: Annotated[
        str | None, typer.Option(help="The table's board, if not shipped nor beside it.")
    ] = None,
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
    if not loaded.sections:
        expected, hint = "drives to score", "`chladni fingers BOARD --table FILE` scores responses"
        raise InputError("sections", RESPONSES, expected, file=str(table), hint=hint)
    owner = on_less_for(loaded, board_for(loaded, board, file=str(table)))
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
    own = default_objective(owner)
    if found.objective != own:
        say(
            f"the table's drives are best at {found.objective}, and {owner.name} is for {own}: "
            "`chladni table build` without --objective makes them so"
        )
    verdict = of_places(
        found,
        frequency_hz=found.frequency_hz,
        built=found.perturbed,
        click=found.click_20mm_db,
    )
    if figure is not None:
        from chladni.host.figures.boards import score_figure  # noqa: PLC0415

        write_figure(score_figure(owner, found, verdict), figure)
    result = {"name": owner.name, "verdict": verdict} | asdict(found)
    del result["maps"]
    answer(result, as_json=as_json, title=f"{table}: what the pins make of it on {owner.name}")
    if owner.focus is not None and owner.coil is not None:
        say_tones(board or owner.name, owner, table)


def diff(
    first: TableArgument,
    second: Annotated[Path, typer.Argument(metavar="OTHER", help="Another table.")],
    as_json: JsonOption = False,
) -> None:
    """Compare two tables: header fields, and drives (up to their phase) and responses of both."""
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
    check_output(output, "--csv", inputs=[table])
    loaded = read_table(table)
    write_whole(output, drives_as_csv(loaded))
    rows = len(loaded.sections) * loaded.grid.count * loaded.actuators
    answer({"path": str(output), "rows": rows}, as_json=as_json, title=f"Drives of {table}")


for command in (build, show, verify, score, diff, export):
    table_app.command()(command)
