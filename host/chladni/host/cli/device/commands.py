"""`chladni device`: query and control a device."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from serial.tools import list_ports

from chladni.host.cli.common.command_group import CommandGroup
from chladni.host.cli.common.options import JsonOption
from chladni.host.cli.common.output import answer
from chladni.host.cli.common.ranges import TABLE_FREQUENCIES, within
from chladni.host.cli.device.config import config
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.cli.device.flash import flash
from chladni.host.cli.device.network import network
from chladni.host.cli.device.self_test import self_test
from chladni.host.cli.device.stream import stream
from chladni.host.cli.device.touch import touch, touches
from chladni.host.device.checks.info_rows import finger_rows, info_rows
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import USB_VENDORS, SerialWire
from chladni.host.protocol.network import make_key
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import ChladniError, ConflictError, InputError

FINGERS_SINCE_MINOR, BANKS_SINCE_MINOR = 4, 6
"""Of the link: older devices are not asked."""
device_app = typer.Typer(cls=CommandGroup, help="Query and control a device.", no_args_is_help=True)
key_app = typer.Typer(
    cls=CommandGroup,
    help="Keys by which a device recognises hosts on a network.",
    no_args_is_help=True,
)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command("flash")(flash)
    app.add_typer(device_app, name="device")


@device_app.command("info")
@connecting
def info(connection: Connection, as_json: JsonOption = False) -> None:
    """Show state, table, heat and faults."""
    with connection.device() as device:
        version = device.version.fields
        result = {"link": f"{version['major']}.{version['minor']}"} | device.info()
        result["faults"] = device.faults()
        knows_fingers = version["minor"] >= FINGERS_SINCE_MINOR
        result["fingers"] = device.fingers.all() if knows_fingers else []
        knows_banks = version["minor"] >= BANKS_SINCE_MINOR
        result["bank"] = device.effects.summary() if knows_banks else None
        has_bank = knows_banks and device.effects.has_bank()
    rows = info_rows(result) | finger_rows(result["fingers"], has_bank=has_bank)
    answer(result if as_json else rows, as_json=as_json, title="Device")


device_app.command("touch", context_settings={"ignore_unknown_options": True})(touch)
device_app.command("touches")(touches)


@device_app.command("frequency")
@connecting
def frequency(
    connection: Connection,
    hertz: Annotated[
        float,
        typer.Argument(metavar="HZ", callback=TABLE_FREQUENCIES, help="One of the table's, Hz."),
    ],
    as_json: JsonOption = False,
) -> None:
    """Play the table's drives of another frequency, until the next start."""
    with connection.device() as device:
        device.select_frequency(hertz)
        found = device.info()["frequency_millihertz"] / 1e3
    answer({"frequency_hz": found}, as_json=as_json, title="Touches play")


@device_app.command("waveform")
@connecting
def waveform(
    connection: Connection,
    name: Annotated[str, typer.Argument(metavar="NAME", help=f"{', '.join(WAVEFORMS)}.")],
    as_json: JsonOption = False,
) -> None:
    """Play touches with another wave, until the next start."""
    if name not in WAVEFORMS:
        raise InputError("NAME", name, f"one of: {', '.join(WAVEFORMS)}")
    with connection.device() as device:
        device.set_waveform(name)
    answer({"waveform": name}, as_json=as_json, title="Touches play")


@key_app.command("new")
def new_key(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="To make; only you may read it.")],
    as_json: JsonOption = False,
) -> None:
    """Make a key for `device network set --key`."""
    key = make_key(file)
    answer({"path": str(file), "bytes": len(key)}, as_json=as_json, title="A new key")


@device_app.command("log")
@connecting
def log(
    connection: Connection,
    seconds: Annotated[
        float,
        typer.Option(callback=within(0.0, 3600.0, "s", above=True), help="How long to listen."),
    ] = 1.0,
) -> None:
    """Print the device's own text: boot messages, panics, the console."""
    if connection.udp is not None:
        raise ConflictError("--udp", "the log", hint="text comes over --port only")
    with connection.device() as device:
        device.link.wait(seconds)
        sys.stdout.write(device.log)


@device_app.command("list")
def list_devices(as_json: JsonOption = False) -> None:
    """List serial ports with a USB bridge that boards have, and the device at each."""
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


for name, command in (
    ("network", network),
    ("config", config),
    ("stream", stream),
    ("self-test", self_test),
):
    device_app.command(name)(command)
device_app.add_typer(key_app, name="key")
