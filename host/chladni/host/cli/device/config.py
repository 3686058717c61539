"""`chladni device config`: the settings of a device, one or all of them."""

from __future__ import annotations

import sys
from typing import Annotated, Any

import typer

from chladni.host.cli.common.options import JsonOption
from chladni.host.cli.common.output import answer, say
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.device.configure import has_driver, restart_with
from chladni.host.flashing import rom_loader
from chladni.host.protocol.board_config import board_settings, check_chip, check_driver
from chladni.host.protocol.config import DeviceConfig
from chladni.host.protocol.settings import (
    BOTH_RAMPS,
    RAMPS,
    SHOWN,
    changes,
    described,
    find,
    for_json,
    parse_setting,
)
from chladni.sim.board.board import Board, is_of
from chladni.sim.board.electronics import NOT_WIRED, Electronics
from chladni.sim.board.file import load_board
from chladni.sim.errors import ArgumentError, ConflictError, InputError, MissingError

ACTIONS = ("get", "describe", "set")


@connecting
def config(
    connection: Connection,
    action: Annotated[
        str, typer.Argument(metavar="get|describe|set", help="Show, explain, or change.")
    ] = "get",
    settings: Annotated[
        list[str] | None,
        typer.Argument(metavar="[NAME[=VALUE]]…", help="Settings; with units, as level=0.8."),
    ] = None,
    source: Annotated[
        str | None, typer.Option("--from", metavar="BOARD", help="Set all that a board file has.")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask first.")] = False,
    change_driver: Annotated[
        bool,
        typer.Option("--change-driver", help="From switches to bridges, or back: it is rewired."),
    ] = False,
    rom: Annotated[
        bool, typer.Option("--rom", help="Set through the ROM's loader: the device need not run.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Show the configuration, explain it, or change it and restart the device."""
    names = settings or []
    if action != "set":
        names = [one for name in names for one in (RAMPS if name == BOTH_RAMPS else (name,))]
    if action not in ACTIONS or (action == "set" and not (names or source)):
        expected = "get, describe, or set with --from BOARD or at least one NAME=VALUE"
        raise InputError("get|describe|set", action, expected)
    if action != "set" and source is not None:
        raise ConflictError("--from", action, hint="a board file is for set")
    if action == "describe":
        _describe(names, as_json=as_json)
    elif action == "get":
        if rom:
            raise ConflictError("--rom", "get", hint="reading needs a running device")
        _show(connection, names, as_json=as_json)
    else:
        _set(
            connection,
            names,
            source,
            yes=yes,
            rom=rom,
            change_driver=change_driver,
            as_json=as_json,
        )


def _describe(names: list[str], *, as_json: bool) -> None:
    """What settings there are; no device is needed."""
    wanted = {find(name).raw_name for name in names}
    rows = [row for row in described() if not wanted or row["record"] in wanted]
    if as_json:
        answer({"settings": rows}, as_json=True)
        return
    shown = {
        _label(row["name"]): f"{row['meaning']} {row['expected']}. Default {row['default']}."
        for row in rows
    }
    answer(shown, as_json=False, title="Settings")


def _show(connection: Connection, names: list[str], *, as_json: bool) -> None:
    asked = {name: find(name) for name in names} or {
        raw if as_json else own.name: own for raw, own in SHOWN.items()
    }
    with connection.device() as device:
        found = device.config()
        known = found.board
    if not as_json:
        values: dict[str, Any] = {"board": known[1] if known else "none; never set from a file"}
        count = found["channels"]
        values |= {
            _label(name): own.text(found[own.raw_name], count)
            for name, own in asked.items()
            if own.raw_name != "board_id"
        }
        answer(values, as_json=False, title="Configuration")
        return
    answer({name: own.for_json(found[own.raw_name]) for name, own in asked.items()}, as_json=True)


def _label(name: str) -> str:
    """A setting's own name, its unit with it: `supply_ma` is no current that a coil draws."""
    return name.replace("_", " ")


def _set(
    connection: Connection,
    names: list[str],
    source: str | None,
    *,
    yes: bool,
    rom: bool,
    change_driver: bool,
    as_json: bool,
) -> None:
    board = None if source is None else _board(source)
    if board is not None:
        _say_least_duty(board.electronics)
    wanted: dict[str, Any] = {} if board is None else board_settings(board)
    for name in names:
        wanted |= parse_setting(name)
        if name.startswith(f"{BOTH_RAMPS}="):
            say(f"{BOTH_RAMPS} sets {' and '.join(RAMPS)}, which the device keeps")
    if rom:
        _set_by_rom(connection, wanted, board, change_driver=change_driver, as_json=as_json)
        return
    with connection.device() as device:
        chip = device.info()["chip"]
        check_chip(chip, board)
        before = device.config()
        after = before.with_values(**wanted)
        after.check_pins(chip)
        _check_driver_settings(wanted, after)
        if connection.udp is None:
            after = after.by_wire()
        changed = changes(before, after)
        status = device.info()["config_status"]
        never = status != "ok"
        if has_driver(status) and not change_driver:
            check_driver(before, after)
        if not never and before == after:
            answer({"written": False, "changed": []}, as_json=as_json, title="Nothing to change")
            return
        if board is not None and before.board is not None and before.board[1] != board.name:
            say(
                f"the device was set for {before.board[1]}, and this sets it for {board.name}: "
                "wrong pins and limits if it is still wired as before"
            )
        if source is not None and not yes:
            _ask_back(changed)
        restart_with(device, after, change_driver=change_driver)
        info = device.info()
        standing = info["standing"]
        _say_other_table(info, after)
    result: dict[str, Any] = {"written": True, "changed": changed, "standing": standing}
    if after.board is not None:
        result["board"] = after.board[1]
    if as_json and source is None:
        result |= for_json(wanted)
    answer(result if as_json else _in_words(result), as_json=as_json, title="Written")


def _say_least_duty(own: Electronics) -> None:
    """A pulse that a file asks for may be shorter than what keeps a coil's current flowing."""
    if own.shortest_on_ns > own.min_on_ns and not own.is_bridge:
        say(
            f"min_on_ns is {own.shortest_on_ns:.0f}, not {own.min_on_ns:g}: least_duty, "
            f"{own.least_duty:g}, needs pulses as long"
        )


def _check_driver_settings(wanted: dict[str, Any], after: DeviceConfig) -> None:
    """Raise `InputError` for what nothing would use: the other driver's settings."""
    if after.has_bridges and wanted.get("min_on_ns"):
        hint = "of a bridge it is lost_ns"
        raise InputError("min_on_ns", wanted["min_on_ns"], "0: this device has bridges", hint=hint)
    signs = wanted.get("sign_pins", ())
    if not after.has_bridges and any(pin != NOT_WIRED for pin in signs):
        raise InputError(
            "sign_pins",
            [pin for pin in signs if pin != NOT_WIRED],
            "none: this device drives its coils by switches",
            hint="for bridges set driver=bridge with --change-driver, once coils are rewired",
        )


def _say_other_table(info: dict[str, Any], config: DeviceConfig) -> None:
    """A table stays in flash while a device becomes another board's, and plays on."""
    known = config.board
    if known is None or not info["board"] or is_of(int(info["fingerprint"], 16), known[0]):
        return
    say(
        f"the table in flash is of {info['board']} and plays: flash one that was built for "
        f"{known[1]} as it is now"
    )


def _board(name: str) -> Board:
    try:
        board = load_board(name)
    except ArgumentError as error:
        if error.field != "board":
            raise
        raise InputError("--from", name, error.expected, hint=error.hint) from None
    if not board.electronics.pwm_pins:
        raise MissingError("electronics.pwm_pins", f"board {board.name!r} says no pins to drive")
    return board


def _ask_back(changed: list[dict[str, Any]]) -> None:
    """Show what is about to change, and ask whether to go on."""
    for row in changed:
        say(f"{row['name']}: {row['from']} -> {row['to']}")
    if not sys.stdin.isatty():
        raise MissingError("--yes", "no one is there to ask", hint="nothing was written")
    if not typer.confirm("Write these and restart the device?", err=True):
        raise InputError("answer", "no", "yes", hint="nothing was written")


def _in_words(result: dict[str, Any]) -> dict[str, Any]:
    rows = {_label(row["name"]): f"{row['from']} -> {row['to']}" for row in result["changed"]}
    standing = ", ".join(result["standing"]) or "nothing"
    known = {"board": result["board"]} if "board" in result else {}
    return known | rows | {"playing prevented by": standing}


def _set_by_rom(
    connection: Connection,
    changes: dict[str, Any],
    board: Board | None,
    *,
    change_driver: bool,
    as_json: bool,
) -> None:
    port = connection.loader_port()
    found = rom_loader.change_config(
        port, connection.baud, changes, board, may_change_driver=change_driver
    )
    written = for_json({name: found[name] for name in changes})
    answer(written, as_json=as_json, title="Written; the device starts with it")
