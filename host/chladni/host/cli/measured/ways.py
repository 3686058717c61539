"""The ways in which `chladni calibrate` reads a board: coils, ear, accelerometer, laboratory."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import typer

from chladni.calibration.fit import fit_board
from chladni.calibration.hearing import fit_sound
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.laboratory.fields_fit import fit_fields
from chladni.calibration.laboratory.measured_fields import MeasuredFields, joined
from chladni.calibration.laboratory.measured_files import fields_csv, read_measured
from chladni.calibration.parameters import Parameter
from chladni.calibration.readings_file import load_readings, readings_file
from chladni.calibration.recorder import record_hidden
from chladni.calibration.sensing import CoilReadings
from chladni.calibration.sweep import heard_coils
from chladni.host.cli.common.output import Place, parse_place, progress_bar, say
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.measured.recording import read_recording
from chladni.host.device.checks.readiness import COIL_HOT, check_ready, what_stands
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire, Wire
from chladni.host.emulation.sensed_plate import emulator_on
from chladni.host.emulation.shaken_plate import Sensor, ShakenPlate
from chladni.host.measuring.accelerometer import read_motions
from chladni.host.measuring.begun import Begun, begun_file, load_begun
from chladni.host.measuring.coil_readings import read_coils
from chladni.sim.board.board import Board
from chladni.sim.fields.transfer import check_target
from chladni.sim.files import write_whole

LABORATORY = 30
"""Plates that are solved for fields at places."""
EXPECTED_SOLUTIONS = 12
"""Of a plate: five to begin with, six or seven on the way."""
ON_COILS = "coils"
"""A place on each of them, as --accelerometer has it."""
SAME_M = 1e-5
"""Closer than this, places of an accelerometer are one."""
COOLS_S = 120.0
"""From the limit until a coil may play, at most."""


@dataclass(frozen=True)
class Calibrated:
    """What was found, by coils or by ear."""

    board: Board
    parameters: tuple[Parameter, ...]
    by: str
    device_seconds: float | None


def heard(drawn: Board, plate: HiddenPlate | None, recording: Path | None) -> Calibrated:
    """What a recording tells."""
    with progress_bar("plates") as progress:
        if plate is None:
            assert recording is not None
            (samples, rate_hz), by = read_recording(recording), f"a recording, {recording.name}"
        else:
            (samples, rate_hz), by = record_hidden(plate), _emulated("a microphone", plate)
        sweeps = heard_coils(samples, rate_hz, len(drawn.actuators))
        found = fit_sound(drawn, sweeps, progress)
    return Calibrated(found.board, found.parameters, by, samples.size / rate_hz)


def in_laboratory(
    drawn: Board, path: Path, response: str | None, per: str | None, kilograms: float
) -> Calibrated:
    """What instruments tell of coils' fields."""
    fields = replace(read_measured(path, drawn, response, per), sensor_kg=kilograms)
    return _of_fields(drawn, fields, f"a laboratory, {path.name}", None)


def _of_fields(
    drawn: Board, fields: MeasuredFields, by: str, device_seconds: float | None
) -> Calibrated:
    with progress_bar("plates") as progress:
        found = fit_fields(
            drawn, fields, lambda done: progress(done, _of_so_many(done, LABORATORY))
        )
    return Calibrated(found.board, found.parameters, by, device_seconds)


def _of_so_many(done: int, usual: int) -> int:
    """Plates that are solved in all: as usual, or a multiple of it where one fit does not do."""
    return usual * (1 + max(done - 1, 0) // usual)


def stands(drawn: Board, texts: Sequence[str]) -> list[Place]:
    """Where an accelerometer stands, mm, each checked before the first is read."""
    if list(texts) == [ON_COILS]:
        return [(1e3 * own.at[0], 1e3 * own.at[1]) for own in drawn.actuators]
    places = [parse_place(text, "--accelerometer") for text in texts]
    for own in places:
        check_target(drawn, own, "--accelerometer")
    return places


def shaken(
    drawn: Board,
    plate: HiddenPlate | None,
    connection: Connection | None,
    places: Sequence[Place],
    kilograms: float,
    kept: Path | None,
) -> Calibrated:
    """What an accelerometer tells, at one place after another; kept as a laboratory's file.

    Places that the file has already are not read again.
    """
    emulator = None if plate is None else emulator_on(drawn, plate, listens=False)
    wire = EmulatorWire(emulator) if emulator is not None else _wire(connection)
    standing = None
    if plate is not None:
        standing = ShakenPlate(plate, Sensor(kilograms), 1e-3 * np.array(places))
    found = _read_before(drawn, kept, kilograms)
    with Device(wire) as device:
        _wait_for_coils(device)
        begun = wire.now_s()
        for number, (x_mm, y_mm) in enumerate(places):
            at = (1e-3 * x_mm, 1e-3 * y_mm)
            if any(np.hypot(*(own.places - at).T).min() < SAME_M for own in found):
                say(f"{x_mm:g}, {y_mm:g} mm is in {kept} already")
                continue
            if emulator is not None and standing is not None:
                standing.stand(emulator, number)
            else:
                text = f"Stand the accelerometer at {x_mm:g}, {y_mm:g} mm, and press Enter"
                typer.prompt(text, default="", show_default=False, err=True)
            with progress_bar("coils") as progress:
                found.append(read_motions(device, drawn, at, kilograms, progress))
            if kept is not None:
                write_whole(kept, fields_csv(joined(found)))
        seconds = wire.now_s() - begun
    by = "an accelerometer" if plate is None else _emulated("an accelerometer", plate)
    return _of_fields(drawn, joined(found), by, seconds)


def _read_before(drawn: Board, kept: Path | None, kilograms: float) -> list[MeasuredFields]:
    """What such a file has: moving a sensor by hand takes longer than all else."""
    if kept is None or not kept.exists():
        return []
    fields = read_measured(kept, drawn, "acceleration", "current")
    written = datetime.datetime.fromtimestamp(kept.stat().st_mtime).astimezone()
    places = len(np.unique(fields.places, axis=0))
    say(
        f"goes on from {kept}: {places} {'place' if places == 1 else 'places'}, the last of "
        f"{written:%Y-%m-%d %H:%M}. Are they of this plate? Another one needs a file of its own"
    )
    return [replace(fields, sensor_kg=kilograms)]


def _wire(connection: Connection | None) -> Wire:
    assert connection is not None
    return connection.wire()


def read(
    drawn: Board, plate: HiddenPlate | None, connection: Connection | None, kept: Path | None
) -> Calibrated:
    """What coils tell of each other."""
    if plate is None and connection is None:
        assert kept is not None
        readings, by = load_readings(kept, drawn), f"its own coils, {kept.name}"
    else:
        if plate is not None and drawn.sensing is None:
            say(
                "the board has no block [sensing]: a real device of it cannot read its coils "
                "until they are wired so (docs/calibrate.md)"
            )
        readings = _of_device(drawn, plate, connection, kept)
        by = _emulated("its own coils", plate) if plate is not None else "its own coils"
        if kept is not None:
            write_whole(kept, readings_file(readings, drawn))
    with progress_bar("plates") as progress:
        found = fit_board(
            drawn, readings, lambda done: progress(done, _of_so_many(done, EXPECTED_SOLUTIONS))
        )
    return Calibrated(found.board, found.parameters, by, readings.seconds)


def _of_device(
    drawn: Board, plate: HiddenPlate | None, connection: Connection | None, kept: Path | None
) -> CoilReadings:
    """Read now, or gone on with from what such a file has of some coils."""
    begun = Begun() if kept is None else load_begun(kept, drawn)
    if begun.coils:
        say(f"goes on from {kept}: {begun.coils} of {len(drawn.actuators)} coils are read")

    def keep(found: Begun) -> None:
        if kept is not None:
            write_whole(kept, begun_file(found, drawn))

    wire = _wire(connection) if plate is None else EmulatorWire(emulator_on(drawn, plate))
    with Device(wire) as device:
        _wait_for_coils(device)
        with progress_bar("coils") as progress:
            return read_coils(device, drawn, progress, begun, keep)


def _wait_for_coils(device: Device) -> None:
    """Until they have cooled, which a device that was just switched on is not sure of.

    Raises
    ------
    LinkError
        Something else keeps it from playing, or they are hot for longer.
    """
    ends = device.wire.now_s() + COOLS_S
    waits = False
    while what_stands(device.info(), by_host=True) == [COIL_HOT] and device.wire.now_s() < ends:
        if not waits:
            say("its coils may be hot from before it was switched on: waiting until they are not")
            waits = True
        device.link.wait(0.2)
    check_ready(device.info(), by_host=True)


def _emulated(what: str, plate: HiddenPlate) -> str:
    return f"{what}, emulated, {plate.name}"
