"""What is left of a focus where a click plays in place of a tone, or where the foam is stiffer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers.silence import real_part
from chladni.drives.problem.pressing import pressed_at
from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.scorecard import FAR_FINGER
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import Place, Survey, statistics
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE, with_foam
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.fields.driven import driven_fields
from chladni.sim.image import metrics
from chladni.sim.image.finger import PRESS, pressing_stiffness

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

CLICK_HZ = 200.0
"""What a click keeps is what its real gains, found at the board's own frequency, keep here.

Of two fingers on 22 boards on feet and on foam medians and worst tenths are within 2 dB of clicks
over time on the same plates where the first mode lies at 250 Hz or above. Below that they are
within 4, and a tone of 160 Hz keeps up to 17 dB more than a click
(bench/several_fingers/clicks.py). Beside one finger that presses and has rested they are mostly
within 2 dB of clicks by the pins on five boards (docs/effects.md)."""
CLICK_PEAK = 0.89
"""Largest sample of the shipped click behind its low-pass. Peaks reckoned with it are mostly within
1 dB of those by the pins on the same boards."""
FOAM_TWICE = 2.0
"""Foam of twice its static stiffness: at 160 Hz it may have 1 to 4 times that of its data sheet."""


@dataclass(frozen=True)
class KeptFocus:
    """What is left over places all over a board.

    Attributes
    ----------
    second_finger_20mm_db
        RMS under the finger over the loudest disc from 20 mm on; None on a smaller board.
    finger_um
        Peak under the finger at the coils' limit; None without a coil.
    """

    second_finger_20mm_db: Spread | None
    finger_um: Spread | None


def kept_of(measured: FloatArray) -> KeptFocus:
    """Of rows as `Survey.measure` has them."""
    found = statistics(measured)
    return KeptFocus(found.second_finger_20mm_db, found.finger_um)


def click_20mm_db(
    solved: SolvedBoard, places: Sequence[Place], drives: Sequence[ComplexArray]
) -> Spread | None:
    """What a click by the drives of places leaves 20 mm away: its finger has rested, and presses.

    None on a board without two places so far apart.
    """
    board, found = solved.board, []
    discs = metrics.FingertipDiscs(board.x, board.y)
    for place, field in _pressed(solved.at_frequency(CLICK_HZ), places, drives):
        found += discs.second_finger_db(field, place, [FAR_FINGER])
    known = [level for level in found if level < -metrics.FLOOR_DB]
    return Spread.of(known) if known else None


def click_um(
    solved: SolvedBoard, places: Sequence[Place], drives: Sequence[ComplexArray]
) -> Spread | None:
    """Peak of such a click under its finger; None without a coil."""
    board, found = solved.board, []
    for drive, (place, field) in zip(drives, _pressed(solved, places, drives), strict=True):
        full = full_drive(board, real_part(drive).astype(np.complex128), board.drive.frequency_hz)
        if full is None:
            return None
        disc = metrics.disc_mask(board.x, board.y, place, metrics.FINGERTIP_RADIUS)
        moved = abs(complex(field[disc].mean()))
        found.append(moved * full.newtons * CLICK_PEAK / MICROMETRE)
    return Spread.of(found)


def _pressed(
    solved: SolvedBoard, places: Sequence[Place], drives: Sequence[ComplexArray]
) -> Iterator[tuple[Place, ComplexArray]]:
    """Places, and the fields of their drives' real parts under a press, 1 at most."""
    board, values = solved.board, np.asarray(solved.fields.values)
    stiffness = pressing_stiffness(PRESS, board.drive.frequency_hz)
    targets = [(x / MM, y / MM) for x, y in places]
    answers = chain.from_iterable(solved.under_finger(own) for own in solved.groups(targets))
    for place, drive, answer in zip(places, drives, answers, strict=True):
        real = real_part(drive)
        free = np.tensordot(real / max(float(np.abs(real).max()), 1e-300), values, axes=1)
        yield place, pressed_at(board, place, free, answer, stiffness)


def on_foam_twice(
    solved: SolvedBoard, places: Sequence[Place], drives: Sequence[ComplexArray]
) -> KeptFocus | None:
    """What drives leave on foam twice as stiff; None on none, or on foam that was measured."""
    board = solved.board
    stiffer = with_foam(board, FOAM_TWICE)
    if stiffer is board or board.measured:
        return None
    fields = driven_fields(stiffer, tolerance=DRAWN_TOLERANCE, allow_unmet=True)
    return kept_of(Survey(board, places, drives).measure(np.asarray(fields.values)))
