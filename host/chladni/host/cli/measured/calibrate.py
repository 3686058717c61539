"""`chladni calibrate`: the board as it is, from what its coils or a microphone tell of it."""

from __future__ import annotations

import datetime
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.calibration.fit import BoardFit, Parameter, fit_board
from chladni.calibration.hearing import fit_sound
from chladni.calibration.hidden import HiddenPlate, hidden_plate
from chladni.calibration.laboratory.fields_fit import FieldsFit, fit_fields
from chladni.calibration.laboratory.measured_files import read_measured
from chladni.calibration.readings_file import load_readings, readings_file
from chladni.calibration.recorder import record_hidden
from chladni.calibration.restored import SETS, Restored, Truth, gained
from chladni.calibration.sensing import CoilReadings
from chladni.calibration.sweep import heard_levels
from chladni.calibration.wiring import coil_fault
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
from chladni.host.cli.common.recording import read_recording
from chladni.host.cli.device.connection import Connection
from chladni.host.device.device import Device
from chladni.host.device.wire import EmulatorWire
from chladni.host.emulation.sensed_plate import emulator_on
from chladni.host.measuring.coil_readings import read_coils
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Isolation, Measured, MeasuredValue
from chladni.sim.board.writing import board_file
from chladni.sim.errors import ConflictError
from chladni.sim.files import write_whole

MOST_SETS = 10_000
LABORATORY = 30
"""Plates that are solved for a laboratory's fields."""
EXPECTED_SOLUTIONS = 12
"""Of a plate: five to begin with, six or seven on the way."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("calibrate")(calibrate)


@dataclass(frozen=True)
class _Calibrated:
    """What was found, by coils or by ear."""

    board: Board
    parameters: tuple[Parameter, ...]
    by: str
    device_seconds: float | None
    coils: BoardFit | FieldsFit | None = None


def calibrate(
    output: Annotated[Path, typer.Option("-o", "--output", help="Board file to write (.toml).")],
    board: Annotated[str | None, typer.Option(help="The board as it is drawn.")] = None,
    emulator: Annotated[
        bool, typer.Option("--emulator", help="An emulated device, on a plate drawn by --hidden.")
    ] = False,
    recording: Annotated[
        Path | None,
        typer.Option(help="A recording (.wav) of every coil's sweep: foam or stand-offs alone."),
    ] = None,
    port: Annotated[
        str | None, typer.Option(help="Serial port of the device whose coils measure the board.")
    ] = None,
    udp: Annotated[
        str | None, typer.Option(metavar="HOST[:PORT]", help="Its address on the network.")
    ] = None,
    key: Annotated[
        Path | None,
        typer.Option(envvar="CHLADNI_KEY", help="File with its key. Required with --udp."),
    ] = None,
    readings: Annotated[
        Path | None,
        typer.Option(help="What coils read (.json): written with a device, read without one."),
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
    hidden: Annotated[
        int | None, typer.Option(callback=SEEDS, help="Seed of the plate that only it knows.")
    ] = None,
    microphone: Annotated[
        bool, typer.Option("--microphone", help="Record the emulated device in place of its coils.")
    ] = False,
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
    way = {"emulator": emulator, "port": port is not None, "udp": udp is not None}
    kept = {"recording": recording is not None, "measured": measured is not None}
    _check_ways(way, kept, readings)
    begun, drawn = time.monotonic(), load_board(named)
    if drawn.measured is not None:
        raise ConflictError("--board", "[measured]", hint="calibrate from the board as it is drawn")
    plate = None
    if emulator:
        plate = hidden_plate(drawn, required("--hidden", hidden, "which plate the device is on"))
    elif hidden is not None or microphone:
        raise ConflictError("--hidden" if hidden is not None else "--microphone", "no --emulator")
    is_real = port is not None or udp is not None
    device = Connection(port=port, udp=udp, key=key) if is_real else None
    if measured is not None:
        found = _in_laboratory(drawn, measured, response, per)
    elif recording is None and not microphone:
        found = _read(drawn, plate, device, readings)
    elif readings is not None:
        raise ConflictError("--readings", "--microphone")
    else:
        found = _heard(drawn, plate, recording)
    before, after = _scores(drawn, found.board, plate, sets)
    known = _with_origin(found, before.isolation(drawn), after.isolation(drawn))
    write_whole(output, board_file(known, _about(drawn, found)))
    if figure is not None:
        # What draws takes a third of a second to load.
        from chladni.host.figures.calibration import calibration_figure  # noqa: PLC0415

        write_figure(calibration_figure(drawn, known, found.by, before, after), figure)
    answer(
        {
            "verdict": verdict(drawn, found, before, after),
            "path": str(output),
            "by": found.by,
            "coils": _coils(known),
            "parameters": [asdict(own) for own in found.parameters],
            "before": asdict(before),
            "after": asdict(after),
            "device_seconds": found.device_seconds,
            "seconds": time.monotonic() - begun,
        },
        as_json=as_json,
        title=f"{drawn.name}: calibrated{' (simulated)' if plate else ''}",
    )


def _check_ways(device: dict[str, bool], files: dict[str, bool], readings: Path | None) -> None:
    """One source, and readings that can be kept or are kept already."""
    is_kept = readings is not None and not any((device | files).values())
    check_one_of("what is read", **device, **files, readings=is_kept)
    if readings is not None and any(files.values()):
        raise ConflictError("--readings", "a recording or fields")
    if readings is not None:
        check_output(readings, "--readings", (".json",))


def _heard(drawn: Board, plate: HiddenPlate | None, recording: Path | None) -> _Calibrated:
    """What a recording tells."""
    with progress_bar("plates") as progress:
        if plate is None:
            assert recording is not None
            (samples, rate_hz), by = read_recording(recording), f"a recording, {recording.name}"
        else:
            (samples, rate_hz), by = record_hidden(plate), _emulated("a microphone", plate)
        levels = heard_levels(samples, rate_hz, len(drawn.actuators))
        heard = fit_sound(drawn, levels, progress)
    return _Calibrated(heard.board, (heard.parameter,), by, samples.size / rate_hz)


def _in_laboratory(drawn: Board, path: Path, response: str | None, per: str | None) -> _Calibrated:
    """What instruments tell of coils' fields."""
    fields = read_measured(path, drawn, response, per)
    with progress_bar("plates") as progress:
        found = fit_fields(drawn, fields, lambda done: progress(done, max(done + 1, LABORATORY)))
    return _Calibrated(found.board, found.parameters, f"a laboratory, {path.name}", None, found)


def _read(
    drawn: Board, plate: HiddenPlate | None, connection: Connection | None, kept: Path | None
) -> _Calibrated:
    """What coils tell of each other."""
    if plate is None and connection is None:
        assert kept is not None
        readings, by = load_readings(kept, drawn), f"its own coils, {kept.name}"
    else:
        readings = _of_device(drawn, plate, connection)
        by = _emulated("its own coils", plate) if plate is not None else "its own coils"
        if kept is not None:
            write_whole(kept, readings_file(readings, drawn))
    with progress_bar("plates") as progress:
        found = fit_board(
            drawn, readings, lambda done: progress(done, max(done + 1, EXPECTED_SOLUTIONS))
        )
    return _Calibrated(found.board, found.parameters, by, readings.seconds, found)


def _of_device(
    drawn: Board, plate: HiddenPlate | None, connection: Connection | None
) -> CoilReadings:
    if connection is not None:
        wire = connection.wire()
    else:
        assert plate is not None
        wire = EmulatorWire(emulator_on(drawn, plate))
    with Device(wire) as device, progress_bar("coils") as progress:
        return read_coils(device, drawn, progress)


def _emulated(what: str, plate: HiddenPlate) -> str:
    return f"{what}, emulated, plate {plate.seed}"


def _scores(
    drawn: Board, measured: Board, plate: HiddenPlate | None, sets: int
) -> tuple[Restored, Restored]:
    """Drives of the drawn and of the found board, on the plate that is there or was found."""
    with progress_bar("scores") as progress:
        truth = Truth.of(plate, drawn, sets) if plate else Truth.found(measured, drawn, sets)
        progress(1, 3)
        before = truth.score(drawn)
        progress(2, 3)
        after = truth.score(measured)
        progress(3, 3)
    return before, after


def _with_origin(found: _Calibrated, before: Isolation, after: Isolation) -> Board:
    """The board that was found, with what was measured of it, how and when."""
    values = [
        MeasuredValue(own.name, own.value, own.low, own.high)
        for own in found.parameters
        if own.told
    ]
    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    return replace(found.board, measured=Measured(found.by, today, tuple(values), before, after))


def _about(drawn: Board, found: _Calibrated) -> list[str]:
    """What stands on top of the file."""
    return [f"{drawn.name} as it was measured by `chladni calibrate`.", *_faults(found)]


def _coils(board: Board) -> list[dict[str, Any]]:
    return [
        {
            "name": own.name,
            "polarity": own.polarity,
            "dead": own.is_dead,
            "force": 0.0 if own.is_dead else abs(own.strength),
        }
        for own in board.actuators
    ]


def _faults(found: _Calibrated) -> list[str]:
    """What to look at on the desk."""
    if found.coils is None:
        return []
    return [fault.said for own in found.board.actuators if (fault := coil_fault(own))]


def verdict(drawn: Board, found: _Calibrated, before: Restored, after: Restored) -> str:
    """What came of it, in a few sentences."""
    told = [
        f"{own.name} {own.value:.2f} times the drawn one" for own in found.parameters if own.told
    ]
    first = gained(before.isolation(drawn), after.isolation(drawn))
    sentences = [first[0].upper() + first[1:] + ".", *_faults(found)]
    sentences += [f"Measured: {', '.join(told)}."] if told else ["Nothing was told."]
    return " ".join(sentences)
