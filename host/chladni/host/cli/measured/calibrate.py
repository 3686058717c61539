"""`chladni calibrate`: the board as it is, from what its coils or a microphone tell of it."""

from __future__ import annotations

import datetime
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.restored import SETS, Restored, Truth
from chladni.host.cli.common.hidden_plates import SHAPES, named_plate
from chladni.host.cli.common.options import (
    FigureOption,
    JsonOption,
    LargeOption,
    check_figure,
    check_one_of,
    required,
)
from chladni.host.cli.common.output import (
    answer,
    check_output,
    progress_bar,
    write_figure,
)
from chladni.host.cli.common.ranges import within
from chladni.host.cli.device.connection import Connection, KeyOption, UdpOption
from chladni.host.cli.measured.verdict import faults, verdict
from chladni.host.cli.measured.ways import Calibrated, heard, in_laboratory, read, shaken, stands
from chladni.sim.board.board import Board
from chladni.sim.board.file import file_of, load_board, shipped_boards
from chladni.sim.board.parts import Isolation, Measured, MeasuredValue
from chladni.sim.board.writing import measured_file
from chladni.sim.coil.full_drive import strengths
from chladni.sim.errors import ConflictError, InputError
from chladni.sim.files import write_whole

MOST_SETS = 10_000
LEAST_GRAMS, MOST_GRAMS = 0.01, 100.0


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("calibrate")(calibrate)


def calibrate(
    output: Annotated[Path, typer.Option("-o", "--output", help="Board file to write (.toml).")],
    board: Annotated[str | None, typer.Option(help="The board as it is drawn.")] = None,
    emulator: Annotated[
        bool, typer.Option("--emulator", help="An emulated device, on a plate drawn by --hidden.")
    ] = False,
    recording: Annotated[
        Path | None,
        typer.Option(help="A recording (.wav) of every coil's sweep."),
    ] = None,
    port: Annotated[
        str | None, typer.Option(help="Serial port of the device whose coils measure the board.")
    ] = None,
    udp: UdpOption = None,
    key: KeyOption = None,
    readings: Annotated[
        Path | None,
        typer.Option(
            help="What coils read (.json): written with a device, read without one. Of an "
            "accelerometer (.csv): written place by place, gone on from, and read by --measured."
        ),
    ] = None,
    measured: Annotated[
        Path | None,
        typer.Option(
            help="What a laboratory measured (.csv, .npz, .uff): coils' fields at places."
        ),
    ] = None,
    response: Annotated[
        str | None, typer.Option(help="What it measured: displacement, velocity or acceleration.")
    ] = None,
    per: Annotated[
        str | None, typer.Option(help="Over what: force, current or voltage of a coil.")
    ] = None,
    accelerometer: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y",
            help="Where an accelerometer stands on the plate, mm; several, one after another. "
            "`coils`: on each coil.",
        ),
    ] = None,
    sensor_g: Annotated[
        float | None,
        typer.Option(
            callback=within(LEAST_GRAMS, MOST_GRAMS),
            help="Its mass, g, glue included; also of a laboratory's that stands on the plate.",
        ),
    ] = None,
    hidden: Annotated[
        str | None,
        typer.Option(
            metavar="[BOARD@]SEED",
            help="The plate that only it knows: of a SEED, or of a FILE.toml.",
        ),
    ] = None,
    microphone: Annotated[
        bool, typer.Option("--microphone", help="Record the emulated device in place of its coils.")
    ] = False,
    sets: Annotated[
        int,
        typer.Option(
            callback=within(1, MOST_SETS),
            help="Of two fingers that are scored, the first of those that `fingers` draws.",
        ),
    ] = SETS,
    figure: FigureOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find a board as it is: coils, foam, sheet, screws; write its file with what was measured."""
    named = required("--board", board, "what is calibrated")
    check_output(output, "-o", (".toml",), [hidden or ""])
    check_figure(figure)
    way = {"emulator": emulator, "port": port is not None, "udp": udp is not None}
    kept = {"recording": recording is not None, "measured": measured is not None}
    _check_ways(way, kept, readings, ".json" if accelerometer is None else ".csv")
    begun, drawn = time.monotonic(), load_board(named)
    _check_kept(named, output)
    if drawn.measured is not None:
        raise ConflictError("--board", "[measured]", hint="calibrate from the board as it is drawn")
    plate = _plate(drawn, hidden, emulator=emulator, microphone=microphone)
    device = Connection(port=port, udp=udp, key=key) if way["port"] or way["udp"] else None
    others = (recording, measured, microphone or None)
    kilograms = _kilograms(sensor_g, accelerometer, measured, others)
    if measured is not None:
        found = in_laboratory(drawn, measured, response, per, kilograms)
    elif accelerometer is not None:
        found = shaken(drawn, plate, device, stands(drawn, accelerometer), kilograms, readings)
    elif recording is None and not microphone:
        found = read(drawn, plate, device, readings)
    elif readings is not None:
        raise ConflictError("--readings", "--microphone")
    else:
        found = heard(drawn, plate, recording)
    promised, before, after, best = _scores(drawn, found.board, plate, sets)
    known = _with_origin(found, before.isolation(drawn), after.isolation(drawn))
    write_whole(output, measured_file(drawn, known, _about(drawn, found)))
    if figure is not None:
        # What draws takes a third of a second to load.
        from chladni.host.figures.calibration import calibration_figure  # noqa: PLC0415

        write_figure(calibration_figure(drawn, known, found.by, before, after), figure)
    result = {
        "verdict": verdict(drawn, found, before, after, sets, is_on_plate=plate is not None),
        "path": str(output),
        "by": found.by,
        "coils": _coils(drawn, known, plate),
        "parameters": _parameters(drawn, found, plate),
        "as_drawn": asdict(promised),
        "before": asdict(before),
        "after": asdict(after),
        "plate_known": None if best is None else asdict(best),
        "device_seconds": found.device_seconds,
        "seconds": time.monotonic() - begun,
    }
    answer(
        result if as_json else _for_people(drawn, result, is_scored_on_itself=plate is None),
        as_json=as_json,
        title=f"{drawn.name}: calibrated{' (simulated)' if plate else ''}",
    )


def _for_people(
    drawn: Board, result: dict[str, Any], *, is_scored_on_itself: bool
) -> dict[str, Any]:
    """Coils in words, and levels by what they are over: a board's own are what it promises.

    One finger's level is left out where focus is not what the board is for: it reads as a failure.
    """
    coils = {}
    for own in result["coils"]:
        force = f"{own['force']:.2f} of the drawn force{_turned(own['polarity'])}"
        coils[own["name"]] = "makes no force" if own["dead"] else force
        if (true := own.get("true")) is not None:
            coils[own["name"]] += f" (true {abs(true):.2f}{_turned(true)})"
    told = result | {"coils": coils}
    for when in ("as_drawn", "before", "after", "plate_known"):
        if told[when] is None:
            continue
        rows = dict(told[when])
        level = rows.pop("level_db")
        if drawn.focus is None:
            rows.pop("second_finger_20mm_db")
        is_on_itself = is_scored_on_itself or when in ("as_drawn", "plate_known")
        told[when] = rows if is_on_itself else rows | {"over_promised_db": level}
    return told


def _turned(force: float) -> str:
    return ", reversed" if force < 0.0 else ""


def _check_kept(drawn: str, output: Path) -> None:
    """The drawn board is what the next calibration begins with."""
    path = file_of(drawn, shipped_boards(), "board", "a board file")
    if output.exists() and output.samefile(path):
        hint = "the next calibration needs the board as it is drawn"
        raise InputError("-o", str(output), "another file than --board's", hint=hint)


def _check_ways(
    device: dict[str, bool], files: dict[str, bool], readings: Path | None, ending: str
) -> None:
    """One source, and readings that can be kept or are kept already."""
    is_kept = readings is not None and not any((device | files).values())
    check_one_of("what is read", **device, **files, readings=is_kept)
    if readings is not None and any(files.values()):
        raise ConflictError("--readings", "a recording or fields")
    if readings is not None:
        check_output(readings, "--readings", (ending,))


def _plate(
    drawn: Board, hidden: str | None, *, emulator: bool, microphone: bool
) -> HiddenPlate | None:
    """The one that an emulated device is on."""
    if emulator:
        return named_plate(drawn, required("--hidden", hidden, f"{SHAPES}, the plate it is on"))
    if hidden is not None or microphone:
        raise ConflictError("--hidden" if hidden is not None else "--microphone", "no --emulator")
    return None


def _kilograms(
    sensor_g: float | None,
    accelerometer: list[str] | None,
    measured: Path | None,
    others: Sequence[object],
) -> float:
    """Of the sensor on the plate; 0 where none stands there."""
    if accelerometer is None:
        if sensor_g is not None and measured is None:
            raise ConflictError("--sensor-g", "no --accelerometer")
        return 1e-3 * (sensor_g or 0.0)
    if any(own is not None for own in others):
        raise ConflictError("--accelerometer", "another way of measuring")
    return 1e-3 * required("--sensor-g", sensor_g, "the sensor's mass changes the plate")


def _scores(
    drawn: Board, measured: Board, plate: HiddenPlate | None, sets: int
) -> tuple[Restored, Restored, Restored, Restored | None]:
    """The drawn board's drives on itself, and both boards' on the plate that is there or was found.

    The first is what the drawn board promises. The last is what drives keep that know a hidden
    plate: a calibration hardly brings more.
    """
    steps = 5 if plate else 4
    with progress_bar("scores") as progress:
        promised = Truth.found(drawn, drawn, sets).score(drawn)
        progress(1, steps)
        truth = Truth.of(plate, drawn, sets) if plate else Truth.found(measured, drawn, sets)
        progress(2, steps)
        before = truth.score(drawn)
        progress(3, steps)
        after = truth.score(measured)
        progress(4, steps)
        best = truth.score(truth.perfectly_known()) if plate else None
        progress(steps, steps)
    return promised, before, after, best


def _with_origin(found: Calibrated, before: Isolation, after: Isolation) -> Board:
    """The board that was found, with what was measured of it, how and when."""
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    values = [
        MeasuredValue(own.name, own.value, own.low, own.high, found.by, today)
        for own in found.parameters
        if own.told
    ]
    return replace(found.board, measured=Measured(found.by, today, tuple(values), before, after))


def _about(drawn: Board, found: Calibrated) -> list[str]:
    """What stands on top of the file."""
    return [f"{drawn.name} as it was measured by `chladni calibrate`.", *faults(found.board)]


def _coils(drawn: Board, board: Board, plate: HiddenPlate | None) -> list[dict[str, Any]]:
    """As they were found; of a hidden plate, their true force per ampere too, reversed below 0."""
    coils: list[dict[str, Any]] = [
        {
            "name": own.name,
            "polarity": own.polarity,
            "dead": own.is_dead,
            "force": 0.0 if own.is_dead else abs(own.strength),
        }
        for own in board.actuators
    ]
    if plate is not None:
        for own, true in zip(coils, plate.strengths * strengths(drawn), strict=True):
            own["true"] = float(true)
    return coils


def _parameters(drawn: Board, found: Calibrated, plate: HiddenPlate | None) -> list[dict[str, Any]]:
    """As they were found, each beside what it is where a hidden plate tells it."""
    ratios = plate.ratios(drawn) if plate is not None else {}
    rows = []
    for own in found.parameters:
        row = asdict(own)
        told = row.pop("told")
        true = {"true": ratios[own.name]} if own.name in ratios else {}
        rows.append(row | true | {"told": told})
    return rows
