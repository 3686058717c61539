"""`chladni play` on an emulated device: what fingers have of effects, and how people read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from chladni.effects.bank.bank_file import bank_bytes
from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.effect import Effect
from chladni.effects.files import ReadEffect
from chladni.host.cli.common.finger_remarks import say_waves
from chladni.host.cli.common.output import Place, answer, write_figure
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.effects.drawn_fingers import played_pairs, played_places
from chladni.host.cli.effects.remarks import (
    say_bias,
    say_filtered,
    say_less_than_asked,
    say_off_board,
    say_unflattened,
)
from chladni.host.cli.effects.setup import Setup, setup_of
from chladni.host.cli.effects.verdicts import (
    decibels_less,
    of_effect,
    of_two_effects,
    over_other_effect_db,
)
from chladni.host.emulation.played_effect import (
    PlayedEffect,
    check_can_play,
    play_effect,
)
from chladni.host.emulation.recorded_effect import effect_of_bank, silent_at
from chladni.sim.board.file import load_board


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
    setup = setup_of(connection, places, hidden)
    table, board = setup.table, setup.board
    say_waves(board)
    effects = [one.effect for one in reads]
    check_can_play(table, board, _others(places)[0])
    how |= setup.solved() | _asked(setup, places) | {"other_plays": len(effects) > 1}
    found = [
        play_effect(table, board, effect, own, other_mm=other, **how)
        for effect, own, other in zip(effects, places, _others(places), strict=False)
    ]
    say_less_than_asked(found, [how["level_um"]] * len(found))
    say_bias(found)
    _draw(figure, found, effects, setup, places)
    if len(found) == 1:
        known = {"effect": effects[0].name} | setup.rows(as_json=as_json)
        known |= {"left_out": reads[0].left_out, "newtons": how["newtons"]}
        _tell(known, found[0], setup, as_json=as_json)
        return
    own = [{"left_out": one.left_out} for one in reads]
    _tell_two(effects, found, places, own, setup, as_json=as_json)


def play_emulated_bank(
    connection: Connection,
    places: Sequence[Place],
    hidden: str | None,
    figure: Path | None,
    *,
    together: bool,
    newtons: float,
    as_json: bool,
) -> None:
    """A press on an emulated device that has a bank in its flash, and no host.

    Two fingers that press `together` have each the effect of its own area.
    """
    bank = bank_bytes(str(connection.emulated_bank), "--bank")
    known = unpack_bank(bank)
    say_off_board(known, load_board(connection.board))
    presses = [effect_of_bank(bank, one) for one in (places if together else places[:1])]
    setup = setup_of(connection, places, hidden)
    effects = [effect for _, effect, _ in presses]
    for effect in effects:
        say_filtered(effect)
    say_waves(setup.board)
    how = setup.solved() | _asked(setup, places) | {"newtons": newtons, "other_plays": together}
    found = [
        play_effect(
            *(setup.table, setup.board, effect, own),
            other_mm=other,
            level=level,
            bank=silent_at(bank, other, own) if together and other is not None else bank,
            **how,
        )
        for (_, effect, level), own, other in zip(presses, places, _others(places), strict=False)
    ]
    say_unflattened(found)
    levels_um = {area.name: area.level_um for area in known.areas}
    say_less_than_asked(found, [levels_um[area] for area, _, _ in presses], "level_um of its area")
    _draw(figure, found, effects, setup, places)
    if together:
        own = [{"area": area} for area, _, _ in presses]
        _tell_two(effects, found, places, own, setup, as_json=as_json)
        return
    rows = {"effect": effects[0].name, "area": presses[0][0]} | setup.rows(as_json=as_json)
    rows["newtons"] = newtons
    _tell(rows, found[0], setup, as_json=as_json)


def play_emulated_drawn(
    connection: Connection,
    read: ReadEffect,
    count: int,
    hidden: str | None,
    *,
    pairs: bool,
    as_json: bool,
    **how: Any,
) -> None:
    """An effect under one finger of so many drawn `pairs`, or under one alone.

    `how`: as of `play_effect`.
    """
    setup = setup_of(connection, (), hidden)
    say_waves(setup.board)
    played = played_pairs if pairs else played_places
    rows = played(setup, read.effect, count, as_json=as_json, **how)
    answer(rows, as_json=as_json, title=_title(setup))


def _asked(setup: Setup, places: Sequence[Place]) -> dict[str, Any]:
    """What a finger does that the device does not know, where it may know of one alone."""
    return {"unknown": len(places) == 1 and not setup.board.is_for_several}


def _others(places: Sequence[Place]) -> list[Place | None]:
    """For each finger the other one, if there is one."""
    return [None] if len(places) == 1 else [places[1], places[0]]


def _numbers(found: PlayedEffect) -> dict[str, Any]:
    rows = {key: own for key, own in asdict(found).items() if not isinstance(own, np.ndarray)}
    rows.pop("other_um", None)
    # It matters where switches have a bias.
    return rows | {"rested": None if found.bias_um is None else found.rested}


def _title(setup: Setup) -> str:
    return f"Played on {setup.title} (emulated)"


def _tell(known: dict[str, Any], found: PlayedEffect, setup: Setup, *, as_json: bool) -> None:
    rows = {"verdict": of_effect(found)} | known | _numbers(found)
    answer(rows, as_json=as_json, title=_title(setup))


def _tell_two(
    effects: Sequence[Effect],
    found: Sequence[PlayedEffect],
    places: Sequence[Place],
    known: Sequence[dict[str, Any]],
    setup: Setup,
    *,
    as_json: bool,
) -> None:
    """What each of two fingers has of its own effect; `known` is what else is known of each."""
    rows = [
        {"name": name, "effect": effect.name, "at_mm": list(place), **own}
        | {"over_other_effect_db": over_db, **_numbers(one)}
        for name, effect, place, own, one, over_db in zip(
            "AB", effects, places, known, found, over_other_effect_db(found), strict=True
        )
    ]
    told = of_two_effects([one.name for one in effects], found)
    result: dict[str, Any] = {"verdict": told} | setup.rows(as_json=as_json)
    result |= {"fingers": rows} if as_json else {one["name"]: one | {"name": None} for one in rows}
    answer(result, as_json=as_json, title=_title(setup))


def _draw(
    figure: Path | None,
    found: Sequence[PlayedEffect],
    effects: Sequence[Effect],
    setup: Setup,
    places: Sequence[Place],
) -> None:
    if figure is None:
        return
    from chladni.host.figures.effects import played_effects_figure  # noqa: PLC0415

    at = ["{:g}, {:g} mm".format(*place) for place in places]
    titles = [
        f"{effect.name} at {place}, {own.peak_um:.2g} µm at most"
        for effect, place, own in zip(effects, at, found, strict=False)
    ]
    heading, others = setup.title, []
    if len(found) > 1:
        heading += "; each effect on its own time axis"
        others = [f"{'BA'[n]} gets of {'AB'[n]}'s {effects[n].name}" for n in (0, 1)]
        # Of the verdict, not the isolation: one figure for a finger, wherever people look.
        titles = [
            f"{own}: {title};\n{abs(db):.0f} dB {'more' if db >= 0.0 else 'less'} than {own} gets "
            f"of {other}'s {effect.name}"
            for own, other, title, effect, db in zip(
                "AB", "BA", titles, reversed(effects), over_other_effect_db(found), strict=True
            )
        ]
    elif found[0].isolation_db is not None:
        titles[0] += f";\nthe other at {at[1]} gets {decibels_less(found[0].isolation_db)} of it"
    write_figure(played_effects_figure(found, titles, heading, others), figure)
