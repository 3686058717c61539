"""`chladni play` on an emulated device: what fingers have of effects, and how people read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.files import ReadEffect
from chladni.host.cli.common.finger_remarks import say_waves
from chladni.host.cli.common.output import Place, answer, by_name, write_figure
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.effects.presses import Press, bank_for, of_bank, of_effects
from chladni.host.cli.effects.remarks import (
    say_bias,
    say_filtered,
    say_less_than_asked,
    say_unflattened,
)
from chladni.host.cli.effects.setup import Setup, setup_of
from chladni.host.cli.effects.verdicts import (
    decibels_less,
    of_effect,
    of_two_effects,
    over_other_effect_db,
)
from chladni.host.emulation.played_effect import PlayedEffect, check_can_play
from chladni.sim.board.file import load_board

OF_AREA = "level_um of its area"


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
    say_waves(setup.board)
    presses = of_effects([one.effect for one in reads], places)
    check_can_play(setup.table, setup.board, presses[0].other_mm)
    how |= {"plates": setup.plates()} | _asked(setup, places)
    found = [one.played(setup, how) for one in presses]
    say_less_than_asked(found, [how["level_um"]] * len(found))
    say_bias(found, setup.board)
    _draw(figure, found, presses, setup)
    if len(found) == 1:
        known = {"effect": presses[0].effect.name} | setup.rows(as_json=as_json)
        known |= {"left_out": reads[0].left_out, "newtons": how["newtons"]}
        _tell(known, found[0], setup, as_json=as_json)
        return
    own = [{"left_out": one.left_out} for one in reads]
    _tell_two(presses, found, own, setup, as_json=as_json)


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
    bank = bank_for(connection)
    presses = of_bank(bank, places, load_board(connection.emulated_board), together=together)
    setup = setup_of(connection, places, hidden)
    for one in presses:
        say_filtered(one.effect)
    say_waves(setup.board)
    how = {"plates": setup.plates(), "newtons": newtons} | _asked(setup, places)
    found = [one.played(setup, how) for one in presses]
    say_unflattened(found)
    say_bias(found, setup.board)
    levels_um = {area.name: area.level_um for area in unpack_bank(bank).areas}
    say_less_than_asked(found, [levels_um[str(one.area)] for one in presses], OF_AREA)
    _draw(figure, found, presses, setup)
    if together:
        own = [{"area": one.area} for one in presses]
        _tell_two(presses, found, own, setup, as_json=as_json)
        return
    rows = {"effect": presses[0].effect.name, "area": presses[0].area}
    rows |= setup.rows(as_json=as_json) | {"newtons": newtons}
    _tell(rows, found[0], setup, as_json=as_json)


def _asked(setup: Setup, places: Sequence[Place]) -> dict[str, Any]:
    """What a finger does that the device does not know, where it may know of one alone."""
    return {"unknown": len(places) == 1 and not setup.board.is_for_several}


def _numbers(found: PlayedEffect) -> dict[str, Any]:
    rows = {key: own for key, own in asdict(found).items() if not isinstance(own, np.ndarray)}
    for key in ("other_um", "far_um"):
        rows.pop(key, None)
    # It matters where switches have a bias.
    return rows | {"rested": None if found.bias_um is None else found.rested}


def _tell(known: dict[str, Any], found: PlayedEffect, setup: Setup, *, as_json: bool) -> None:
    rows = {"verdict": of_effect(found)} | known | _numbers(found)
    answer(rows, as_json=as_json, title=setup.played_on)


def _tell_two(
    presses: Sequence[Press],
    found: Sequence[PlayedEffect],
    known: Sequence[dict[str, Any]],
    setup: Setup,
    *,
    as_json: bool,
) -> None:
    """What each of two fingers has of its own effect; `known` is what else is known of each."""
    rows = [
        {"name": name, "effect": press.effect.name, "at_mm": list(press.at_mm), **own}
        | {"over_other_effect_db": over_db, **_numbers(one)}
        for name, press, own, one, over_db in zip(
            "AB", presses, known, found, over_other_effect_db(found), strict=True
        )
    ]
    told = of_two_effects([one.effect.name for one in presses], found)
    result: dict[str, Any] = {"verdict": told} | setup.rows(as_json=as_json)
    result |= by_name("fingers", rows, as_json=as_json)
    answer(result, as_json=as_json, title=setup.played_on)


def _draw(
    figure: Path | None,
    found: Sequence[PlayedEffect],
    presses: Sequence[Press],
    setup: Setup,
) -> None:
    if figure is None:
        return
    from chladni.host.figures.effects import played_effects_figure  # noqa: PLC0415

    effects = [one.effect for one in presses]
    titles = [
        f"{effect.name} at {_told_place(press.at_mm)}, {own.peak_um:.2g} µm at most"
        for effect, press, own in zip(effects, presses, found, strict=True)
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
    elif found[0].isolation_db is not None and presses[0].other_mm is not None:
        less = decibels_less(found[0].isolation_db)
        titles[0] += f";\nthe other at {_told_place(presses[0].other_mm)} gets {less} of it"
    elif found[0].second_finger_20mm_db is not None:
        less = decibels_less(found[0].second_finger_20mm_db)
        titles[0] += f";\nanother, of which the device knows nothing, {less}"
    write_figure(played_effects_figure(found, titles, heading, others), figure)


def _told_place(place: Place) -> str:
    return "{:g}, {:g} mm".format(*place)
