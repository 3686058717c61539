"""Which fingers play what on an emulated device: an effect each, or what a bank has there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from chladni.effects.bank.bank_file import bank_bytes
from chladni.effects.bank.unpack import unpack_bank
from chladni.effects.effect import Effect
from chladni.host.cli.common.output import Place
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.effects.remarks import say_off_board
from chladni.host.cli.effects.setup import Setup
from chladni.host.emulation.felt_over_time import FingerPlate, Fingers, fingers_on, places_away
from chladni.host.emulation.over_frequency import Plates
from chladni.host.emulation.played_effect import PlayedEffect, play_effect
from chladni.host.emulation.recorded_effect import as_reported, effect_of_bank, silent_at
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM


@dataclass(frozen=True)
class Press:
    """A finger that plays.

    Attributes
    ----------
    at_mm, other_mm
        Its place, and that of another finger, if there is one.
    area
        That the effect is of, in a bank.
    how
        What else `play_effect` takes of it.
    """

    effect: Effect
    at_mm: Place
    other_mm: Place | None
    area: str | None = None
    how: Mapping[str, Any] = field(default_factory=dict)

    def played(self, setup: Setup, how: Mapping[str, Any]) -> PlayedEffect:
        """What the emulated device makes of it; `how` is as of `play_effect`, for all presses."""
        every = {"other_mm": self.other_mm, **how, **self.how}
        return play_effect(setup.table, setup.board, self.effect, self.at_mm, **every)


def each_under(
    plates: Plates, presses: Sequence[Press], newtons: float, *, unknown: bool
) -> Iterator[tuple[FingerPlate, FingerPlate]]:
    """For each press the plates with its fingers on, as `play_effect` takes them.

    Many are solved for together. `unknown`: with all other places, too.
    """
    sets: list[Fingers] = []
    for one in presses:
        places = [one.at_mm] if one.other_mm is None else [one.at_mm, one.other_mm]
        away = places_away(plates.known[0].board, one.at_mm) if unknown else None
        sets.append((np.array(places) * MM, away))
    return fingers_on(plates, sets, newtons)


def bank_for(connection: Connection) -> bytes:
    """Of `--bank`; remarks on areas that are beyond the board."""
    bank = bank_bytes(str(connection.emulated_bank), "--bank")
    say_off_board(unpack_bank(bank), load_board(connection.emulated_board))
    return bank


def of_effects(effects: Sequence[Effect], places: Sequence[Place]) -> list[Press]:
    """An effect for the first finger, and maybe one of its own for the second."""
    how = {"other_plays": len(effects) > 1}
    return [
        Press(effect, own, other, how=how)
        for effect, own, other in zip(effects, places, _others(places), strict=False)
    ]


def of_bank(bank: bytes, places: Sequence[Place], board: Board, *, together: bool) -> list[Press]:
    """What a bank's areas have for the first finger, or for both that press `together`.

    Raises
    ------
    InputError
        No area there, or none with an effect for a press.
    """
    found = []
    pressed = list(zip(places, _others(places), strict=True))[: 2 if together else 1]
    # Each by its own option, before one is made silent for the other.
    areas = [
        effect_of_bank(bank, as_reported(board, own), option)
        for (own, _), option in zip(pressed, ("--at", "--other"), strict=False)
    ]
    for (own, other), (area, effect, level) in zip(pressed, areas, strict=True):
        plays = bank
        if together and other is not None:
            plays = silent_at(bank, as_reported(board, other), as_reported(board, own))
        how = {"level": level, "bank": plays, "other_plays": together}
        found.append(Press(effect, own, other, area, how))
    return found


def _others(places: Sequence[Place]) -> list[Place | None]:
    """For each finger the other one, if there is one."""
    return [None] if len(places) == 1 else [places[1], places[0]]
