"""Commands that play from here: a stream, and every coil one by one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.host.cli.common.options import JsonOption
from chladni.host.cli.common.output import answer, say
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.cli.device.first_boot import walk
from chladni.host.device.device import Device
from chladni.host.device.link import LinkError
from chladni.host.device.stream_sources import (
    load_script,
    parse_drive,
    read_duties,
    scripted_duties,
)
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import InputError, check_one_of

REPEAT_S = 0.05
SELF_TEST_S = 0.6
SELF_TEST_GAIN, SELF_TEST_STEPS = 0.5, 6
SELF_TEST_TRIES, SELF_TEST_SHARE, SELF_TEST_MA = 3, 0.25, 15
"""A busy machine may leave a gap in a drive, so once is not enough; and what is near enough."""


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
    """Play a drive from here, as the paper's host did, or raw duties at carrier/8 a second."""
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
            _play(device, gains, frequency, waveform, seconds)
            result["seconds"] = seconds
        result["supply_ma"] = device.info()["supply_ma"]
        device.stop()
        result["faults"] = _faults_since(device, before)
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
        float, typer.Option(help="How long each plays: long enough to find it by hand.")
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
        rows = []
        for own in range(channels) if channel is None else [channel]:
            say(f"channel {own}, GPIO {config['pwm_pins'][own]}, plays")
            full_ma = config["full_current_ma"][own]
            # At half amplitude a sine and its bias take a quarter of what a duty of 1 does.
            share = abs(config["coil_gain_q15"][own]) / 32767.0
            expected = round(full_ma * share * SELF_TEST_GAIN / 2.0)
            for _ in range(SELF_TEST_TRIES):
                drawn = _draw(device, own, channels, seconds)
                is_ok = abs(drawn - expected) <= max(SELF_TEST_SHARE * expected, SELF_TEST_MA)
                if is_ok:
                    break
            rows.append(
                {"channel": own, "ok": is_ok, "supply_ma": drawn, "expected_ma": expected,
                 "full_current_ma": full_ma}
            )  # fmt: skip
        faults = _faults_since(device, before)
    answer(
        {"channels": rows, "supply_limit_ma": config["supply_ma"], "faults": faults},
        as_json=as_json, title="Self-test",
    )  # fmt: skip
    failed = [str(row["channel"]) for row in rows if not row["ok"]]
    if failed:
        raise LinkError(f"channels that draw something else: {', '.join(failed)}")


def _draw(device: Device, channel: int, channels: int, seconds: float) -> int:
    """Bring one channel up to half amplitude; mA that the device then estimates."""
    # The last step twice: the device's estimate is a mean of what went before.
    for step in (*range(1, SELF_TEST_STEPS + 1), SELF_TEST_STEPS):
        gains = [0j] * channels
        gains[channel] = complex(SELF_TEST_GAIN * step / SELF_TEST_STEPS)
        _play(device, gains, 160.0, "sine", seconds / SELF_TEST_STEPS)
    drawn = int(device.info()["supply_ma"])
    device.stop()
    device.link.wait(0.1)
    return drawn


def _faults_since(device: Device, before: int) -> list[dict[str, Any]]:
    """What was noted after there were so many; the device keeps the last sixteen."""
    count = device.info()["faults"] - before
    return device.faults()[-count:] if count > 0 else []


def _play(
    device: Device, gains: list[complex], frequency_hz: float, waveform: str, seconds: float
) -> None:
    """Repeat a live drive for a while, well within the device's timeout."""
    end = device.wire.now_s() + seconds
    while device.wire.now_s() < end:
        device.live(gains, frequency_hz, waveform)
        device.link.wait(REPEAT_S)
