"""The score of a press for a page: the scorecard, where the loudest places are, a sentence."""

from __future__ import annotations

from typing import Any

import numpy as np

from chladni.drives.problem.problem import Problem
from chladni.drives.scoring.scorecard import Scorecard, null_models, score_on
from chladni.host.studio.boards.prepared import LOUDEST, Prepared
from chladni.host.studio.playing.played import Played
from chladni.sim.board.quantity import MM
from chladni.sim.fields.transfer import target_field
from chladni.sim.image import metrics
from chladni.sim.image.energy import compose
from chladni.sim.image.finger import PRESSING_DB, threshold_um

SURE_DB = 10.0
"""Above the threshold of a resting finger: twice its uncertainty of 5 dB."""
AUDIBLE_DB = 1.0
"""Levels closer than this are called alike."""


def numbers_of(ready: Prepared, played: Played) -> dict[str, Any]:
    """Scorecard of what is played, keys as `chladni solve --json` has them, and three more.

    `maximum_mm` and `second_finger_mm` are the image's maximum and the centre of the loudest
    fingertip 12 mm or more away (None on a board without one); `words` says what it means.
    """
    solved = ready.solved
    wanted = target_field(solved.board, played.place_mm, model=solved.model, allow_unmet=True)
    problem = Problem(solved, played.place_mm, wanted.values[0])
    field = compose(solved.fields.values, played.drive)
    card = score_on(problem, field, null_models(problem), drive=played.drive)
    numbers = card.by_key()
    i, j = np.unravel_index(int(np.argmax(np.abs(field))), field.shape)
    numbers["maximum_mm"] = [float(solved.fields.x[i] / MM), float(solved.fields.y[j] / MM)]
    second = solved.second_fingers.loudest(played.drive, problem.place)
    numbers["second_finger_mm"] = second and [value / MM for value in second]
    if ready.choice.objective == LOUDEST and card.movable:
        # It is not meant as a focus, so what others get of it is no verdict.
        told = f"{_here(card, solved.fields.frequency_hz)} {WORDS['loudest']}"
    else:
        told = in_words(card, solved.fields.frequency_hz)
    several = ready.board.is_for_several and played.fingers is None
    numbers["words"] = f"{told} {WORDS['several']}" if several else told
    return numbers


WORDS = {
    "still": "Nothing these coils do moves this place: a finger here feels nothing.",
    "unknown": "The board file has no [coil], so nothing is known of how strongly a finger feels "
    "it.",
    "no threshold": "The board moves {um} under the finger at {hz} Hz, where no threshold of "
    "feeling is known.",
    "unfelt": "The board moves {um} under the finger at {hz} Hz, {db} dB below the threshold of a "
    "resting finger: no finger feels it.",
    "pressed": "The board moves {um} under the finger at {hz} Hz, {db} dB below the threshold of a "
    "resting finger: a finger that presses may feel it.",
    "hardly": "The board moves {um} under the finger at {hz} Hz, {db} dB above the threshold of a "
    "resting finger: a finger that presses feels it, one that rests hardly does.",
    "felt": "The board moves {um} under the finger at {hz} Hz, {db} dB above the threshold of a "
    "resting finger: every finger feels it.",
    "alike": "A second finger 12 mm away or more can feel as much.",
    "louder": "It is no focus: a second finger elsewhere gets {db} dB more.",
    "quieter": "A second finger 12 mm away or more gets at least {db} dB less.",
    "loudest": "It is the loudest drive for this place, which a device plays under one finger.",
    "several": "The board is for several fingers: add one, and see what each has of the others.",
}
"""What a press comes to; a page without a server says it by the same words."""


def in_words(card: Scorecard, frequency_hz: float) -> str:
    """A plain sentence or two: whether a finger feels it, and who else does."""
    if not card.movable:
        return WORDS["still"]
    return f"{_here(card, frequency_hz)} {card.remark or _there(card)}".rstrip()


def _here(card: Scorecard, frequency_hz: float) -> str:
    own = card.felt
    if own is None or own.finger_um is None:
        return WORDS["unknown"]
    level = own.sensation_db
    if level is None:
        kind = "no threshold"
    elif level < 0.0:
        kind = "unfelt" if level < -PRESSING_DB else "pressed"
    else:
        kind = "hardly" if level < SURE_DB else "felt"
    return WORDS[kind].format(
        um=_micrometres(own.finger_um), hz=f"{frequency_hz:g}", db=f"{abs(level or 0.0):.0f}"
    )


def _there(card: Scorecard) -> str:
    level = card.second_finger_db
    if level >= -metrics.FLOOR_DB:
        return ""
    kind = "alike" if abs(level) < AUDIBLE_DB else "louder" if level < 0.0 else "quieter"
    return WORDS[kind].format(db=f"{abs(level):.0f}")


def _micrometres(value: float) -> str:
    return f"{float(f'{value:.2g}'):g} µm" if value >= 0.01 else "less than 0.01 µm"


def levels_of_feeling(frequency_hz: float) -> dict[str, float | None]:
    """By which levels one of `WORDS` is chosen, µm and dB."""
    return {
        "threshold_um": threshold_um(frequency_hz),
        "pressing_db": PRESSING_DB,
        "sure_db": SURE_DB,
        "alike_db": AUDIBLE_DB,
        "most_db": -metrics.FLOOR_DB,
    }
