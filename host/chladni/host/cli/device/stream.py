"""`chladni device stream`: a drive or duties that this machine plays."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.host.cli.common.options import JsonOption, check_one_of
from chladni.host.cli.common.output import answer
from chladni.host.cli.common.ranges import TABLE_FREQUENCIES, within
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.device.checks.readiness import check_ready
from chladni.host.device.checks.self_test import faults_since
from chladni.host.device.live_drive import play_for
from chladni.host.device.stream_sources import (
    load_script,
    parse_drive,
    read_duties,
    scripted_duties,
)
from chladni.host.device.streaming import check_duties
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import InputError


@connecting
def stream(
    connection: Connection,
    drive: Annotated[
        str | None, typer.Argument(help="Gain@degrees per channel: 1@0,0.5@90,…")
    ] = None,
    csv: Annotated[
        Path | None,
        typer.Option(
            "--csv", help="Duties instead: a row per frame, 0 to 1, or -1 to 1 for bridges."
        ),
    ] = None,
    script: Annotated[
        Path | None,
        typer.Option("--script", help="A Python file with duties(t): times in s to duties."),
    ] = None,
    frequency: Annotated[float, typer.Option(callback=TABLE_FREQUENCIES, help="Hz.")] = 160.0,
    waveform: Annotated[str, typer.Option(help="sine, triangle, square or ramp.")] = "sine",
    seconds: Annotated[
        float,
        typer.Option(
            callback=within(0.0, 600.0, "s", above=True), help="How long a drive or a script plays."
        ),
    ] = 1.0,
    as_json: JsonOption = False,
) -> None:
    """Play a drive from this computer, or raw duties, carrier/8 of them a second."""
    check_one_of(
        "what to play", DRIVE=drive is not None, csv=csv is not None, script=script is not None
    )
    if waveform not in WAVEFORMS:
        raise InputError("--waveform", waveform, ", ".join(WAVEFORMS))
    gains = parse_drive(drive) if drive is not None else None
    duties = None if csv is None else read_duties(csv)
    function = None if script is None else load_script(script)
    with connection.device() as device:
        info = device.info()
        channels, before, config = info["channels"], info["faults"], device.config()
        if function is not None:
            duties = scripted_duties(function, config.frame_rate_hz, seconds)
        if duties is not None:
            name = "csv" if script is None else "script"
            check_duties(duties, config.has_bridges, name, str(csv or script))
        if gains is not None and len(gains) != channels:
            raise InputError("DRIVE", len(gains), f"{channels} channels")
        if duties is not None and duties.shape[1] != channels:
            name = "--csv" if script is None else "--script"
            raise InputError(name, duties.shape[1], f"{channels} channels")
        check_ready(info, by_host=True)
        result: dict[str, Any] = {}
        if duties is not None:
            result["frames"] = device.stream(duties)
        elif gains is not None:
            play_for(device, gains, frequency, waveform, seconds)
            result["seconds"] = seconds
        result["supply_ma"] = device.info()["supply_ma"]
        device.stop()
        result["faults"] = faults_since(device, before)
    answer(result, as_json=as_json, title="Stream")
