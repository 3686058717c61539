"""What the pictures of a calibration say that they show."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chladni.calibration.restored import Restored
from chladni.drives.scoring.spread import Spread
from chladni.host.figures.calibration import calibration_figure
from chladni.sim.board.file import load_board

SPREAD = Spread(30.0, 20.0, 40.0)
KEPT = Restored(SPREAD, SPREAD, SPREAD)


@pytest.mark.parametrize(("name", "has_foam"), [("quiet5", True), ("paper", False)])
def test_each_picture_of_a_calibration_has_a_title_of_its_own(name: str, has_foam: bool) -> None:
    board = load_board(name)
    first, *others = board.actuators
    found = replace(board, actuators=(replace(first, trim_db=3.0), *others))
    figure = calibration_figure(board, found, "its own coils", KEPT, KEPT)
    plate, scores = (axes.get_title() for axes in figure.axes[:2])
    assert ("foam's stiffness" in plate) == has_foam
    assert "numbers: coils' forces" in plate
    assert "fingers are kept" in scores
