"""The `chladni` command: thin over `chladni.sim`, `chladni.tables` and `chladni.host`."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from chladni.host import plate_commands
from chladni.host.console import (
    answer,
    check_output,
    parse_place,
    progress_bar,
    write_arrays,
    write_whole,
)  # fmt: skip
from chladni.host.emulator import LEVEL, TouchEvent
from chladni.host.loop import board_of, run_loop
from chladni.host.options import BoardArgument, JsonOption, SeedOption
from chladni.sim.board import MM, Board
from chladni.sim.board_file import load_board
from chladni.sim.errors import ChladniError, InputError
from chladni.sim.transfer import plate_model
from chladni.tables.build import build_table
from chladni.tables.format import pack, read_table
from chladni.tables.scorecard import score
from chladni.tables.solve import METHODS, SEED, Solution, solve

app = typer.Typer(
    help="Put a vibration where a finger is.", no_args_is_help=True, add_completion=False,
    rich_markup_mode=None, pretty_exceptions_enable=False,
)  # fmt: skip
board_app = typer.Typer(help="Look at board files.", no_args_is_help=True)
table_app = typer.Typer(help="Build and read drive tables.", no_args_is_help=True)
app.add_typer(board_app, name="board")
app.add_typer(table_app, name="table")

plate_commands.register(app)


@board_app.command("show")
def board_show(board: BoardArgument, as_json: JsonOption = False) -> None:
    """Show a board and its first ten natural frequencies."""
    loaded = load_board(board)
    modes = plate_model(loaded).natural_frequencies(10)
    result = {
        "name": loaded.name,
        "size_mm": [side / MM for side in loaded.plate.size],
        "actuators": [
            {"name": a.name, "at_mm": [round(value / MM, 9) for value in a.at]}
            for a in loaded.actuators
        ],
        "modes_hz": [round(float(mode), 4) for mode in modes],
        "wavelength_mm": loaded.plate.wavelength(loaded.drive.frequency_hz) / MM,
        "fingerprint": f"{loaded.fingerprint():#018x}",
    }
    answer(result, as_json=as_json, title=f"Board {loaded.name}")


@app.command("solve")
def solve_command(
    board: BoardArgument,
    target: Annotated[str, typer.Option(help="Where the vibration shall be: X,Y (mm).")],
    method: Annotated[str, typer.Option(help="One of: " + ", ".join(METHODS) + ".")] = METHODS[0],
    seed: SeedOption = SEED,
    steps: Annotated[int | None, typer.Option(help="Steps per climb.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the drive that best focuses the vibration at one place, and score it."""
    loaded = load_board(board)
    solution = solve(loaded, parse_place(target, "--target"), method=method, seed=seed, steps=steps)
    title = f"{loaded.name}: focus at {target} mm"
    answer(solution_report(loaded, solution), as_json=as_json, title=title)


def solution_report(board: Board, solution: Solution) -> dict[str, Any]:
    """A solution and its scorecard as `chladni solve --json` answers."""
    card = asdict(score(solution, board))
    baselines = {key: card.pop(key) for key in ("silent", "nearest_actuator", "misplaced")}
    return {
        "target_mm": list(solution.target_mm),
        "method": solution.method,
        "drive": drive_entries(board, solution.drive),
        **card,
        "seconds": solution.seconds,
        "evaluations": solution.evaluations,
        "baselines": baselines,
    }


def drive_entries(
    board: Board, drive: np.ndarray[Any, np.dtype[np.complex128]]
) -> list[dict[str, Any]]:
    """A drive for people: name, gain and phase of every actuator."""
    return [
        {
            "actuator": actuator.name,
            "gain": float(abs(value)),
            "phase_deg": float(np.degrees(np.angle(value))),
        }
        for actuator, value in zip(board.actuators, drive, strict=True)
    ]


@table_app.command("build")
def table_build(
    board: BoardArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="Table to write (.chl).")],
    seed: SeedOption = SEED,
    jobs: Annotated[int | None, typer.Option(help="Processes; all cores by default.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Solve every region of a board and pack the drives into a table."""
    check_output(output, "-o")
    if jobs is not None and jobs < 1:
        raise InputError("--jobs", jobs, "at least 1")
    loaded = load_board(board)
    with progress_bar("solving") as progress:
        table, report = build_table(loaded, seed=seed, jobs=jobs, progress=progress)
    write_whole(output, pack(table))
    answer(asdict(report), as_json=as_json, title=f"Table {output} for {loaded.name}")


@table_app.command("show")
def table_show(
    table: Annotated[Path, typer.Argument(metavar="TABLE", help="Table file (.chl).")],
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


@app.command()
def emulate(
    table: Annotated[Path, typer.Argument(metavar="TABLE", help="Table file (.chl).")],
    touch: Annotated[list[str], typer.Option(help="Touch X,Y@MS: place in mm, time in ms.")],
    ms: Annotated[float, typer.Option("--ms", help="How long to run, ms.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Recording to write (.npz).")],
    lift: Annotated[list[float] | None, typer.Option(help="Lift the finger at MS.")] = None,
    board: Annotated[str | None, typer.Option(help="The table's board, if not shipped.")] = None,
    level: Annotated[float, typer.Option(help="Share of full amplitude, 0 to 1.")] = LEVEL,
    as_json: JsonOption = False,
) -> None:
    """Run the firmware on touches, record its pins, and score the field they make."""
    check_output(output, "-o")
    if not 0.0 < level <= 1.0:
        raise InputError("--level", level, "a share of full amplitude from 0 to 1")
    events = [_parse_touch(text) for text in touch] + [TouchEvent(at, None) for at in lift or []]
    loaded = read_table(table)
    owner = board_of(loaded, board, file=str(table))
    recording, report = run_loop(loaded, owner, events, ms, level=level)
    write_arrays(output, t_s=recording.t_s, duty=recording.duty, carrier_hz=recording.carrier_hz)
    result = {
        "latency_ms": report.latency_ms,
        "channels": [
            {"actuator": actuator.name, **asdict(channel)}
            for actuator, channel in zip(owner.actuators, report.channels, strict=True)
        ],
        "region": report.region,
        "target_mm": list(report.target_mm),
        "ssim": report.ssim,
        "ssim_table": report.ssim_table,
        "ssim_touch": report.ssim_touch,
        "path": str(output),
    }
    answer(result, as_json=as_json, title=f"{table} on the emulated board")


def _parse_touch(text: str) -> TouchEvent:
    place, mark, at = text.partition("@")
    try:
        at_ms = float(at)
    except ValueError:
        at_ms = float("nan")
    if not mark or not np.isfinite(at_ms):
        raise InputError("--touch", text, "X,Y@MS: a place in mm and a time in ms")
    return TouchEvent(at_ms, parse_place(place, "--touch"))


def main() -> None:
    """Run the command line; 0 done, 1 the work failed, 2 the input is wrong."""
    try:
        app(prog_name="chladni")
    except InputError as error:
        sys.exit(_complain(str(error), 2))
    except ChladniError as error:
        sys.exit(_complain(str(error), 1))
    except OSError as error:
        sys.exit(_complain(f"{error.filename or 'output'}: {error.strerror}", 1))


def _complain(message: str, code: int) -> int:
    sys.stderr.write(f"chladni: {message}\n")
    return code


if __name__ == "__main__":
    main()
