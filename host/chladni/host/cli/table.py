"""`chladni table`: build, show, verify, score, diff and export drive tables."""

from __future__ import annotations

import csv
import io
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from chladni.drives.methods import SEED
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.finger import felt, remark_on
from chladni.drives.scoring.survey import SAMPLES
from chladni.drives.solve import check_request, turned
from chladni.host.cli.common.options import (
    PARTIAL,
    BoardArgument,
    FigureOption,
    JobsOption,
    JsonOption,
    LargeOption,
    OwnObjectiveOption,
    PerturbedOption,
    SamplesOption,
    SchedulerOption,
    SeedOption,
    check_figure,
    check_jobs,
    check_samples,
)  # fmt: skip
from chladni.host.cli.common.output import (
    Place,
    answer,
    check_output,
    parse_place,
    progress_bar,
    say_unmet,
    write_figure,
)
from chladni.host.emulation.closed_loop import board_of
from chladni.host.emulation.table_score import PITCH, score_table
from chladni.host.figures.boards import score_figure
from chladni.sim.board.file import load_board, shipped_boards
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ChladniError, InputError
from chladni.sim.fields.board_mirrors import board_mirrors
from chladni.sim.fields.transfer import TOLERANCE
from chladni.sim.files import write_whole
from chladni.tables.between_regions import OWN_TOLERANCE
from chladni.tables.build import build_table
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import pack, read_table, read_table_bytes, unpack
from chladni.tables.layout import BITS, VERSION_MAJOR, VERSION_MINOR, one_of_bits
from chladni.tables.table import Section, Table

TableArgument = Annotated[Path, typer.Argument(metavar="TABLE", help="Table file (.chl).")]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(build)
    for command in (show, verify, score, diff, export):
        app.command()(command)


def build(
    board: BoardArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Table to write (.chl).")],
    objective: OwnObjectiveOption = None,
    frequency: Annotated[
        list[float] | None,
        typer.Option(help="Drive frequency, Hz; again for more sections. The board's by default."),
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
    check_jobs(jobs)
    if objective is not None:
        check_request("phasor", objective, seed, None, None)
    if bits is not None and bits not in BITS:
        raise InputError("--bits", bits, one_of_bits())
    loaded = load_board(board)
    partial = output.with_name(output.name + PARTIAL)
    with progress_bar("solving", keeps=True) as progress:
        table, report = build_table(
            loaded, objective=objective, frequencies_hz=frequency or (), bits=bits, seed=seed,
            jobs=jobs, progress=progress, partial=partial, scheduler=scheduler,
            allow_unmet=True,
        )  # fmt: skip
    write_whole(output, pack(table))
    say_unmet(report.error_estimate, OWN_TOLERANCE)
    if not report.is_within_limits:
        typer.echo(f"warning: integers of {report.bits} bits lose {report.lost}", err=True)
    answer(asdict(report), as_json=as_json, title=f"Table {output} for {loaded.name}")


def show(
    table: TableArgument,
    at: Annotated[str | None, typer.Option(help="Show the drive for X,Y (mm).")] = None,
    frequency: Annotated[
        float | None, typer.Option(help="Of the drives to show, Hz; the first by default.")
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
        sys.stderr.write("chladni: --board says what a finger feels; the board is not shipped, "
                         "and phases are as the table has them\n")  # fmt: skip
    else:
        owner = board_of(table, board, file=file)
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
    # Read once: what is checked is what was unpacked.
    data = read_table_bytes(table)
    loaded = unpack(data, file=str(table))
    owner = board_of(loaded, board, file=str(table))
    mirrors = board_mirrors(owner)
    for name, own, found in (
        ("mirror_x", loaded.symmetry.x, mirrors.x), ("mirror_y", loaded.symmetry.y, mirrors.y),
    ):  # fmt: skip
        if own is not None and own != found:
            raise InputError(name, own, f"{found}, the board's own", file=str(table))
    checked = 0
    firmware = FirmwareReader(data, loaded.actuators)
    x_um, y_um = _everywhere(loaded)
    for number, section in enumerate(loaded.sections):
        played = firmware.integers(section.frequency_hz, x_um, y_um)
        if not np.array_equal(played, loaded.lookup(section, x_um, y_um)):
            raise ChladniError(
                f"{table}: section {number}: the firmware plays other drives",
                hint="build the table again with this version",
            )
        checked += x_um.size
    result = {
        "board": owner.name,
        "regions": loaded.grid.count,
        "sections": len(loaded.sections),
        "places_checked": checked,
        "bytes": len(data),
        "verified": True,
    }
    answer(result, as_json=as_json, title=f"{table}: bytes, board and the firmware's reading agree")


def score(
    table: TableArgument,
    board: Annotated[str | None, typer.Option(help="The table's board, if not shipped.")] = None,
    pitch: Annotated[
        float, typer.Option(help="Between places, mm; those half-way between are added.")
    ] = PITCH / MM,
    frequency: Annotated[
        float | None, typer.Option(help="Of the drives, Hz; the table's first by default.")
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
    check_samples(samples)
    data = read_table_bytes(table)
    loaded = unpack(data, file=str(table))
    owner = board_of(loaded, board, file=str(table))
    with progress_bar("boards") as progress:
        found = score_table(
            loaded, owner, size=len(data), pitch=pitch * MM, frequency_hz=frequency,
            samples=samples if perturbed else 0, seed=seed, progress=progress,
        )  # fmt: skip
    say_unmet(found.error_estimate, TOLERANCE)
    if figure is not None:
        write_figure(score_figure(owner, found), figure)
    result = {"name": owner.name} | asdict(found)
    del result["maps"]
    answer(result, as_json=as_json, title=f"{table}: what the pins make of it on {owner.name}")


def _everywhere(table: Table) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places on a lattice four times as fine as the regions, and a little beyond the board."""
    grid = table.grid
    spans = ((grid.width_um, grid.columns), (grid.length_um, grid.rows))
    x, y = (np.linspace(-0.55, 0.55, 4 * cells + 3) * span for span, cells in spans)
    lattice = np.meshgrid(np.rint(x), np.rint(y))
    x_um, y_um = (np.ascontiguousarray(axis.ravel(), dtype=np.int64) for axis in lattice)
    return x_um, y_um


def diff(
    first: TableArgument,
    second: Annotated[Path, typer.Argument(metavar="OTHER", help="Another table.")],
    as_json: JsonOption = False,
) -> None:
    """Compare two tables: header fields, and drives of a frequency both have, up to their phase."""
    one, other = read_table(first), read_table(second)
    left, right = _header(one), _header(other)
    fields = {key: [left[key], right[key]] for key in left if left[key] != right[key]}
    result: dict[str, Any] = {
        "header": fields, "compared_hz": None, "regions_that_differ": None, "largest": None,
    }  # fmt: skip
    frequencies = {section.frequency_hz for section in other.sections}
    common = [
        section.frequency_hz for section in one.sections if section.frequency_hz in frequencies
    ]
    if one.grid == other.grid and one.actuators == other.actuators and common:
        result["compared_hz"] = common[0]
        pair = [(table, table.section(common[0])) for table in (one, other)]
        drives = [table.drives(own) / own.full_scale_gain for table, own in pair]
        steps = [_step(*both) for both in zip(*drives, strict=True)]
        result["regions_that_differ"] = int(np.count_nonzero(np.array(steps) > SAME))
        result["largest"] = float(max(steps))
        result["largest_at_region"] = int(np.argmax(steps))
    answer(result, as_json=as_json, title=f"{first} and {second}")


SAME = 1e-6
"""Drives closer than this, of full scale, are the same but for rounding."""


def _step(one: np.ndarray[Any, Any], other: np.ndarray[Any, Any]) -> float:
    """Largest difference of two drives, the common phase that suits them best taken out."""
    turn = np.vdot(other, one)
    turned = other * (turn / abs(turn)) if abs(turn) > 0.0 else other
    return float(np.abs(one - turned).max())


def _header(table: Table) -> dict[str, Any]:
    return {
        "board_name": table.board_name,
        "board_fingerprint": f"{table.board_fingerprint:#018x}",
        "actuators": table.actuators,
        **asdict(table.grid),
        **asdict(table.limits),
        "mirror_x": table.symmetry.x and list(table.symmetry.x),
        "mirror_y": table.symmetry.y and list(table.symmetry.y),
        "frequencies_hz": [section.frequency_hz for section in table.sections],
        "objectives": [section.objective for section in table.sections],
        "full_scale_gains": [section.full_scale_gain for section in table.sections],
        "labels": [len(section.crossings) for section in table.sections],
        "bits": table.bits,
    }


def export(
    table: TableArgument,
    output: Annotated[Path, typer.Option("--csv", help="File to write: a row per channel.")],
    as_json: JsonOption = False,
) -> None:
    """Write every drive of a table as CSV: frequency, region, place, channel, gain and phase."""
    check_output(output, "--csv")
    loaded = read_table(table)
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer)
    writer.writerow(["frequency_hz", "region", "x_mm", "y_mm", "channel", "gain", "phase_deg"])
    for section in loaded.sections:
        for region, drive in enumerate(loaded.drives(section)):
            x, y = loaded.grid.centre_mm(region)
            for channel, c in enumerate(drive):
                gain, phase = abs(c), float(np.degrees(np.angle(c)))
                writer.writerow(
                    [f"{section.frequency_hz:g}", region, f"{x:.4f}", f"{y:.4f}", channel,
                     f"{gain:.6g}", f"{phase:.4f}"]
                )  # fmt: skip
    write_whole(output, buffer.getvalue().encode())
    rows = len(loaded.sections) * loaded.grid.count * loaded.actuators
    answer({"path": str(output), "rows": rows}, as_json=as_json, title=f"Drives of {table}")
