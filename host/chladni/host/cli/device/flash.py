"""`chladni flash`: a table, or the firmware itself, onto a device."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from chladni.host.cli.common.options import JsonOption, check_one_of, required
from chladni.host.cli.common.output import answer, progress_bar, say
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.device.checks.readiness import obstacle
from chladni.host.device.device import Device
from chladni.host.flashing import rom_loader
from chladni.sim.errors import ConflictError, InputError
from chladni.tables.format import pack, read_table


@connecting
def flash(
    connection: Connection,
    table: Annotated[
        Path | None, typer.Argument(metavar="TABLE", help="Table file (.chl).")
    ] = None,
    previous: Annotated[
        bool, typer.Option("--previous", help="Go back to the table before this one.")
    ] = False,
    rom: Annotated[
        bool, typer.Option("--rom", help="Through the ROM's loader: the device need not run.")
    ] = False,
    firmware: Annotated[
        Path | None, typer.Option("--firmware", help="The firmware itself, through the loader.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Also a table of another board, if channels agree.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a table to a device; the old one stays until the new one is complete."""
    check_one_of(
        "what to write", TABLE=table is not None, previous=previous, firmware=firmware is not None
    )
    if rom or firmware is not None:
        _flash_by_rom(connection, table, firmware, as_json=as_json)
        return
    loaded = None if table is None else read_table(table)
    with connection.device() as device:
        if loaded is None:
            slot = device.previous()
            result: dict[str, Any] = {"slot": slot, "board": device.info()["board"]}
            answer(result, as_json=as_json, title=_what_plays("The previous table", device))
            return
        try:
            with progress_bar("flash", kept=not connection.emulator) as progress:
                done = device.flash(loaded, progress, force=force)
        except InputError as error:
            raise error.in_file(str(table)) from None
        done.check_verified()
        title = _what_plays(str(table), device)
    answer(asdict(done), as_json=as_json, title=title)


def _what_plays(name: str, device: Device) -> str:
    """A title: whether a table that was written plays. What stands in its way goes to stderr."""
    found = obstacle(device.info())
    if found is None:
        return f"{name} plays"
    say(f"{found.text}; {found.hint}")
    return f"{name} is written"


def _flash_by_rom(
    connection: Connection, table: Path | None, firmware: Path | None, *, as_json: bool
) -> None:
    port = required("--port", connection.port, "the ROM's loader answers on a serial port only")
    begun = time.monotonic()
    if firmware is not None:
        result = rom_loader.flash_firmware(port, connection.baud, firmware)
    else:
        if table is None:
            raise ConflictError("--rom", "--previous", hint="going back needs a running device")
        result = rom_loader.flash_table(port, connection.baud, pack(read_table(table)))
    result["seconds"] = time.monotonic() - begun
    answer(result, as_json=as_json, title=f"{firmware or table} is written")
