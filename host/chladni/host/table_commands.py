"""`chladni table`: build, show, verify, diff and export drive tables."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from chladni.host.console import answer, check_output, parse_place, progress_bar
from chladni.host.emulator import Emulator
from chladni.host.loop import board_of
from chladni.host.options import (
    PARTIAL,
    BoardArgument,
    JobsOption,
    JsonOption,
    ObjectiveOption,
    SeedOption,
    check_jobs,
)  # fmt: skip
from chladni.sim.board_file import load_board
from chladni.sim.errors import ChladniError, InputError
from chladni.sim.files import write_whole
from chladni.sim.mirrors import board_mirrors
from chladni.tables.build import OBJECTIVE, build_table
from chladni.tables.format import Table, pack, read_table
from chladni.tables.methods import SEED
from chladni.tables.solve import check_request

TableArgument = Annotated[Path, typer.Argument(metavar="TABLE", help="Table file (.chl).")]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    for command in (build, show, verify, diff, export):
        app.command()(command)


def build(
    board: BoardArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Table to write (.chl).")],
    objective: ObjectiveOption = OBJECTIVE,
    seed: SeedOption = SEED,
    jobs: JobsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Solve every region of a board and pack the drives into a table."""
    check_output(output, "-o")
    check_jobs(jobs)
    check_request("phasor", objective, seed, None, None)
    loaded = load_board(board)
    partial = output.with_name(output.name + PARTIAL)
    with progress_bar("solving") as progress:
        table, report = build_table(
            loaded, objective=objective, seed=seed, jobs=jobs, progress=progress, partial=partial
        )
    write_whole(output, pack(table))
    answer(asdict(report), as_json=as_json, title=f"Table {output} for {loaded.name}")


def show(
    table: TableArgument,
    at: Annotated[str | None, typer.Option(help="Show the drive for X,Y (mm).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a table's header, or its entry for a place."""
    loaded = read_table(table)
    grid = loaded.grid
    result: dict[str, Any] = {
        "board_name": loaded.board_name,
        "board_fingerprint": f"{loaded.board_fingerprint:#018x}",
        "frequency_hz": loaded.frequency_hz,
        "actuators": loaded.actuators,
        "columns": grid.columns,
        "rows": grid.rows,
        "regions": grid.count,
        "size_mm": [grid.width_um / 1000.0, grid.length_um / 1000.0],
        "full_scale_gain": loaded.full_scale_gain,
        "stored_regions": int(loaded.folding.stored(grid).size),
        "bits": list(loaded.packing.bits),
        "bytes": table.stat().st_size,
        **asdict(loaded.limits),
    }
    if at is not None:
        place = parse_place(at, "--at")
        limits = (grid.width_um / 2000.0, grid.length_um / 2000.0)
        if any(abs(value) > limit for value, limit in zip(place, limits, strict=True)):
            expected = f"a place on the board: |x| up to {limits[0]:g}, |y| up to {limits[1]:g}"
            raise InputError("--at", at, expected)
        region = grid.region_at(*(round(value * 1000.0) for value in place))
        result["region"] = region
        result["region_centre_mm"] = list(grid.centre_mm(region))
        result["drive"] = [
            {"channel": k, "gain": float(abs(c)), "phase_deg": float(np.degrees(np.angle(c)))}
            for k, c in enumerate(loaded.drive(region))
        ]
    answer(result, as_json=as_json, title=str(table))


def verify(
    table: TableArgument,
    board: Annotated[str | None, typer.Option(help="The table's board, if not shipped.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Check a table whole: its bytes, its board, and what the firmware decodes from it."""
    loaded = read_table(table)
    owner = board_of(loaded, board, file=str(table))
    mirrors = board_mirrors(owner)
    for name, own, found in (
        ("mirror_x", loaded.folding.x, mirrors.x), ("mirror_y", loaded.folding.y, mirrors.y),
    ):  # fmt: skip
        if own is not None and own != found:
            raise InputError(name, own, f"{found}, the board's own", file=str(table))
    core = Emulator(loaded).core
    for region, entry in enumerate(loaded.iq.tolist()):
        if core.drive(region)[: loaded.actuators] != entry:
            raise ChladniError(f"{table}: region {region}: the firmware decodes another drive")
    result = {
        "board": owner.name,
        "regions": loaded.grid.count,
        "bytes": table.stat().st_size,
        "verified": True,
    }
    answer(result, as_json=as_json, title=f"{table}: bytes, board and the firmware's reading agree")


def diff(
    first: TableArgument,
    second: Annotated[Path, typer.Argument(metavar="OTHER", help="Another table.")],
    as_json: JsonOption = False,
) -> None:
    """Compare two tables: header fields, and drives up to their common phase."""
    one, other = read_table(first), read_table(second)
    left, right = _header(one), _header(other)
    fields = {key: [left[key], right[key]] for key in left if left[key] != right[key]}
    result: dict[str, Any] = {"header": fields, "regions_that_differ": None, "largest": None}
    if one.grid == other.grid and one.actuators == other.actuators:
        steps = [
            _step(one.drive(k) / one.full_scale_gain, other.drive(k) / other.full_scale_gain)
            for k in range(one.grid.count)
        ]
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
    plain = {key: value for key, value in vars(table).items() if key != "iq"}
    grid, limits = plain.pop("grid"), plain.pop("limits")
    packing, folding = plain.pop("packing"), plain.pop("folding")
    nested = {**asdict(grid), **asdict(limits), **asdict(packing)}
    nested |= {"mirror_x": folding.x, "mirror_y": folding.y}
    return {key: list(v) if isinstance(v, tuple) else v for key, v in (plain | nested).items()}


def export(
    table: TableArgument,
    output: Annotated[Path, typer.Option("--csv", help="File to write: a row per channel.")],
    as_json: JsonOption = False,
) -> None:
    """Write every drive of a table as CSV: region, place, channel, gain and phase."""
    check_output(output, "--csv")
    loaded = read_table(table)
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer)
    writer.writerow(["region", "x_mm", "y_mm", "channel", "gain", "phase_deg"])
    for region in range(loaded.grid.count):
        x, y = loaded.grid.centre_mm(region)
        for channel, c in enumerate(loaded.drive(region)):
            gain, phase = abs(c), float(np.degrees(np.angle(c)))
            writer.writerow(
                [region, f"{x:.4f}", f"{y:.4f}", channel, f"{gain:.6g}", f"{phase:.4f}"]
            )
    write_whole(output, buffer.getvalue().encode())
    rows = loaded.grid.count * loaded.actuators
    answer({"path": str(output), "rows": rows}, as_json=as_json, title=f"Drives of {table}")
