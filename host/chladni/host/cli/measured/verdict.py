"""What came of a calibration, in a few sentences."""

from __future__ import annotations

from collections.abc import Sequence

from chladni.calibration.hidden import foot_name
from chladni.calibration.parameters import Parameter
from chladni.calibration.restored import Restored, gained
from chladni.calibration.unknowns import uneven_feet
from chladni.calibration.wiring import coil_fault
from chladni.host.cli.common.finger_remarks import is_clearly_less
from chladni.host.cli.measured.ways import Calibrated
from chladni.sim.board.board import Board

NONE_TOLD_APART = (
    "The file has the coils' forces, and a sheet that fits the readings: its thickness and modulus "
    "go together, and are not told apart."
)
FEET_ALIKE = (
    "All feet are taken to be alike: if they are not, the new drives may keep less apart than the "
    "old ones, and coils or an accelerometer tell each foot."
)


def verdict(
    drawn: Board,
    found: Calibrated,
    before: Restored,
    after: Restored,
    sets: int,
    *,
    is_on_plate: bool = True,
) -> str:
    """Scores of so many sets of two fingers, faults, and what was measured.

    `is_on_plate`: scores are on the plate itself, not on the board that was found.
    """
    first = gained(before.isolation(drawn), after.isolation(drawn))
    pairs = f"over {sets} pairs" if sets > 1 else "of one pair"
    sentences = [
        f"{first[0].upper()}{first[1:]} ({pairs}, with the solver's drives).",
        f"At the worst tenth {_tails(drawn, before, after)}.",
    ]
    if (um := after.fingers_um) is not None:
        sentences += [
            f"Each gets {before.fingers_um.median:.2g} µm before, {um.median:.2g} after, "
            f"{um.p10:.2g} at the worst tenth."
            if before.fingers_um
            else f"Each gets {um.median:.2g} µm, {um.p10:.2g} at the worst tenth."
        ]
    old, new = before.fingers_2_db.median, after.fingers_2_db.median
    if is_on_plate and is_clearly_less(new, old):
        sentences += [
            f"On this plate the new drives keep two fingers {old - new:.1f} dB less apart than the "
            "old ones: keep the drawn board's file, or measure in another way."
        ]
    names = [foot_name(own) for own in uneven_feet(drawn)]
    feet = [own for own in found.parameters if own.name in names]
    if names and not feet:
        sentences += [FEET_ALIKE]
    if alike := [own for own in feet if not own.told]:
        sentences += [
            f"{len(alike)} of {len(feet)} feet are not told apart from others, as where all coils "
            "stand on a middle line: new drives may miss an odd foot."
        ]
    sentences += faults(found.board)
    told = [
        f"{own.name} {own.value:.2f} times the drawn one"
        for own in found.parameters
        if own.told and own not in feet
    ] + _oddest(found.parameters, feet)
    sentences += [f"Measured: {', '.join(told)}." if told else NONE_TOLD_APART]
    return " ".join(sentences)


def faults(board: Board) -> list[str]:
    """What to look at on the desk."""
    return [fault.said for own in board.actuators if (fault := coil_fault(own))]


def _oddest(parameters: Sequence[Parameter], feet: Sequence[Parameter]) -> list[str]:
    """The foot that is farthest from what all of them are, where it is clearly not that."""
    mean = next((own.value for own in parameters if own.name == "feet"), None)
    if mean is None:
        return []
    odd = [own for own in feet if own.told and not own.low <= mean <= own.high]
    worst = max(odd, key=lambda own: max(own.value / mean, mean / own.value), default=None)
    return [f"of them the {worst.name} {worst.value:.2f} times"] if worst else []


def _tails(drawn: Board, before: Restored, after: Restored) -> str:
    """What the medians of a verdict leave out."""
    rows = [("two fingers", before.fingers_2_db, after.fingers_2_db)]
    own, then = before.second_finger_20mm_db, after.second_finger_20mm_db
    if drawn.focus is not None and own is not None and then is not None:
        rows.insert(0, ("from 20 mm on", own, then))
    return ", ".join(
        f"{name} {early.p10:z.0f} dB before, {late.p10:z.0f} after" for name, early, late in rows
    )
