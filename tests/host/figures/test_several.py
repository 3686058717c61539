"""Figures of several fingers: where the median is read, and pictures of boards that lie."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.drives.scoring.several_fingers.fingers_play import FingersPlay
from chladni.drives.scoring.several_fingers.fingers_score import FingersScore, score_fingers
from chladni.host.cli.several_fingers.fingers import _draw
from chladni.host.figures.fingers import fingers_figure
from chladni.host.figures.two_fingers import two_fingers_figure
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Measured
from wide import turned


@pytest.fixture(scope="module")
def score() -> FingersScore:
    return score_fingers(load_board("strip5"), (2,), sets=3, samples=0)


def test_lines_have_points_at_the_median_and_where_the_worst_tenth_begins(
    score: FingersScore,
) -> None:
    """The worst isolation is the least, and the worst share of the others' the largest."""
    (two,) = score.counts
    for axes, column, worst in zip(
        fingers_figure("strip5", score, None).axes, (0, 2, 3), (0.1, 0.1, 0.9), strict=True
    ):
        (points,) = (line for line in axes.lines if line.get_marker() == "o")
        at, shares = np.asarray(points.get_data())
        assert shares.tolist() == [0.5, worst]
        assert at.tolist() == np.quantile(two.rows[:, column], [0.5, worst]).tolist()
        assert {"median", "worst tenth"} <= {text.get_text() for text in axes.texts}


def test_a_board_that_was_measured_is_not_called_drawn(score: FingersScore, tmp_path: Path) -> None:
    """An SVG has its texts as comments beside their outlines."""
    drawn = load_board("strip5")
    measured = replace(drawn, measured=Measured("a recording", "2026-11-27"))
    for board, told in ((drawn, "as drawn"), (measured, "as measured")):
        path = tmp_path / f"{told}.svg"
        _draw(path, board, score, is_played=False)
        assert told in path.read_text("utf-8")


def test_two_fingers_on_a_board_that_lies_are_drawn_below_each_other() -> None:
    lies = turned(load_board("strip5"))
    levels = np.zeros((2, lies.x.size, lies.y.size))
    play = FingersPlay(lies, [(-20.0, 0.0), (20.0, 0.0)], levels, np.zeros(2), np.ones(2))
    figure = two_fingers_figure([play])
    figure.draw_without_rendering()
    first, second = (axes.get_position() for axes in figure.axes[:2])
    assert first.y0 > second.y1
    assert first.width * figure.get_figwidth() > 5.0
    # Each coil has a mark, with a ring around it.
    assert [len(axes.lines) for axes in figure.axes[:2]] == [2 * len(lies.actuators)] * 2
