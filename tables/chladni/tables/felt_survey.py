"""What fingers feel of a table, and whether its drives make up for what pressing changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chladni.drives.scoring.best_drives import load_spreads, surveyed
from chladni.drives.scoring.felt import disagreement, felt, remark, ssim_and_focal_error
from chladni.drives.scoring.scorecard import FAR_FINGER, focuses
from chladni.drives.scoring.spread import Spread
from chladni.sim.board.quantity import MM
from chladni.sim.image import metrics
from chladni.tables.one_frequency import OneFrequency


@dataclass(frozen=True)
class FeltSurvey:
    """What fingers feel of a table's drives at places all over the board's active area.

    Attributes
    ----------
    places
        How many were surveyed.
    finger_um, sensation_db
        Over the places; None on a board without a coil, or outside 40 to 800 Hz.
    second_finger_20mm_db
        Over the places: what another finger 20 mm away or more gets less, at rest.
    full_volts
        The least of the places; None on a board without a coil.
    finger_load
        What the finger changes: level, SSIM and second finger, over the places.
    ssim_pressed
        SSIM while it presses.
    looks_better_than_it_is
        Places with an SSIM above 0.9 and the maximum more than 12 mm from the finger.
    remark
        A sentence about them; None if there are none, and of drives of `focus`, which leave SSIM
        out.
    """

    places: int
    finger_um: Spread | None
    sensation_db: Spread | None
    second_finger_20mm_db: Spread
    full_volts: float | None
    finger_load: dict[str, Spread]
    ssim_pressed: Spread
    looks_better_than_it_is: int
    remark: str | None


@dataclass(frozen=True)
class Fingers(FeltSurvey):
    """What fingers feel of a table's first section.

    `compensated` is whether its drives are best with the finger on, since that changes more than
    0.01 of SSIM or 0.5 dB of second finger at the 10th percentile of places.
    """

    compensated: bool


def survey_of(drives: OneFrequency) -> FeltSurvey:
    """Survey the drives of some regions, of those in the active area: as a board's score does."""
    centres = [drives.regions.grid.centre_mm(int(one)) for one in drives.regions.numbers]
    board = drives.solved.board
    felt_at = [k for k, (x, y) in enumerate(centres) if board.is_active(x * MM, y * MM)]
    chosen = [felt_at[k] for k in surveyed(len(felt_at))] if felt_at else surveyed(len(centres))
    targets = [centres[k] for k in chosen]
    problems = list(drives.solved.problems(targets, with_finger=True))
    found = [
        (felt(problem, drive), ssim_and_focal_error(problem, drive))
        for problem, drive in zip(problems, drives.synchronised.drives[chosen], strict=True)
    ]
    discs = metrics.FingertipDiscs(board.x, board.y)
    fields = [
        np.tensordot(drive, one.transfer, axes=1)
        for one, drive in zip(problems, drives.synchronised.drives[chosen], strict=True)
    ]
    others = [
        discs.second_finger_db(field, one.place, [FAR_FINGER])[0]
        for one, field in zip(problems, fields, strict=True)
    ]
    levels = [one.finger_um for one, _ in found if one.finger_um is not None]
    sensed = [one.sensation_db for one, _ in found if one.sensation_db is not None]
    volts = [one.full_volts for one, _ in found if one.full_volts is not None]
    misled = [
        problem
        for problem, (_, score) in zip(problems, found, strict=True)
        if disagreement(*score, 0.0) is not None
    ]
    told = None
    if drives.objective != "focus":
        focused = sum(focuses(one, "focus") for one in misled)
        told = remark(len(misled), len(found), focused)
    return FeltSurvey(
        places=len(found),
        finger_um=Spread.of(levels) if levels else None,
        sensation_db=Spread.of(sensed) if sensed else None,
        second_finger_20mm_db=Spread.of(others),
        full_volts=min(volts) if volts else None,
        finger_load=load_spreads([one.finger_load for one, _ in found]),
        ssim_pressed=Spread.of([score[0] + one.finger_load.ssim for one, score in found]),
        looks_better_than_it_is=len(misled),
        remark=told,
    )
