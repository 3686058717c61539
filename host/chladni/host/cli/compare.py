"""`chladni compare`: every method on targets all over a board."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from chladni.drives.checkpoint import remove_checkpoint
from chladni.drives.methods import METHODS, SEED
from chladni.drives.objectives import default_objective
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.compare import as_csv, compare, summary
from chladni.drives.solve import check_request
from chladni.host.cli.common.options import (
    PARTIAL,
    BoardArgument,
    FigureOption,
    JobsOption,
    JsonOption,
    LargeOption,
    SchedulerOption,
    SeedOption,
    check_figure,
)
from chladni.host.cli.common.output import (
    NO_COIL,
    TEXT,
    answer,
    check_output,
    progress_bar,
    say_unmet,
    sheet,
    without_rounding,
    write_figure,
)
from chladni.host.cli.common.ranges import PITCHES, STEPS
from chladni.host.cli.common.verdicts import of_methods
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError
from chladni.sim.files import write_whole

PITCH_MM = 18.0
SMALLEST_PITCH_MM = 1.0
SHOWN = {
    "ssim": "SSIM", "ssim_min": "least", "focal_error_mm": "focal mm",
    "centroid_error_mm": "centroid mm", "below_limit_db": "below limit dB",
    "second_finger_db": "2nd finger dB", "spot_mm2": "spot mm²", "finger_um": "finger µm",
    "evaluations": "evaluations", "seconds": "seconds",
}  # fmt: skip
WIDTH = 150
"""Columns of text where there is no terminal to ask."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("compare")(compare_methods)


def compare_methods(
    board: BoardArgument,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Every row as CSV.")] = None,
    figure: FigureOption = None,
    pitch: Annotated[
        float, typer.Option(callback=PITCHES, help="Distance of the targets, mm.")
    ] = PITCH_MM,
    methods: Annotated[
        str | None, typer.Option(help="Some of the methods, as A,B,…; all by default.")
    ] = None,
    steps: Annotated[
        int | None, typer.Option(callback=STEPS, help="Steps of the annealings.")
    ] = None,
    seed: SeedOption = SEED,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Score every method, and the null models, on targets all over a board."""
    if output is not None:
        check_output(output, "-o", TEXT)
    check_figure(figure)
    check_request("phasor", "ssim", seed, steps, None)
    chosen = _methods(methods)
    loaded = load_board(board)
    widest = min(loaded.plate.size) / MM
    if not SMALLEST_PITCH_MM <= pitch <= widest:
        expected = f"{SMALLEST_PITCH_MM:g} mm to the board's short side, {widest:g} mm"
        raise InputError("--pitch", pitch, expected)
    kept = output.with_name(output.name + PARTIAL) if output is not None else None
    with progress_bar("targets", kept=kept) as progress:
        grid, rows = compare(
            loaded,
            pitch=pitch * MM,
            methods=chosen,
            seed=seed,
            steps=steps,
            jobs=jobs,
            progress=progress,
            kept=kept,
            scheduler=scheduler,
            allow_unmet=True,
        )
    if output is not None:
        write_whole(output, as_csv(rows))
    if figure is not None:
        from chladni.host.figures.searches import compare_figure  # noqa: PLC0415

        write_figure(compare_figure(loaded, grid, rows), figure)
    remove_checkpoint(kept)
    table, own = summary(rows), default_objective(loaded)
    fields = solved_board(loaded).fields
    say_unmet(fields.error_estimate, fields.tolerance)
    if loaded.coil is None:
        sys.stderr.write(f"chladni: {NO_COIL}\n")
    if as_json:
        result = {
            "board": loaded.name,
            "objective": own,
            "targets": grid.count,
            "grid": asdict(grid),
            "error_estimate": fields.error_estimate,
            "tolerance_met": fields.tolerance_met,
            "methods": table,
        }
        answer(result, as_json=True)
    else:
        title = f"{loaded.name}: medians over {grid.count} targets; its own objective is {own}"
        _print(table, title, own)


def _methods(text: str | None) -> list[str] | None:
    if text is None:
        return None
    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in METHODS:
            raise InputError("--methods", name, "some of: " + ", ".join(METHODS))
    return list(dict.fromkeys(names))


def _print(entries: list[dict[str, Any]], title: str, own: str) -> None:
    table = sheet(title=title)
    table.add_column("method")
    for heading in SHOWN.values():
        table.add_column(heading, justify="right")
    for entry in entries:
        name = entry["method"]
        if name == "phasor":
            name += f" {entry['objective']}"
        cells = [
            "–" if entry[key] is None else f"{without_rounding(entry[key]):.3g}" for key in SHOWN
        ]
        table.add_row(name, *cells)
    console = Console()
    # What the board is for, if that is compared, else what looks best.
    best = max(entries, key=lambda entry: (entry["objective"] == own != "ssim", entry["ssim"]))
    console.print(of_methods(entries, best), highlight=False)
    (console if console.is_terminal else Console(width=WIDTH)).print(table)
    if best["remark"]:
        console.print(f"{best['method']} {best['objective']}: {best['remark']}")
