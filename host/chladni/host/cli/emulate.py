"""`chladni emulate`: the firmware on a virtual clock, or offered as a device to other programs."""

from __future__ import annotations

import contextlib
import os
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from chladni.host.cli.common.drive_options import on_less_for
from chladni.host.cli.common.options import JsonOption, required
from chladni.host.cli.common.output import ARRAYS, answer, check_output, parse_place, say
from chladni.host.cli.common.ranges import LONGEST_S, TABLE_FREQUENCIES, UDP_PORTS, within
from chladni.host.device.wires.virtual_port import VirtualPort
from chladni.host.emulation.emulator import LEVEL, Emulator, TouchEvent, fitting_hardware
from chladni.host.emulation.flash_file import FlashFile
from chladni.host.protocol.config import DeviceConfig
from chladni.host.protocol.network import DEFAULT_PORT, NetworkSettings, read_key
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.errors import ConflictError, InputError, MissingError
from chladni.sim.files import write_arrays
from chladni.tables.format import read_table
from chladni.tables.inspection.owner import board_for, known_board
from chladni.tables.table import Table

if TYPE_CHECKING:
    from chladni.calibration.hidden import HiddenPlate
    from chladni.host.emulation.closed_loop import LoopReport
    from chladni.host.emulation.touches import TouchScore

ANSWERED = ("latency_ms", "reported_ms", "channels", "region", "target_mm", "ssim", "ssim_table")
"""Of a report, in this order."""
SHOWN = ("at_ms", "target_mm", "settled", "second_finger_db", "focal_error_mm", "played_um")
"""Of every touch, to people."""
UNLESS_SERIAL = "Required without --serial."
PANEL_RUNS_MS = 50.0
"""From power-on: an FT6x36 looks every 40 ms until it is told to stay awake."""
DURATIONS = within(0.0, LONGEST_S * 1e3, "ms")
LEVELS = within(0.0, 1.0, above=True)
TouchOption = Annotated[
    list[str] | None,
    typer.Option(
        help="Touch X,Y@MS: place in mm, time in ms; a later one moves the same finger. "
        f"{UNLESS_SERIAL}"
    ),
]
DurationOption = Annotated[
    float | None,
    typer.Option("--ms", callback=DURATIONS, help=f"How long to run, ms. {UNLESS_SERIAL}"),
]
RecordingOption = Annotated[
    Path | None,
    typer.Option("-o", "--output", help=f"Recording to write (.npz). {UNLESS_SERIAL}"),
]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("emulate")(emulate)


def emulate(
    table: Annotated[
        Path | None, typer.Argument(metavar="[TABLE]", help="Table file (.chl), unless --flash.")
    ] = None,
    touch: TouchOption = None,
    ms: DurationOption = None,
    output: RecordingOption = None,
    serial: Annotated[
        bool, typer.Option("--serial", help="Offer the device on a pseudo-terminal instead.")
    ] = False,
    flash: Annotated[
        Path | None,
        typer.Option(
            help="With --serial: a device that keeps its flash in this file; new if none."
        ),
    ] = None,
    port_link: Annotated[
        Path | None, typer.Option(help="With --serial: a link to the port, with a fixed name.")
    ] = None,
    key: Annotated[
        Path | None, typer.Option(help="With --serial: on UDP too, at 127.0.0.1, under this key.")
    ] = None,
    udp_port: Annotated[
        int, typer.Option(callback=UDP_PORTS, help="Where, with --key.")
    ] = DEFAULT_PORT,
    hidden: Annotated[
        str | None,
        typer.Option(
            metavar="SEED",
            help="With --serial: its coils are those of this plate, for `calibrate --port`. "
            "SEED, BOARD@SEED or FILE.toml, as of `calibrate --hidden`.",
        ),
    ] = None,
    lift: Annotated[
        list[float] | None, typer.Option(callback=DURATIONS, help="Lift the finger at MS.")
    ] = None,
    board: Annotated[
        str | None,
        typer.Option(
            help="The table's board, if not shipped nor beside it; with --flash, its panel's."
        ),
    ] = None,
    level: Annotated[
        float, typer.Option(callback=LEVELS, help="Share of full amplitude, 0 to 1.")
    ] = LEVEL,
    frequency: Annotated[
        float | None,
        typer.Option(
            callback=TABLE_FREQUENCIES, help="Play the table's drives of this frequency, Hz."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run the firmware on touches, record its pins, and score the field they make."""
    of_served = {"--key": key, "--flash": flash, "--port-link": port_link, "--hidden": hidden}
    for option, of_serial in of_served.items():
        if of_serial is not None and not serial:
            raise MissingError("--serial", f"{option} is of the device that it serves")
    if serial:
        for option, given in (("--touch", touch), ("--lift", lift), ("-o", output)):
            if given:
                hint = "that serves a device until it is stopped"
                raise ConflictError(option, "--serial", hint=hint)
        network = NetworkSettings("emulated", "", read_key(key), udp_port) if key else None
        _serve(_device(table, board, level, flash, network, hidden), ms, port_link, as_json=as_json)
        return
    # Scores take half a second to load, and a device that is served gives none.
    from chladni.host.cli.common.verdicts import of_place  # noqa: PLC0415
    from chladni.host.emulation.closed_loop import run_alone, run_loop  # noqa: PLC0415

    loaded = read_table(required("TABLE", table, "a table file (.chl)"))
    touches = required("--touch", touch, "X,Y@MS: a place in mm and a time in ms")
    run_ms = required("--ms", ms, "how long to run, ms")
    file = check_output(required("-o", output, "a file to write (.npz)"), "-o", ARRAYS)
    for at in lift or []:
        if not 0.0 <= at < run_ms:
            raise InputError("--lift", at, f"a time from 0 to {run_ms:g} ms")
    events = _events(touches, lift or [])
    owner = on_less_for(loaded, board_for(loaded, board, file=str(table)))
    result: dict[str, Any]
    if loaded.sections:
        recording, report = run_loop(
            loaded, owner, events, run_ms, level=level, frequency_hz=frequency
        )
        section = loaded.section(frequency)
        card, several = report.touches[-1].card, owner.is_for_several
        told = of_place(card, frequency_hz=section.frequency_hz, for_fingers=several)
        result = _scored(owner, report) | {"objective": section.objective}
        played_um = report.touches[-1].played_um
        if not as_json:
            result["touches"] = [{name: own[name] for name in SHOWN} for own in result["touches"]]
    else:
        recording, alone = run_alone(loaded, owner, events, run_ms, level=level)
        told = of_place(alone.card, frequency_hz=owner.drive.frequency_hz, for_fingers=True)
        result = {own: getattr(alone, own) for own in ("latency_ms", "reported_ms", "target_mm")}
        # A finger's own drive is no focus: people would take its rows for a failure.
        result |= (alone.card.by_key() if as_json else {}) | {"objective": "only responses"}
        played_um = alone.played_um
    write_arrays(file, t_s=recording.t_s, duty=recording.duty, carrier_hz=recording.carrier_hz)
    _say_of_the_panel(owner, result["reported_ms"])
    first = {"verdict": told + _in_recording(played_um, level)}
    result = first | result | {"played_um": played_um, "path": str(file)}
    answer(result, as_json=as_json, title=f"{table} on the emulated board")
    _say_of_others(loaded, owner, board, table, as_json=as_json)


def _in_recording(played_um: float | None, level: float) -> str:
    """What the finger gets there; the scorecard has what limits allow."""
    if played_um is None:
        return ""
    return (
        " So much a coil's limits allow without end. In the recording, at --level "
        f"{level:g}, it is {played_um:.2g} µm."
    )


def _say_of_others(
    loaded: Table, owner: Board, board: str | None, named: Path | None, *, as_json: bool
) -> None:
    if not loaded.sections and not as_json:
        named_board = board or known_board(loaded, str(named)) or owner.name
        say(f"`chladni fingers {named_board} --table {named}` tells what other fingers get")


def _say_of_the_panel(board: Board, reported_ms: float) -> None:
    if board.panel is not None and reported_ms > board.panel.report_ms + 1.0:
        say(
            "the panel was just powered on and reported the first touch after "
            f"{reported_ms:.1f} ms; @{PANEL_RUNS_MS:g} or later is a touch on a running panel"
        )


def _events(touches: list[str], lifts: list[float]) -> list[TouchEvent]:
    """Of one finger, which is at one place at a time."""
    events = [_parse_touch(text) for text in touches]
    seen: set[float] = set()
    for text, event in zip(touches, events, strict=True):
        if event.at_ms in seen:
            expected = "a time of its own: one finger goes from place to place"
            hint = "`chladni fingers --table` and `chladni play --other` have several"
            raise InputError("--touch", text, expected, hint=hint)
        seen.add(event.at_ms)
    return events + [TouchEvent(at, None) for at in lifts]


def _scored(board: Board, report: LoopReport) -> dict[str, Any]:
    """The last touch's report, what a finger feels of it, and the score of every touch."""
    result: dict[str, Any] = {name: getattr(report, name) for name in ANSWERED}
    result["channels"] = [
        {"actuator": actuator.name, **asdict(channel)}
        for actuator, channel in zip(board.actuators, report.channels, strict=True)
    ]
    last = report.touches[-1].card
    assert last.felt is not None
    result |= asdict(last.felt) | {"remark": last.remark}
    return result | {"touches": [_touch(touch) for touch in report.touches]}


def _touch(touch: TouchScore) -> dict[str, Any]:
    """One touch of many, with its scorecard as `chladni solve --json` names it."""
    return {
        "at_ms": touch.at_ms,
        "target_mm": list(touch.target_mm),
        "region": touch.region,
        "settled": touch.settled,
        "played_um": touch.played_um,
        **touch.card.by_key(),
    }


def _device(
    table: Path | None,
    board: str | None,
    level: float,
    flash: Path | None,
    network: NetworkSettings | None,
    hidden: str | None,
) -> VirtualPort:
    """A device to serve: with a table and configured for it, or with what its flash file holds."""
    if flash is None:
        loaded = read_table(required("TABLE", table, "a table file (.chl), or --flash"))
        owner = board_for(loaded, board, file=str(table))
        plate = _plate(owner, hidden)
        emulator = Emulator(owner, loaded, level=level, network=network)
        _lay_on(emulator, plate)
        return VirtualPort(emulator)
    if table is not None:
        raise ConflictError("TABLE", "--flash", hint="flash the table to that device")
    named = load_board(board) if board is not None else None
    hardware = fitting_hardware(named, is_rested=False)
    plate = _plate(named, hidden)
    held = FlashFile(flash)
    emulator = Emulator(
        DeviceConfig(),
        None,
        hardware=hardware,
        must_play=False,
        flash=held.contents,
        network=network,
    )
    _lay_on(emulator, plate)
    held.follow(emulator.core)
    return VirtualPort(emulator, held)


def _plate(board: Board | None, hidden: str | None) -> HiddenPlate | None:
    """The one that its coils are on."""
    if hidden is None:
        return None
    # Plates take a second to load, which no other device that is served needs.
    from chladni.host.cli.common.hidden_plates import named_plate  # noqa: PLC0415

    return named_plate(required("--board", board, "whose plate it is"), hidden)


def _lay_on(emulator: Emulator, plate: HiddenPlate | None) -> None:
    """Let it hear what the coils of a hidden plate do."""
    if plate is None:
        return
    from chladni.host.emulation.sensed_plate import lay_on  # noqa: PLC0415  (as above)

    lay_on(emulator, plate)


def _serve(port: VirtualPort, ms: float | None, port_link: Path | None, *, as_json: bool) -> None:
    """Offer the emulated device on a pseudo-terminal, for ever or for so long."""
    # A port that is announced is there.
    port.network.follow()
    try:
        if port_link is not None:
            _link(port_link, port.port)
        if as_json:
            answer({"port": port.port, "udp_port": port.emulator.core.network_port}, as_json=True)
        else:
            sys.stdout.write(f"{port_link or port.port}\n")
        sys.stdout.flush()
        end = None if ms is None else time.monotonic() + ms / 1e3
        port.serve(lambda: end is not None and time.monotonic() > end)
    except KeyboardInterrupt:
        pass
    finally:
        port.close()
        if port_link is not None:
            _unlink(port_link, port.port)


def _link(link: Path, port: str) -> None:
    """Give a port a name of one's own; one that an earlier device left is replaced."""
    try:
        if link.is_symlink():
            link.unlink()
        link.symlink_to(port)
    except OSError as error:
        raise InputError(
            "--port-link", str(link), f"a name that is free: {error.strerror}"
        ) from None


def _unlink(link: Path, port: str) -> None:
    """Take the name away, unless another device has it by now."""
    with contextlib.suppress(OSError):
        if os.readlink(link) == port:
            link.unlink()


def _parse_touch(text: str) -> TouchEvent:
    place, mark, at = text.partition("@")
    try:
        at_ms = float(at)
    except ValueError:
        at_ms = float("nan")
    if not mark or not np.isfinite(at_ms):
        raise InputError("--touch", text, "X,Y@MS: a place in mm and a time in ms")
    return TouchEvent(at_ms, parse_place(place, "--touch"))
