"""What the pictures of a calibration say that they show."""

from __future__ import annotations

from dataclasses import replace

import pytest
from matplotlib.text import Annotation

from chladni.calibration.restored import Restored
from chladni.drives.scoring.spread import Spread
from chladni.host.figures.calibration import calibration_figure
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Spring

SPREAD = Spread(30.0, 20.0, 40.0)
FEET = tuple(Spring((0.0, y), 5e3) for y in (-15.5e-3, 15.5e-3))
KEPT = Restored(SPREAD, SPREAD, SPREAD)


@pytest.mark.parametrize(("name", "has_foam"), [("quiet5", True), ("paper", False)])
def test_each_picture_of_a_calibration_has_a_title_of_its_own(name: str, has_foam: bool) -> None:
    board = load_board(name)
    first, *others = board.actuators
    found = replace(board, actuators=(replace(first, trim_db=3.0), *others))
    figure = calibration_figure(board, found, "its own coils", KEPT, KEPT)
    plate, scores = (axes.get_title() for axes in figure.axes[:2])
    assert ("foam's stiffness" in plate) == has_foam
    assert "circles: coils, with their forces" in plate
    assert "fingers are kept" in scores


def test_each_foot_has_its_stiffness_over_the_drawn_one() -> None:
    board = replace(load_board("quiet5"), foundation=None, springs=FEET)
    stiff = replace(FEET[1], stiffness=1.6 * FEET[1].stiffness)
    found = replace(board, springs=(FEET[0], stiff))
    plate = calibration_figure(board, found, "its own coils", KEPT, KEPT).axes[0]
    assert plate.get_title().startswith("triangles: feet's stiffness")
    told = {text.get_text(): text.xy for text in plate.texts if isinstance(text, Annotation)}
    assert told["1.60"] == pytest.approx((0.0, 15.5))
    assert told["1.00"] == pytest.approx((0.0, -15.5))
