"""`chladni calibrate`: the board as it is, from what its coils read of each other."""

from __future__ import annotations

import datetime
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.calibration.fit import Found, fit_board
from chladni.calibration.hidden import hidden_plate
from chladni.calibration.restored import SETS, Restored, Truth
from chladni.calibration.sensing import read_hidden
from chladni.host.cli.common.options import (
    FigureOption,
    JsonOption,
    LargeOption,
    check_figure,
    check_one_of,
    required,
)
from chladni.host.cli.common.output import answer, check_output, progress_bar, write_figure
from chladni.host.cli.common.ranges import SEEDS, within
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.measured import Measured, MeasuredValue
from chladni.sim.board.writing import board_file
from chladni.sim.errors import ConflictError
from chladni.sim.files import write_whole

MOST_SETS = 10_000
EXPECTED_SOLUTIONS = 12
"""Of a plate: five to begin with, six or seven on the way."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("calibrate")(calibrate)


def calibrate(
    output: Annotated[Path, typer.Option("-o", "--output", help="Board file to write (.toml).")],
    board: Annotated[str | None, typer.Option(help="The board as it is drawn.")] = None,
    emulator: Annotated[
        bool, typer.Option("--emulator", help="An emulated device, on a plate drawn by --hidden.")
    ] = False,
    hidden: Annotated[
        int | None, typer.Option(callback=SEEDS, help="Seed of the plate that only it knows.")
    ] = None,
    sets: Annotated[
        int,
        typer.Option(callback=within(1, MOST_SETS), help="Of two fingers that are scored."),
    ] = SETS,
    figure: FigureOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find a board as it is: coils, foam, sheet, screws; write its file with what was measured."""
    named = required("--board", board, "what is calibrated")
    check_output(output, "-o", (".toml",))
    check_figure(figure)
    check_one_of("whose coils are read", emulator=emulator)
    seed = required("--hidden", hidden, "which plate the emulated device is on")
    begun, drawn = time.monotonic(), load_board(named)
    _check_unmeasured(drawn)
    plate = hidden_plate(drawn, seed)
    with progress_bar("plates") as progress:
        readings = read_hidden(plate)
        found = fit_board(
            drawn, readings, lambda done: progress(done, max(done + 1, EXPECTED_SOLUTIONS))
        )
    measured = _with_origin(found, f"its own coils, emulated, plate {seed}")
    with progress_bar("scores") as progress:
        truth = Truth(plate, drawn, sets=sets)
        progress(1, 3)
        before = truth.score(drawn)
        progress(2, 3)
        after = truth.score(measured)
        progress(3, 3)
    write_whole(output, board_file(measured, _about(drawn, found)))
    if figure is not None:
        # What draws takes a third of a second to load.
        from chladni.host.figures.calibration import calibration_figure  # noqa: PLC0415

        write_figure(calibration_figure(drawn, found, before, after), figure)
    answer(
        {
            "verdict": verdict(drawn, found, before, after),
            "path": str(output),
            "coils": _coils(drawn, found),
            "parameters": [asdict(own) for own in found.parameters],
            "before": asdict(before),
            "after": asdict(after),
            "left": found.left,
            "device_seconds": readings.seconds,
            "seconds": time.monotonic() - begun,
        },
        as_json=as_json,
        title=f"{drawn.name}: calibrated (simulated)",
    )


def _check_unmeasured(board: Board) -> None:
    """What was measured before is no drawing, from which tolerances count."""
    if board.measured is not None:
        raise ConflictError("--board", "[measured]", hint="calibrate from the board as it is drawn")


def _with_origin(found: Found, by: str) -> Board:
    """The board that was found, with what was measured of it, how and when."""
    values = [
        MeasuredValue(own.name, own.value, own.low, own.high)
        for own in found.parameters
        if own.told
    ]
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    return replace(found.board, measured=Measured(by, today, tuple(values)))


def _about(drawn: Board, found: Found) -> list[str]:
    """What stands on top of the file."""
    return [f"{drawn.name} as it was measured by `chladni calibrate`.", *_faults(drawn, found)]


def _coils(drawn: Board, found: Found) -> list[dict[str, Any]]:
    signs, strengths = found.wiring.signs.tolist(), found.strengths.tolist()
    return [
        {
            "name": own.name,
            "polarity": int(sign) or 1,
            "dead": sign == 0.0,
            "force": strength if sign else 0.0,
        }
        for own, sign, strength in zip(drawn.actuators, signs, strengths, strict=True)
    ]


def _faults(drawn: Board, found: Found) -> list[str]:
    """What to look at on the desk."""
    said = []
    for own in _coils(drawn, found):
        if own["dead"]:
            said.append(f"Coil {own['name']} is dead: look at its wires and its driver.")
        elif own["polarity"] < 0:
            said.append(f"Coil {own['name']} is reversed: swap its wires, or keep this file.")
    return said


def verdict(drawn: Board, found: Found, before: Restored, after: Restored) -> str:
    """What came of it, in a few sentences."""
    gains = [
        f"two fingers {before.fingers_2_db.median:.0f} dB apart before, "
        f"{after.fingers_2_db.median:.0f} dB after"
    ]
    own, then = before.second_finger_20mm_db, after.second_finger_20mm_db
    if drawn.focus is not None and own is not None and then is not None:
        gains.insert(
            0, f"from 20 mm on {own.median:.0f} dB quieter before, {then.median:.0f} dB after"
        )
    told = [
        f"{own.name} {own.value:.2f} times the drawn one" for own in found.parameters if own.told
    ]
    first = ", ".join(gains)
    sentences = [first[0].upper() + first[1:] + ".", *_faults(drawn, found)]
    if told:
        sentences.append("Measured: " + ", ".join(told) + ".")
    return " ".join(sentences)
