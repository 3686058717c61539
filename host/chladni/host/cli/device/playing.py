"""Commands that play from this computer: a stream, and every coil one by one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.host.cli.common.options import JsonOption, check_one_of
from chladni.host.cli.common.output import answer, say
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.cli.device.first_boot import walk
from chladni.host.device.link import LinkError
from chladni.host.device.self_test import SELF_TEST_S, faults_since, play_for, try_channel
from chladni.host.device.stream_sources import (
    load_script,
    parse_drive,
    read_duties,
    scripted_duties,
)
from chladni.host.protocol.config import DeviceConfig
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import InputError


@connecting
def stream(
    connection: Connection,
    drive: Annotated[
        str | None, typer.Argument(help="Gain@degrees per channel: 1@0,0.5@90,…")
    ] = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", help="Duties instead, 0 to 1: a row per frame.")
    ] = None,
    script: Annotated[
        Path | None,
        typer.Option("--script", help="A Python file with duties(t): times in s to duties."),
    ] = None,
    frequency: Annotated[float, typer.Option(help="Hz.")] = 160.0,
    waveform: Annotated[str, typer.Option(help="sine, triangle, square or ramp.")] = "sine",
    seconds: Annotated[float, typer.Option(help="How long a drive or a script plays.")] = 1.0,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Play a drive from this computer, or raw duties, carrier/8 of them a second."""
    check_one_of(
        "what to play", DRIVE=drive is not None, csv=csv is not None, script=script is not None
    )
    if not 1.0 <= frequency <= 1000.0:
        raise InputError("--frequency", frequency, "1 to 1000 Hz")
    if waveform not in WAVEFORMS:
        raise InputError("--waveform", waveform, ", ".join(WAVEFORMS))
    if not 0.0 < seconds <= 600.0:
        raise InputError("--seconds", seconds, "more than 0, at most 600")
    gains = parse_drive(drive) if drive is not None else None
    duties = None if csv is None else read_duties(csv)
    function = None if script is None else load_script(script)
    with connection.device() as device:
        info = device.info()
        channels, before = info["channels"], info["faults"]
        if function is not None:
            duties = scripted_duties(function, device.config().frame_rate_hz, seconds)
        if gains is not None and len(gains) != channels:
            raise InputError("DRIVE", len(gains), f"{channels} channels")
        if duties is not None and duties.shape[1] != channels:
            name = "--csv" if script is None else "--script"
            raise InputError(name, duties.shape[1], f"{channels} channels")
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


@connecting
def self_test(
    connection: Connection,
    first_boot: Annotated[
        bool, typer.Option("--first-boot", help="Go through the first ten minutes, step by step.")
    ] = False,
    channel: Annotated[
        int | None, typer.Option(help="Only this one, counted from 0.")
    ] = None,
    seconds: Annotated[
        float, typer.Option(help="How long each plays.")
    ] = SELF_TEST_S,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Bring each actuator in turn up to half amplitude; report currents beside their limits."""
    if not SELF_TEST_S <= seconds <= 10.0:
        raise InputError("--seconds", seconds, f"{SELF_TEST_S:g} to 10")
    if first_boot:
        with connection.device() as device:
            found = walk(device)
        answer({"steps": found}, as_json=as_json, title="First boot")
        return
    with connection.device() as device:
        channels, config = device.info()["channels"], device.config()
        if channel is not None and not 0 <= channel < channels:
            raise InputError("--channel", channel, f"0 to {channels - 1}")
        before = device.info()["faults"]
        tested = range(channels) if channel is None else [channel]
        rows = [try_channel(device, own, config, seconds) for own in _said(tested, config)]
        faults = faults_since(device, before)
    answer(
        {"channels": rows, "supply_limit_ma": config["supply_ma"], "faults": faults},
        as_json=as_json, title="Self-test",
    )  # fmt: skip
    failed = [str(row["channel"]) for row in rows if not row["ok"]]
    if failed:
        raise LinkError(
            f"channels that draw something else: {', '.join(failed)}",
            hint="look at each one's coil, diode and supply, or mend electronics.coil_ohm",
        )


def _said(channels: Iterable[int], config: DeviceConfig) -> Iterator[int]:
    """Channels, each announced before it plays."""
    for own in channels:
        say(f"channel {own}, GPIO {config['pwm_pins'][own]}, plays")
        yield own
