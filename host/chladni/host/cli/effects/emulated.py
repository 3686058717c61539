"""`chladni play` on an emulated device: what fingers have of effects, and how people read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from chladni.calibration.hidden import HiddenPlate
from chladni.effects.bank.bank_file import bank_bytes
from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.effect import Effect
from chladni.effects.files import ReadEffect
from chladni.host.cli.common.board_reports import say_waves
from chladni.host.cli.common.hidden_plates import named_plate
from chladni.host.cli.common.output import Place, answer, progress_bar, say, write_figure
from chladni.host.cli.common.verdicts import of_effect, of_two_effects
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.effects.pairs import played_pairs
from chladni.host.cli.effects.remarks import say_filtered, say_off_board
from chladni.host.emulation.felt_over_time import over_frequency
from chladni.host.emulation.played_effect import (
    PlayedEffect,
    check_can_play,
    effect_of_bank,
    play_effect,
)
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.fields.transfer import check_target
from chladni.tables.format import read_table
from chladni.tables.inspection.owner import board_for
from chladni.tables.several_fingers.build_for import build_for
from chladni.tables.table import Table

TITLE = "Played (emulated)"


def play_emulated(
    connection: Connection,
    reads: Sequence[ReadEffect],
    places: Sequence[Place],
    hidden: str | None,
    figure: Path | None,
    *,
    as_json: bool,
    **how: Any,
) -> None:
    """An effect for the first finger, and maybe one of its own for the second.

    `how`: as of `play_effect`.
    """
    table, board, plate = table_of(connection, places, hidden)
    say_waves(board)
    effects = [one.effect for one in reads]
    check_can_play(table, board, _others(places)[0])
    with progress_bar("plate") as progress:
        solved = over_frequency(board, progress)
        how |= {"hidden": plate, "solved": solved, "other_plays": len(effects) > 1}
        if plate is not None:
            how["hidden_solved"] = over_frequency(plate.board, progress)
        found = [
            play_effect(table, board, effect, own, other_mm=other, **how)
            for effect, own, other in zip(effects, places, _others(places), strict=False)
        ]
    _draw(figure, found, effects, board, places)
    if len(found) == 1:
        known = {"effect": effects[0].name, "board": board.name, "left_out": reads[0].left_out}
        _tell(known, found[0], as_json=as_json)
        return
    rows = [
        {
            "name": name,
            "effect": read.effect.name,
            "at_mm": list(place),
            "left_out": read.left_out,
            **_numbers(one),
        }
        for name, read, place, one in zip("AB", reads, places, found, strict=True)
    ]
    told = of_two_effects([one.name for one in effects], found)
    result: dict[str, Any] = {"verdict": told, "board": board.name}
    by_name = {f"{one['name']}": {**one, "name": None} for one in rows}
    answer(result | ({"fingers": rows} if as_json else by_name), as_json=as_json, title=TITLE)


def play_emulated_bank(
    connection: Connection,
    places: Sequence[Place],
    hidden: str | None,
    figure: Path | None,
    *,
    newtons: float,
    as_json: bool,
) -> None:
    """A press on an emulated device that has a bank in its flash, and no host."""
    bank = bank_bytes(str(connection.emulated_bank), "--bank")
    say_off_board(unpack_bank(bank), load_board(connection.board))
    area, effect, level = effect_of_bank(bank, places[0])
    table, board, plate = table_of(connection, places, hidden)
    say_filtered(effect)
    say_waves(board)
    with progress_bar("plate") as progress:
        found = play_effect(
            table,
            board,
            effect,
            places[0],
            other_mm=_others(places)[0],
            level=level,
            newtons=newtons,
            hidden=plate,
            bank=bank,
            progress=progress,
        )
    _draw(figure, [found], [effect], board, places)
    known = {"effect": effect.name, "area": area, "board": board.name}
    _tell(known, found, as_json=as_json)


def play_emulated_pairs(
    connection: Connection,
    read: ReadEffect,
    count: int,
    hidden: str | None,
    *,
    as_json: bool,
    **how: Any,
) -> None:
    """An effect under one finger of so many drawn pairs; `how`: as of `play_effect`."""
    table, board, plate = table_of(connection, (), hidden)
    say_waves(board)
    rows = played_pairs(table, board, read.effect, count, plate, as_json=as_json, **how)
    answer(rows, as_json=as_json, title=TITLE)


def _others(places: Sequence[Place]) -> list[Place | None]:
    """For each finger the other one, if there is one."""
    return [None] if len(places) == 1 else [places[1], places[0]]


def _numbers(found: PlayedEffect) -> dict[str, Any]:
    rows = {key: own for key, own in asdict(found).items() if not isinstance(own, np.ndarray)}
    rows.pop("other_um", None)
    # It matters where switches have a bias.
    return rows | {"rested": None if found.bias_um is None else found.rested}


def _tell(known: dict[str, Any], found: PlayedEffect, *, as_json: bool) -> None:
    answer({"verdict": of_effect(found)} | known | _numbers(found), as_json=as_json, title=TITLE)


def _draw(
    figure: Path | None,
    found: Sequence[PlayedEffect],
    effects: Sequence[Effect],
    board: Board,
    places: Sequence[Place],
) -> None:
    if figure is None:
        return
    from chladni.host.figures.effects import played_effects_figure  # noqa: PLC0415

    at = ["{:g}, {:g} mm".format(*place) for place in places]
    titles = [f"{effect.name} at {own}" for effect, own in zip(effects, at, strict=False)]
    heading = None if len(titles) == 1 else f"{board.name}; each effect on its own time axis"
    if len(titles) == 1:
        titles[0] = f"{effects[0].name} on {board.name}, at {at[0]}"
        titles[0] += "".join(f", the other at {one}" for one in at[1:])
    write_figure(played_effects_figure(found, titles, heading), figure)


def table_of(
    connection: Connection, places: Sequence[Place], hidden: str | None
) -> tuple[Table, Board, HiddenPlate | None]:
    """The file's, which must be the board's; else responses, made for it once all else is right.

    And the plate that `hidden` names.
    """
    path = connection.emulated_table
    table = None if path is None else read_table(path)
    if table is None:
        board = load_board(connection.board)
    else:
        board = board_for(table, connection.board, file=str(path))
    for option, place in zip(("--at", "--other"), places, strict=False):
        check_target(board, place, option)
    plate = named_plate(board, hidden)
    if table is not None:
        return table, board, plate
    with progress_bar("table") as progress:
        table, _, report = build_for(board, "fingers", progress=progress)
    assert report is not None
    pitch = " × ".join(f"{along:.2g}" for along in report.pitch_mm)
    say(
        f"without --table: plays responses at places {pitch} mm apart, made for {board.name} now; "
        f"`chladni table build {connection.board} --for fingers -o T.chl` keeps them"
    )
    return table, board, plate
