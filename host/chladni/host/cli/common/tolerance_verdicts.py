"""What of a board is worth measuring first, and what tells it."""

from __future__ import annotations

from collections.abc import Sequence

from chladni.calibration.hidden import FOAM_STIFFEST
from chladni.drives.scoring.sensitivity import Influence

FOAM = "foam's stiffness"
TOLD_BY_COILS = (FOAM, "sheet's loss factor", "screws", "feet's stiffness", "coils' forces")
"""Parameters that `chladni calibrate` finds."""
PLURAL = ("screws", "coils' forces")
TOGETHER = "`chladni calibrate` does not: it tells thickness and modulus together."
TOLD_OTHERWISE = {
    "thickness": f"Callipers tell it. {TOGETHER}",
    "Young's modulus": f"How far a strip of the sheet bends under a weight tells it. {TOGETHER}",
    "coils' places": "Callipers, from the sheet's edges, tell them.",
    "magnets' mass": "Scales tell it.",
    "magnets' glue": "A hard glue over the whole face of each magnet keeps it rigid.",
    "feet's damping": "No simple measurement tells it.",
}


def of_tolerances(influences: Sequence[Influence], name: str | None) -> str:
    """What to measure first: the first of the rows, and what tells it.

    Parameters
    ----------
    name
        Of the board for `chladni calibrate`; None for one that was measured.
    """
    first = influences[0]
    calibrate = "" if name is None else f"`chladni calibrate --board {name}` finds"
    does = (
        f"within tolerance ({first.tolerance}) levels change by up to {first.level_db:.1f} dB"
        f"{_lost(first)}."
    )
    if calibrate and any(own.name == FOAM for own in influences):
        foam = (
            "Measure foam first, if its stiffness is a data sheet's: at 160 Hz it is up to "
            f"{FOAM_STIFFEST:g} times as stiff, which does more than the tolerances here. "
            f"{calibrate} it."
        )
        if first.name == FOAM:
            return f"{foam} Foam that was measured still comes first: {does}"
        return " ".join((foam, f"Then {first.name}: {does}", _tells(first, calibrate))).rstrip()
    return f"Measure {first.name} first: {does} {_tells(first, calibrate)}".rstrip()


def _lost(one: Influence) -> str:
    """What other fingers gain by it."""
    if one.isolation_db is not None:
        lost, what = one.isolation_db, "two fingers' isolation at the worst tenth"
    else:
        lost, what = one.second_finger_db or 0.0, "the level over fingers 12 mm away"
    return f", and {what} falls by up to {-lost:.1f} dB" if lost < 0.0 else ""


def _tells(one: Influence, calibrate: str) -> str:
    """What measures it; nothing where nothing is known to."""
    if one.name in TOLD_BY_COILS:
        return calibrate and f"{calibrate} {'them' if one.name in PLURAL else 'it'}."
    return TOLD_OTHERWISE.get(one.name, "")
