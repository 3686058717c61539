"""`chladni device`: ask a device, and tell it what to do."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from serial.tools import list_ports

from chladni.host.cli.common.options import JsonOption, required
from chladni.host.cli.common.output import answer, parse_place
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.cli.device.first_boot import walk
from chladni.host.cli.device.flash import flash
from chladni.host.cli.device.network import network
from chladni.host.device.device import Device
from chladni.host.device.link import LinkError
from chladni.host.device.stream_sources import (
    load_script,
    parse_drive,
    read_duties,
    scripted_duties,
)
from chladni.host.device.wire import SerialWire
from chladni.host.protocol.config import SETTINGS, DeviceConfig
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import ChladniError, ConflictError, InputError, check_one_of

REPEAT_S = 0.05
SELF_TEST_S = 0.6
FARTHEST_MM = 1000.0
"""More than any board; a touch off the board plays its nearest place."""
SELF_TEST_GAIN, SELF_TEST_STEPS = 0.5, 6
SELF_TEST_TRIES, SELF_TEST_SHARE, SELF_TEST_MA = 3, 0.25, 15
"""A busy machine may leave a gap in a drive, so once is not enough; and what is near enough."""
USB_VENDORS = {0x10C4, 0x1A86, 0x0403, 0x303A}
"""Silicon Labs, WCH, FTDI, Espressif: nothing is said to other instruments."""

device_app = typer.Typer(help="Ask a device and tell it what to do.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command("flash")(flash)
    device_app.command("network")(network)
    app.add_typer(device_app, name="device")


@device_app.command("info")
@connecting
def info(
    connection: Connection,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """State, table, heat and faults."""
    with connection.device() as device:
        version = device.version.fields
        result = {"link": f"{version['major']}.{version['minor']}"} | device.info()
        result["faults"] = device.faults()
    answer(result, as_json=as_json, title="Device")


@device_app.command("touch", context_settings={"ignore_unknown_options": True})
@connecting
def touch(
    connection: Connection,
    place: Annotated[str, typer.Argument(metavar="X,Y", help="Place in mm.")],
    seconds: Annotated[float, typer.Option(help="How long the finger stays.")] = 1.0,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Play a place for a while, as a finger would."""
    x, y = parse_place(place, "X,Y")
    if not 0.0 < seconds <= 60.0:
        raise InputError("--seconds", seconds, "more than 0, at most 60")
    if max(abs(x), abs(y)) > FARTHEST_MM:
        raise InputError("X,Y", place, f"within {FARTHEST_MM:g} mm of the board's centre")
    with connection.device() as device:
        device.touch(x, y)
        try:
            device.link.wait(seconds)
            state = device.info()["state"]
            faults = device.faults()
        finally:
            # Also when it is interrupted; a finger that is not lifted stays until `max_on_s`.
            device.lift()
    if state != "playing":
        why = f", {faults[-1]['cause']}" if faults else ""
        raise LinkError(f"the device did not play: {state}{why}")
    answer({"place_mm": [x, y], "seconds": seconds, "state": state}, as_json=as_json, title="Touch")


@device_app.command("stream")
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


@device_app.command("self-test")
@connecting
def self_test(
    connection: Connection,
    first_boot: Annotated[
        bool, typer.Option("--first-boot", help="Go through the first ten minutes, step by step.")
    ] = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Bring each actuator in turn up to half amplitude; report currents beside their limits."""
    if first_boot:
        with connection.device() as device:
            found = walk(device)
        answer({"steps": found}, as_json=as_json, title="First boot")
        return
    with connection.device() as device:
        channels, config = device.info()["channels"], device.config()
        before = device.info()["faults"]
        rows = []
        for channel in range(channels):
            full_ma = config["full_current_ma"][channel]
            # At half amplitude a sine and its bias take a quarter of what a duty of 1 does.
            expected = round(full_ma * SELF_TEST_GAIN / 2.0)
            for _ in range(SELF_TEST_TRIES):
                drawn = _draw(device, channel, channels)
                is_ok = abs(drawn - expected) <= max(SELF_TEST_SHARE * expected, SELF_TEST_MA)
                if is_ok:
                    break
            rows.append(
                {"channel": channel, "ok": is_ok, "supply_ma": drawn, "expected_ma": expected,
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


def _draw(device: Device, channel: int, channels: int) -> int:
    """Bring one channel up to half amplitude; mA that the device then estimates."""
    # The last step twice: the device's estimate is a mean of what went before.
    for step in (*range(1, SELF_TEST_STEPS + 1), SELF_TEST_STEPS):
        gains = [0j] * channels
        gains[channel] = complex(SELF_TEST_GAIN * step / SELF_TEST_STEPS)
        _play(device, gains, 160.0, "sine", SELF_TEST_S / SELF_TEST_STEPS)
    drawn = int(device.info()["supply_ma"])
    device.stop()
    device.link.wait(0.1)
    return drawn


def _faults_since(device: Device, before: int) -> list[dict[str, Any]]:
    """What was noted after there were so many; the device keeps the last sixteen."""
    count = device.info()["faults"] - before
    return device.faults()[-count:] if count > 0 else []


@device_app.command("log")
@connecting
def log(
    connection: Connection,
    seconds: Annotated[float, typer.Option(help="How long to listen.")] = 1.0,
) -> None:  # fmt: skip
    """Print what the device says between frames: boot, panics, the console."""
    if not 0.0 < seconds <= 3600.0:
        raise InputError("--seconds", seconds, "more than 0, at most 3600")
    if connection.udp is not None:
        raise ConflictError("--udp", "the log; text comes over --port only")
    with connection.device() as device:
        device.link.wait(seconds)
        sys.stdout.write(device.log)


@device_app.command("config")
@connecting
def config(
    connection: Connection,
    action: Annotated[str, typer.Argument(metavar="get|set", help="Show, or change.")] = "get",
    settings: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME=VALUE]…", help="Settings to change.")
    ] = None,
    rom: Annotated[
        bool, typer.Option("--rom", help="Set through the ROM's loader: the device need not run.")
    ] = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Show the configuration, or change settings and restart the device."""
    if action not in ("get", "set") or (action == "set" and not settings):
        raise InputError("get|set", action, "get, or set with at least one NAME=VALUE")
    changes = dict(map(parse_setting, settings or [])) if action == "set" else {}
    known = [setting.field.name for setting in SETTINGS]
    for name in (settings or []) if action == "get" else []:
        if name not in known:
            raise InputError("NAME", name, f"one of: {', '.join(known)}")
    if rom:
        found = _set_by_rom(connection, action, changes)
        written: dict[str, Any] = {name: found.values[name] for name in changes}
        answer(written, as_json=as_json, title="Written; the device starts with it")
        return
    with connection.device() as device:
        found = device.config()
        if changes:
            wanted = found.with_values(**changes)
            wanted.check_pins()
            device.set_config(wanted)
            device.restart()
            device.link.wait(1.0)
            found = device.config()
            if found != wanted:
                raise LinkError("the device started with another configuration")
    shown = settings if action == "get" and settings else known
    values = {name: list(v) if isinstance(v := found.values[name], tuple) else v for name in shown}
    answer(values, as_json=as_json, title="Configuration")


def _set_by_rom(connection: Connection, action: str, changes: dict[str, Any]) -> DeviceConfig:
    from chladni.host.flashing import rom_loader  # noqa: PLC0415  (esptool takes a second to load)

    if action != "set":
        raise ConflictError("--rom", "get; reading needs a running device")
    if connection.udp is not None or connection.emulator:
        raise ConflictError("--rom", "--udp and --emulator; the loader is at a --port")
    port = required("--port", connection.port, "where the chip's loader is")
    return rom_loader.change_config(port, connection.baud, changes)


@device_app.command("list")
def list_devices(as_json: JsonOption = False) -> None:
    """Serial ports with a USB bridge that boards have, and who answers there."""
    rows = []
    for port in list_ports.comports():
        if port.vid in USB_VENDORS:
            row: dict[str, str | None] = {"port": port.device, "what": port.description}
            rows.append(row | {"usb": f"{port.vid:04x}:{port.pid:04x}"} | who_answers(port.device))
    answer({"ports": rows}, as_json=as_json, title="Ports")


def who_answers(port: str) -> dict[str, str | None]:
    """The board of the table of the device at a port, or why there is none."""
    try:
        with Device(SerialWire(port)) as device:
            found = device.info()
    except ChladniError as error:
        return {"board": None, "why": str(error)}
    return {"board": found["board"] or "no table", "why": None}


def parse_setting(text: str) -> tuple[str, int | tuple[int, ...]]:
    """A name and its whole number, or numbers with commas.

    Raises
    ------
    InputError
        No such setting, or not of that form.
    """
    name, _, value = text.partition("=")
    known = {setting.field.name: setting for setting in SETTINGS}
    if name not in known:
        raise InputError(name, value, f"a setting: one of {', '.join(known)}")
    try:
        numbers = tuple(int(item, 0) for item in value.split(","))
    except ValueError:
        raise InputError(name, value, "whole numbers") from None
    parsed: int | tuple[int, ...] = numbers if known[name].field.count > 1 else numbers[0]
    DeviceConfig(**{name: parsed})
    return name, parsed


def _play(
    device: Device, gains: list[complex], frequency_hz: float, waveform: str, seconds: float
) -> None:
    """Repeat a live drive for a while, well within the device's timeout."""
    end = device.wire.now_s() + seconds
    while device.wire.now_s() < end:
        device.live(gains, frequency_hz, waveform)
        device.link.wait(REPEAT_S)
