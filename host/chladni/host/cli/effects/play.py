"""`chladni play`: an effect under a finger, on a device or on an emulated one that is scored."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from chladni.calibration.hidden import HiddenPlate
from chladni.drives.scoring.as_built import LEAST_PRESS, MOST_PRESS, PRESS
from chladni.effects.bank.areas import LEAST_UM, MOST_UM
from chladni.effects.bank.bank_file import bank_bytes
from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.files import ReadEffect, read_effect
from chladni.host.cli.common.board_reports import say_waves
from chladni.host.cli.common.hidden_plates import named_plate
from chladni.host.cli.common.options import (
    FigureOption,
    JsonOption,
    check_figure,
    check_one_of,
    required,
)
from chladni.host.cli.common.output import (
    Place,
    answer,
    parse_place,
    progress_bar,
    say,
    write_figure,
)
from chladni.host.cli.common.ranges import LEAST_APART_MM, within
from chladni.host.cli.common.verdicts import of_effect
from chladni.host.cli.device.connection import Connection, connecting
from chladni.host.cli.effects.on_device import play_on_device
from chladni.host.cli.effects.pairs import MOST_PAIRS, check_pairs, played_pairs
from chladni.host.cli.effects.remarks import say_filtered, say_off_board
from chladni.host.emulation.played_effect import PlayedEffect, effect_of_bank, play_effect
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.errors import ConflictError, InputError
from chladni.sim.fields.transfer import check_target
from chladni.tables.format import read_table
from chladni.tables.inspection.owner import board_for
from chladni.tables.several_fingers.build_for import build_for
from chladni.tables.table import Table


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("play")(play)


@connecting
def play(
    connection: Connection,
    effect: Annotated[
        str | None,
        typer.Argument(
            metavar="[EFFECT]",
            help="Its name, or a .haptic, .ahap, .hjif, .wav or .toml; unless --bank has it.",
        ),
    ] = None,
    at: Annotated[str | None, typer.Option("--at", metavar="X,Y", help="Where, mm.")] = None,
    other: Annotated[
        list[str] | None,
        typer.Option(metavar="X,Y", help="Another finger, which rests there; mm."),
    ] = None,
    level_db: Annotated[
        float,
        typer.Option(callback=within(-60.0, 0.0, "dB"), help="Below the loudest for that place."),
    ] = 0.0,
    level_um: Annotated[
        float | None,
        typer.Option(
            callback=within(LEAST_UM, MOST_UM, "µm"),
            help="As many for an amplitude of 1, where the place allows them.",
        ),
    ] = None,
    press: Annotated[
        float,
        typer.Option(
            callback=within(LEAST_PRESS, MOST_PRESS, "N"),
            help="How hard emulated fingers press, N.",
        ),
    ] = PRESS,
    hidden: Annotated[
        str | None,
        typer.Option(
            metavar="[BOARD@]SEED",
            help="Emulated fingers are on the plate of `calibrate --board BOARD --hidden SEED`, "
            "or of a FILE.toml.",
        ),
    ] = None,
    rested: Annotated[
        bool,
        typer.Option("--rested", help="The emulated finger has rested: a switch's bias stands."),
    ] = False,
    pairs: Annotated[
        int | None,
        typer.Option(
            callback=within(1, MOST_PAIRS),
            help="In place of --at: so many drawn pairs on an emulated device, and what they keep.",
        ),
    ] = None,
    figure: FigureOption = None,
    as_json: JsonOption = False,
) -> None:
    """Play an effect under a finger; an emulated device says what fingers have of it.

    A real device says what it reckons by its table: no µm, for it does not measure its plate.
    """
    if pairs is not None:
        given = {"--at": at, "--other": other, "--hidden": hidden, "--figure": figure}
        check_pairs(connection, effect, [option for option, value in given.items() if value])
        own = (level_db, level_um, press)
        _over_pairs(connection, str(effect), pairs, own, rested=rested, as_json=as_json)
        return
    place = parse_place(required("--at", at, "X,Y, where the finger presses, mm"), "--at")
    if other and len(other) > 1:
        raise InputError("--other", other, "one other finger")
    beside = parse_place(other[0], "--other") if other else None
    if beside is not None and math.dist(place, beside) < LEAST_APART_MM:
        expected = f"{LEAST_APART_MM:g} mm or more from the finger at --at"
        raise InputError("--other", other[0] if other else "", expected)
    check_figure(figure)
    check_one_of(
        "what to play", EFFECT=effect is not None, bank=connection.emulated_bank is not None
    )
    _check_level(connection, level_db, level_um)
    _check_emulated(connection, effect, rested, hidden)
    if effect is None:
        _from_bank(connection, place, beside, (press, hidden), figure, as_json=as_json)
        return
    read = _read(effect)
    level = float(10.0 ** (level_db / 20.0))
    if not connection.emulator:
        if figure is not None:
            raise ConflictError("--figure", "--port or --udp", hint="only emulated pins are scored")
        rows = play_on_device(connection, read, place, beside, (level, level_um))
        answer(rows, as_json=as_json, title="Played")
        return
    table, board, plate = _table(connection, place, beside, hidden)
    say_waves(board)
    with progress_bar("plate") as progress:
        found = play_effect(
            table,
            board,
            read.effect,
            place,
            other_mm=beside,
            level=level,
            level_um=level_um,
            newtons=press,
            rested=rested,
            hidden=plate,
            progress=progress,
        )
    known = {"effect": read.effect.name, "board": board.name, "left_out": read.left_out}
    _tell(known, found, (place, beside), figure, as_json=as_json)


def _read(effect: str) -> ReadEffect:
    read = read_effect(effect, field="EFFECT")
    for one in read.left_out:
        say(f"left out: {one}")
    say_filtered(read.effect)
    return read


def _over_pairs(
    connection: Connection,
    effect: str,
    count: int,
    own: tuple[float, float | None, float],
    *,
    rested: bool,
    as_json: bool,
) -> None:
    """`own`: the level in dB and in µm, and newtons."""
    level_db, level_um, newtons = own
    _check_level(connection, level_db, level_um)
    read = _read(effect)
    table, board, _ = _table(connection)
    say_waves(board)
    rows = played_pairs(
        table,
        board,
        read.effect,
        count,
        level=float(10.0 ** (level_db / 20.0)),
        level_um=level_um,
        newtons=newtons,
        rested=rested,
        as_json=as_json,
    )
    answer(rows, as_json=as_json, title="Played (emulated)")


def _check_level(connection: Connection, level_db: float, level_um: float | None) -> None:
    if level_um is not None and level_db < 0.0:
        raise ConflictError("--level-um", "--level-db", hint="one of them is the level")
    if connection.emulated_bank is not None and (level_db < 0.0 or level_um is not None):
        option = "--level-db" if level_um is None else "--level-um"
        raise ConflictError(option, "--bank", hint="its areas have levels of their own")


def _check_places(board: Board, place: Place | None, beside: Place | None) -> None:
    """All on the board, by the option that says them."""
    for option, own in (("--at", place), ("--other", beside)):
        if own is not None:
            check_target(board, own, option)


def _check_emulated(
    connection: Connection, effect: str | None, rested: bool, hidden: str | None
) -> None:
    """Refuse what only an emulated device has."""
    if rested and (effect is None or not connection.emulator):
        own = "--bank" if effect is None else "--port or --udp"
        raise ConflictError("--rested", own, hint="it is for an effect that is sent to --emulator")
    if hidden is not None and not connection.emulator:
        raise ConflictError("--hidden", "--port or --udp", hint="a real device has its own plate")


def _from_bank(
    connection: Connection,
    place: Place,
    beside: Place | None,
    press: tuple[float, str | None],
    figure: Path | None,
    *,
    as_json: bool,
) -> None:
    """A press on an emulated device that has a bank in its flash, and no host.

    `press`: newtons, and on which hidden plate.
    """
    if not connection.emulator:
        hint = "`chladni effects flash` gives a device its bank, and fingers play it"
        raise ConflictError("--bank", "--port or --udp", hint=hint)
    bank = bank_bytes(str(connection.emulated_bank), "--bank")
    say_off_board(unpack_bank(bank), load_board(connection.board))
    area, effect, level = effect_of_bank(bank, place)
    table, board, plate = _table(connection, place, beside, press[1])
    say_filtered(effect)
    say_waves(board)
    with progress_bar("plate") as progress:
        found = play_effect(
            table,
            board,
            effect,
            place,
            other_mm=beside,
            level=level,
            newtons=press[0],
            hidden=plate,
            bank=bank,
            progress=progress,
        )
    known = {"effect": effect.name, "area": area, "board": board.name}
    _tell(known, found, (place, beside), figure, as_json=as_json)


def _tell(
    known: dict[str, Any],
    found: PlayedEffect,
    places: tuple[Place, Place | None],
    figure: Path | None,
    *,
    as_json: bool,
) -> None:
    """`places`: of the finger that plays, and of another one."""
    if figure is not None:
        from chladni.host.figures.effects import played_effect_figure  # noqa: PLC0415

        own, *others = ("{:g}, {:g} mm".format(*at) for at in places if at is not None)
        beside = f", the other at {others[0]}" if others else ""
        title = f"{known['effect']} on {known['board']}, at {own}{beside}"
        write_figure(played_effect_figure(found, title), figure)
    rows: dict[str, Any] = {
        key: value for key, value in asdict(found).items() if not isinstance(value, np.ndarray)
    }
    rows.pop("other_um", None)
    verdict = {"verdict": of_effect(found)}
    answer(verdict | known | rows, as_json=as_json, title="Played (emulated)")


def _table(
    connection: Connection,
    place: Place | None = None,
    beside: Place | None = None,
    hidden: str | None = None,
) -> tuple[Table, Board, HiddenPlate | None]:
    """The file's, which must be the board's; else responses, made for it once all else is right.

    And the plate that `hidden` names.
    """
    if connection.emulated_table is not None:
        table = read_table(connection.emulated_table)
        board = board_for(table, connection.board, file=str(connection.emulated_table))
        _check_places(board, place, beside)
        return table, board, named_plate(board, hidden)
    board = load_board(connection.board)
    _check_places(board, place, beside)
    plate = named_plate(board, hidden)
    with progress_bar("table") as progress:
        table, _, report = build_for(board, "fingers", progress=progress)
    assert report is not None
    pitch = " × ".join(f"{along:.2g}" for along in report.pitch_mm)
    say(
        f"without --table: plays responses at places {pitch} mm apart, made for {board.name} now; "
        f"`chladni table build {connection.board} --for fingers -o T.chl` keeps them"
    )
    return table, board, plate
