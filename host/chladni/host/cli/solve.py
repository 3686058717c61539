"""`chladni solve`: one place, one drive, one scorecard."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from chladni.drives.methods import SEED
from chladni.drives.methods.focus import shortfall
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.felt import remedy
from chladni.drives.scoring.scorecard import Scorecard, focusing_objective, score
from chladni.drives.solve import Solution, check_request, solve
from chladni.host.cli.common.drive_options import (
    FloorOption,
    MethodOption,
    OwnObjectiveOption,
    QuieterFromOption,
    QuieterOption,
    SilentFromOption,
    with_focus,
)
from chladni.host.cli.common.options import (
    BoardArgument,
    FigureOption,
    JsonOption,
    LargeOption,
    SeedOption,
    check_figure,
)
from chladni.host.cli.common.output import (
    ARRAYS,
    NO_COIL,
    answer,
    check_output,
    parse_place,
    progress_bar,
    say_unmet,
    write_figure,
)
from chladni.host.cli.common.ranges import STEPS
from chladni.host.cli.common.verdicts import of_place
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import Focus
from chladni.sim.fields.transfer import TOLERANCE

LOUDEST_METHOD = "time-reversal"
"""Finds what a device plays under one finger where its table has no drives."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("solve")(solve_command)


def solve_command(
    board: BoardArgument,
    target: Annotated[str, typer.Option(help="Place of the finger: X,Y (mm).")],
    method: MethodOption = "phasor",
    objective: OwnObjectiveOption = None,
    seed: SeedOption = SEED,
    quieter_from_mm: QuieterFromOption = None,
    quieter_db: QuieterOption = None,
    silent_from_mm: SilentFromOption = None,
    floor_um: FloorOption = None,
    steps: Annotated[
        int | None, typer.Option(callback=STEPS, help="Steps, in place of the method's own.")
    ] = None,
    trace: Annotated[
        Path | None,
        typer.Option(help="Keep an annealing's trace here (.npz), and go on from it."),
    ] = None,
    figure: FigureOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find the drive that best focuses the vibration at one place, and score it."""
    place = parse_place(target, "--target")
    check_request(method, objective or "ssim", seed, steps, trace)
    if trace is not None:
        check_output(trace, "--trace", ARRAYS)
    check_figure(figure)
    loaded, objective = with_focus(
        load_board(board),
        objective,
        method,
        quieter_from_mm=quieter_from_mm,
        quieter_db=quieter_db,
        silent_from_mm=silent_from_mm,
        floor_um=floor_um,
    )
    with progress_bar(method, kept=trace) as progress:
        solution = solve(
            loaded,
            place,
            method=method,
            objective=objective,
            seed=seed,
            steps=steps,
            trace=trace,
            progress=progress,
            allow_unmet=True,
        )
    card = score(solution, loaded)
    verdict = _verdict(loaded, card, method)
    if figure is not None:
        from chladni.host.figures.solutions import solution_figure  # noqa: PLC0415

        drawn = solution_figure(loaded, solution, card, trace=trace, verdict=verdict)
        write_figure(drawn, figure)
    report = solution_report(loaded, solution, card)
    if report["remark"]:
        report["remark"] += " " + remedy(focusing_objective(solved_board(loaded).problem(place)))
    say_unmet(solution.error_estimate, TOLERANCE)
    if not report["movable"]:
        sys.stderr.write(f"chladni: no drive of these actuators moves {target} mm\n")
    if report["remark"]:
        sys.stderr.write(f"chladni: {report['remark']}\n")
    if objective == "focus":
        gives_way = shortfall(loaded.focus or Focus(), solution.details)
        if gives_way:
            sys.stderr.write(f"chladni: {gives_way}\n")
    if loaded.coil is None:
        sys.stderr.write(f"chladni: {NO_COIL}\n")
    title = f"{loaded.name}: the drive for {target} mm"
    answer({"verdict": verdict} | report, as_json=as_json, title=title)


def _verdict(board: Board, card: Scorecard, method: str) -> str:
    """What the score comes to, and whether a device of a board for several plays the drive."""
    return of_place(
        card,
        frequency_hz=board.drive.frequency_hz,
        for_fingers=board.is_for_several,
        is_played=method == LOUDEST_METHOD,
    )


def solution_report(board: Board, solution: Solution, scored: Scorecard) -> dict[str, Any]:
    """A solution and its scorecard as `chladni solve --json` prints them."""
    known = scored.by_key()
    baselines = known.pop("baselines")
    return {
        "target_mm": list(solution.target_mm),
        "method": solution.method,
        "objective": solution.objective,
        "drive": drive_entries(board, solution.drive),
        **known,
        "error_estimate": solution.error_estimate,
        "tolerance_met": solution.tolerance_met,
        "seconds": solution.seconds,
        "evaluations": solution.evaluations,
        "details": {
            name: value if np.isfinite(value) else None for name, value in solution.details.items()
        },
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
