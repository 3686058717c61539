"""What fingers feel of a table, and whether its drives make up for what pressing changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chladni.drives.problem.problem import Problem
from chladni.drives.scoring.felt import Survey, survey
from chladni.sim.board.board import Board
from chladni.sim.board.finger import NO_FINGER
from chladni.tables.one_frequency import OneFrequency

SURVEYED = 24
"""Places looked at, drawn from the regions: the 10th percentile is the third worst."""
SEED = 1
COSTS_SSIM, COSTS_SECOND_FINGER_DB = 0.01, 0.5
"""What a finger may take at the 10th percentile of places until drives make up for it."""


@dataclass(frozen=True)
class Fingers(Survey):
    """What fingers feel of a table's first section.

    `compensated` is whether its drives are best with the finger on, since that changes more than
    0.01 of SSIM or 0.5 dB of second finger at the 10th percentile of places.
    """

    compensated: bool


def survey_of(drives: OneFrequency) -> Survey:
    """Look at the drives of some regions."""
    regions = drives.regions
    count = len(regions.numbers)
    chosen = np.random.default_rng(SEED).permutation(count)[:SURVEYED]
    targets = [regions.grid.centre_mm(int(regions.numbers[k])) for k in chosen]
    problems = drives.solved.problems(targets, with_finger=True)
    cases: list[tuple[Problem, np.ndarray]] = [
        (problem, drives.synchronised.drives[k])
        for problem, k in zip(problems, chosen, strict=True)
    ]
    return survey(cases)


def needs_compensation(board: Board, seen: Survey) -> bool:
    """Whether pressing takes so much that drives are to make up for it."""
    return board.finger != NO_FINGER and (
        seen.finger_load["ssim"].p10 < -COSTS_SSIM
        or seen.finger_load["second_finger_db"].p10 < -COSTS_SECOND_FINGER_DB
    )
