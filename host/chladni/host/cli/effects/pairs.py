"""`chladni play --pairs`: an effect under one finger of many pairs all over a board."""

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
from chladni.host.cli.effects.remarks import say_short_places
from chladni.host.cli.effects.setup import Setup
from chladni.host.emulation.played_effect import PlayedEffect, play_effect
from chladni.sim.board.quantity import MM
from chladni.sim.errors import ConflictError

MOST_PAIRS = 1000
FEW_PAIRS = 10
"""Fewer have no tenth."""


def check_pairs(connection: Connection, effect: str | None, given: Sequence[str]) -> None:
    """Refuse what is of one pair, and what does not score."""
    if connection.emulated_bank is not None:
        given = [*given, "--bank"]
    if given:
        raise ConflictError(given[0], "--pairs", hint="it is for one pair: --at and --other")
    required("EFFECT", effect, "a shipped effect (`chladni effects list`) or a file, to play")
    if not connection.emulator:
        raise ConflictError(
            "--pairs", "--port or --udp", hint="only emulated pins are scored: --emulator"
        )


def played_pairs(
    setup: Setup,
    effect: Effect,
    count: int,
    *,
    as_json: bool,
    **how: Any,
) -> dict[str, Any]:
    """Rows of what both fingers have of an effect; the first finger of each pair plays.

    The pairs are the first of those that `fingers` and `board score` draw. Of few pairs people get
    each in place of shares of them. `how` is as of `play_effect`.
    """
    table, board = setup.table, setup.board
    sets = finger_sets(board, 2, count, LEAST_APART, np.random.default_rng(SEED)) / MM
    how |= setup.solved()
    found: list[PlayedEffect] = []
    with progress_bar("pairs") as progress:
        for place, beside in sets.tolist():
            own, other = tuple(place), tuple(beside)
            found.append(play_effect(table, board, effect, own, other_mm=other, **how))
            progress(len(found), count)
    say_short_places(found, how["level_um"])
    levels, peaks = [one.isolation_db or 0.0 for one in found], [one.peak_um for one in found]
    isolation, is_few = Spread.of(levels), count < FEW_PAIRS
    unfelt = [(one.other_peak_um or 0.0) <= (one.just_felt_um or 0.0) for one in found]
    knows = found[0].just_felt_um is not None
    rest = f"; {sum(unfelt)} of {count} feel nothing of it while they rest" if knows else ""
    worst = (
        f"{min(levels):z.0f} at the worst" if is_few else f"{isolation.p10:z.0f} at the worst tenth"
    )
    told = {"peak_um": peaks, "isolation_db": levels}
    has_bias = found[0].bias_um is not None
    return {
        "verdict": (
            f"Over {count} pairs the other finger gets {isolation.median:z.0f} dB less at the "
            f"median, {worst}{rest}."
        ),
        "effect": effect.name,
        **setup.rows(as_json=as_json),
        "pairs": count,
        **{
            key: own if is_few and not as_json else asdict(Spread.of(own))
            for key, own in told.items()
        },
        "unfelt": float(np.mean(unfelt)) if knows else None,
        "rested": found[0].rested if has_bias else None,
    }
