"""`chladni play --pairs` and `--places`: an effect at many drawn places all over a board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from chladni.drives.fingers.coupling import LEAST_APART
from chladni.drives.methods import SEED
from chladni.drives.scoring.several_fingers.finger_sets import finger_sets
from chladni.drives.scoring.spread import Spread
from chladni.effects.effect import Effect
from chladni.host.cli.common.options import required
from chladni.host.cli.common.output import progress_bar
from chladni.host.cli.device.connection import Connection
from chladni.host.cli.effects.remarks import say_bias, say_short_places
from chladni.host.cli.effects.setup import Setup
from chladni.host.emulation.played_effect import PlayedEffect, play_effect
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ArgumentError, ConflictError, MissingError

MOST_DRAWN = 1000
FEW = 10
"""Fewer have no tenth."""


def check_drawn(
    connection: Connection, effect: str | None, option: str, given: Sequence[str]
) -> None:
    """Refuse what is of given fingers, and what does not score."""
    if connection.emulated_bank is not None:
        given = [*given, "--bank"]
    if given:
        hint = f"{option} draws where fingers lie, of one effect alone"
        raise ConflictError(given[0], option, hint=hint)
    required("EFFECT", effect, "a shipped effect (`chladni effects list`) or a file, to play")
    if not connection.emulator:
        hint = "only emulated pins are scored"
        if connection.port is None and connection.udp is None:
            raise MissingError("--emulator", f"the device that {option} plays on", hint=hint)
        raise ConflictError(option, "--port or --udp", hint=f"{hint}: --emulator")


def played_pairs(
    setup: Setup, effect: Effect, count: int, *, as_json: bool, **how: Any
) -> dict[str, Any]:
    """Rows of what both fingers have of an effect; the first finger of each pair plays.

    The pairs are the first of those that `fingers` and `board score` draw. Of few pairs people get
    each in place of shares of them. `how` is as of `play_effect`.
    """
    found = _played(setup, effect, count, 2, how)
    unfelt = [(one.other_peak_um or 0.0) <= (one.just_felt_um or 0.0) for one in found]
    knows = found[0].just_felt_um is not None
    rest = f"; {sum(unfelt)} of {count} feel nothing of it while they rest" if knows else ""
    levels = [one.isolation_db or 0.0 for one in found]
    return {
        "verdict": f"Over {count} pairs the other finger gets {_less(levels)}{rest}.",
        "effect": effect.name,
        **setup.rows(as_json=as_json),
        "pairs": count,
        "newtons": how["newtons"],
        **_spreads({"peak_um": _peaks(found), "isolation_db": levels}, as_json=as_json),
        "unfelt": float(np.mean(unfelt)) if knows else None,
        "rested": _rested(found),
    }


def played_places(
    setup: Setup, effect: Effect, count: int, *, as_json: bool, **how: Any
) -> dict[str, Any]:
    """Rows of what one finger has of an effect, and what another of which no device knows.

    Raises
    ------
    ArgumentError
        The board has no two places 20 mm apart.
    """
    found = _played(setup, effect, count, 1, how | {"unknown": True})
    levels = [one.second_finger_20mm_db for one in found if one.second_finger_20mm_db is not None]
    if not levels:
        raise ArgumentError("--places", count, "a board with places 20 mm apart")
    return {
        "verdict": (
            f"Over {count} places another finger 20 mm away or farther, of which the device knows "
            f"nothing, gets {_less(levels)}."
        ),
        "effect": effect.name,
        **setup.rows(as_json=as_json),
        "places": count,
        "newtons": how["newtons"],
        **_spreads({"peak_um": _peaks(found), "second_finger_20mm_db": levels}, as_json=as_json),
        "rested": _rested(found),
    }


def _played(
    setup: Setup, effect: Effect, count: int, fingers: int, how: dict[str, Any]
) -> list[PlayedEffect]:
    board, rng = setup.board, np.random.default_rng(SEED)
    sets = finger_sets(board, fingers, count, LEAST_APART, rng) / MM
    how = how | setup.solved()
    found: list[PlayedEffect] = []
    with progress_bar("pairs" if fingers > 1 else "places") as progress:
        for first, *others in sets.tolist():
            other = tuple(others[0]) if others else None
            found.append(
                play_effect(setup.table, board, effect, tuple(first), other_mm=other, **how)
            )
            progress(len(found), count)
    say_short_places(found, how["level_um"])
    say_bias(found)
    return found


def _less(levels: Sequence[float]) -> str:
    """How much less another finger gets, in words."""
    spread = Spread.of(list(levels))
    worst = (
        f"{min(levels):z.0f} at the worst"
        if len(levels) < FEW
        else f"{spread.p10:z.0f} at the worst tenth"
    )
    return f"{spread.median:z.0f} dB less at the median, {worst}"


def _peaks(found: Sequence[PlayedEffect]) -> list[float]:
    return [one.peak_um for one in found]


def _spreads(told: dict[str, list[float]], *, as_json: bool) -> dict[str, Any]:
    """Of many their shares; of few, for people, each."""
    return {
        key: own if len(own) < FEW and not as_json else asdict(Spread.of(own))
        for key, own in told.items()
    }


def _rested(found: Sequence[PlayedEffect]) -> bool | None:
    return found[0].rested if found[0].bias_um is not None else None
