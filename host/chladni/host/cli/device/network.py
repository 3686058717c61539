"""`chladni device network`: connect a device to a network, or disconnect it."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.host.cli.common.options import JsonOption, required
from chladni.host.cli.common.output import answer
from chladni.host.cli.common.ranges import UDP_PORTS
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.flashing import rom_loader
from chladni.host.protocol.network import (
    DEFAULT_PORT,
    NetworkSettings,
    make_key,
    read_key,
)
from chladni.sim.errors import ConflictError, InputError, MissingError
from chladni.sim.files import read_text

RESTART_S = 1.0
PASSPHRASE_FILE_BYTES = 1024
"""A passphrase has 63 at most, which `NetworkSettings` checks."""


@connecting
def network(
    connection: Connection,
    action: Annotated[str, typer.Argument(metavar="show|set|off")] = "show",
    ssid: Annotated[str | None, typer.Option(help="The network's name. Required to set.")] = None,
    passphrase_file: Annotated[
        Path | None, typer.Option(help="Its passphrase; asked for by default.")
    ] = None,
    udp_port: Annotated[
        int, typer.Option(callback=UDP_PORTS, help="Where the device listens.")
    ] = DEFAULT_PORT,
    rom: Annotated[
        bool, typer.Option("--rom", help="Off through the ROM's loader: the device need not run.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Show the network's state, or set name, passphrase and key over the wire; off forgets them.

    The key comes from --key, whose file is made if it is not there.
    """
    if action not in ("show", "set", "off"):
        raise InputError("show|set|off", action, "one of the three")
    if rom:
        if action != "off":
            raise ConflictError("--rom", action, hint="the loader can only take a network away")
        rom_loader.forget_network(connection.loader_port(), connection.baud)
        answer({"state": "off"}, as_json=as_json, title="Network")
        return
    settings = None
    if action != "show" and connection.udp is not None:
        hint = "keys are set over --port only"
        raise ConflictError("--udp", "the network's settings", hint=hint)
    if action == "set":
        settings = _settings(connection, ssid, passphrase_file, udp_port)
    with connection.device() as device:
        if action != "show":
            device.set_network(settings)
            device.restart()
            device.link.wait(RESTART_S)
        found: dict[str, Any] = device.network()
    answer(found, as_json=as_json, title="Network")


def _settings(
    connection: Connection, ssid: str | None, passphrase_file: Path | None, port: int
) -> NetworkSettings:
    name = required("--ssid", ssid, "the network's name")
    file = required("--key", connection.key, "a file with the key, or where to make one")
    # All but the key is checked before a file is made for it, the name before a question is asked.
    probe = NetworkSettings(name, "", b"\1" * 32, port)
    probe = replace(probe, passphrase=_passphrase(passphrase_file))
    key = read_key(file) if os.path.lexists(file) else make_key(file)
    return NetworkSettings(probe.ssid, probe.passphrase, key, probe.port)


def _passphrase(path: Path | None) -> str:
    if path is None:
        if not sys.stdin.isatty():
            raise MissingError("--passphrase-file", "there is no terminal to ask for it")
        return str(typer.prompt("Passphrase", hide_input=True, default="", show_default=False))
    return read_text(path, "--passphrase-file", PASSPHRASE_FILE_BYTES).rstrip("\r\n")
