"""What played effects come to, in a few words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from chladni.sim.image.finger import NOTICED_DB
from chladni.sim.image.metrics import FLOOR_DB, decibel

if TYPE_CHECKING:
    from chladni.host.emulation.played_effect import PlayedEffect

OWN_STANDS_OUT_DB, LOUDER = 6.0, 1.5
"""By which a finger is to get more of its own effect than of the other's. If the other finger gets
so many times as much of its own, that is why; effects differ by less at the same `--level-um`."""
BIAS_SHARE, OFF_DB = 0.25, 2.0 * NOTICED_DB
"""Of an effect's peak, from which a bias is told. Of its level over time, from which it is another
one: docs/effects.md has 2.5 at most."""


def of_effect(played: PlayedEffect) -> str:
    """What fingers have of an effect."""
    own = f"The finger gets {played.peak_um:.2g} µm at most"
    other, least, off_db = played.other_peak_um, played.just_felt_um, played.envelope_error_db
    if other is not None and played.isolation_db is not None:
        own += f", the other {decibels_less(played.isolation_db)}{_felt(other, least)}"
    if played.second_finger_20mm_db is not None:
        own += (
            ", another 20 mm away or farther, of which the device knows nothing, up to "
            f"{decibels_less(played.second_finger_20mm_db)}"
        )
    if off_db is not None and off_db > OFF_DB:
        own += f". Its loud and soft parts are off by up to {off_db:.0f} dB"
    if played.bias_um is not None and played.bias_um > BIAS_SHARE * played.peak_um:
        own += f". Its switches' bias moves the finger by {played.bias_um:.2g} µm before and after"
    return f"{own}."


def _felt(um: float, least_um: float | None) -> str:
    feels = "feels" if least_um is not None and um > least_um else "does not feel"
    return f", which a resting finger {feels}"


def decibels_less(db: float) -> str:
    """Whole decibels in words, as `less_of`."""
    return f"{abs(db):.0f} dB {'less' if db >= 0.0 else 'more'}"


def over_other_effect_db(played: Sequence[PlayedEffect]) -> list[float]:
    """For each of two fingers its own effect over what it gets of the other's, dB."""
    return [
        decibel((own.peak_um / other.other_peak_um) ** 2) if other.other_peak_um else -FLOOR_DB
        for own, other in zip(played, reversed(played), strict=True)
    ]


def of_two_effects(effects: Sequence[str], played: Sequence[PlayedEffect]) -> str:
    """What each of two fingers, A and B, has of its own effect and of the other's."""
    told = []
    for own, other, db in zip((0, 1), (1, 0), over_other_effect_db(played), strict=True):
        um, by_other = played[own].peak_um, played[other].other_peak_um or 0.0
        others = f"{'AB'[other]}'s {effects[other]}{_felt(by_other, played[own].just_felt_um)}"
        sentence = f"{'AB'[own]} gets {um:.2g} µm of its {effects[own]}"
        if db >= 0.0:
            sentence += f", {db:.0f} dB more than it gets of {others}"
        else:
            sentence += f", and {-db:.0f} dB more, {by_other:.2g} µm, of {others}"
        if db < OWN_STANDS_OUT_DB and played[other].peak_um > LOUDER * um:
            sentence += f": `--level-um {um:.2g}` makes both effects alike"
        told.append(f"{sentence}.")
    if any(own.bias_um is not None and not own.rested for own in played):
        told.append("What switches' biases move as both press is left out.")
    return " ".join(told)
