"""The sentence above a press: whether a finger feels it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chladni.drives.scoring.scorecard import score
from chladni.drives.solve import solve
from chladni.host.studio.playing.press_score import in_words
from chladni.sim.image.finger import threshold_um
from conftest import shipped_board


@pytest.mark.parametrize(
    ("level_db", "words"),
    [
        (-40.0, "no finger feels it"),
        (-12.0, "a finger that presses may feel it"),
        (6.0, "a finger that presses feels it, one that rests hardly does"),
        (20.0, "every finger feels it"),
    ],
)
def test_a_pressing_finger_feels_what_a_resting_one_does_not(level_db: float, words: str) -> None:
    """Thresholds in active touch are lower, not higher (Papetti and others, 2017)."""
    board = shipped_board("strip5")
    card = score(solve(board, (0.0, 6.0)), board)
    threshold = threshold_um(160.0)
    assert card.felt is not None
    assert threshold is not None
    moved = threshold * 10.0 ** (level_db / 20.0)
    felt = replace(card.felt, finger_um=moved, sensation_db=level_db)
    assert words in in_words(replace(card, felt=felt), 160.0)
