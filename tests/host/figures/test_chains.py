"""The profile of a touch, and the figure it is drawn in."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from chladni.drives.problem.problem import solved_board
from chladni.host.figures.chains import FARTHEST_MM, RING, Chain, chains_figure, profile
from chladni.host.figures.designs import front_figure
from chladni.sim.image import metrics
from conftest import shipped_board
from wide import turned


@pytest.mark.parametrize("target", [(0.0, 6.0), (2.5, -19.0)])
def test_the_loudest_of_a_profile_is_the_second_finger(target: tuple[float, float]) -> None:
    """From whole rings on, the loudest ring is what `second_finger_db` finds from there on."""
    board = shipped_board("strip5")
    fields = solved_board(board).fields.values
    drive = np.random.default_rng(1).normal(size=(2, 5)) @ fields.reshape(5, -1)
    field = (drive[0] + 1j * drive[1]).reshape(fields.shape[1:])
    own = profile(board, field, target)
    place = (target[0] * 1e-3, target[1] * 1e-3)
    for ring in (8, 10, 14):
        beyond = own.loudest_db[own.distance_mm > ring * RING * 1e3].max()
        # A disc exactly on the ring's inner edge is in the ring, and not beyond its distance.
        (second,) = metrics.FingertipDiscs(board.x, board.y).second_finger_db(
            field, place, [ring * RING - 1e-9]
        )
        assert beyond == pytest.approx(-second, abs=1e-6)
    assert np.all(own.median_db <= own.loudest_db + 1e-12)
    # The target is an image point: its own disc is among those of the first ring.
    assert own.loudest_db[0] >= -1e-6


def test_the_figure_has_a_row_a_board_and_levels_on_one_scale() -> None:
    board = shipped_board("strip5")
    field = solved_board(board).fields.values[2]
    chain = Chain(board, (0.0, 0.0), field, field, "the middle coil alone")
    figure = chains_figure([chain, chain])
    assert len(figure.axes) == 6
    assert {axes.get_xlim() for axes in figure.axes[2::3]} == {(0.0, FARTHEST_MM)}
    assert len({axes.get_ylim() for axes in figure.axes[2::3]}) == 1
    assert figure.axes[2].get_title() == "the middle coil alone"


def test_images_of_a_wide_board_stand_one_above_the_other() -> None:
    """Each three tenths of the figure wide or more, the board's shape kept."""
    board = turned(shipped_board("prototype"))
    field = np.ones((board.x.size, board.y.size), dtype=np.complex128)
    figure = chains_figure([Chain(board, (0.0, 0.0), field, field, "all alike")])
    figure.draw_without_rendering()
    images = [axes for axes in figure.axes if axes.get_aspect() == 1.0]
    boxes = [
        axes.get_window_extent().transformed(figure.transSubfigure.inverted()) for axes in images
    ]
    assert len(boxes) == 2
    assert min(box.width for box in boxes) > 0.3
    assert boxes[0].y0 > boxes[1].y1
    assert boxes[0].x0 == pytest.approx(boxes[1].x0, abs=0.01)


@pytest.mark.parametrize("is_wide", [False, True])
def test_the_best_board_of_a_front_fills_its_room(is_wide: bool) -> None:
    board = shipped_board("prototype")
    board = turned(board) if is_wide else board
    summary = {
        "finger_um": 5.0,
        "coils": 5,
        "second_finger_20mm_db": 3.0,
        "robust_score": 1.0,
        "mass_g": 20.0,
    }
    # Goals without an axis are named, where boards differ in them.
    summary |= {"fingers_2_db": 20.0, "fingers_um": 3.0, "area_cm2": 99.0}
    rows: list[Any] = [
        SimpleNamespace(summary=summary | {"second_finger_20mm_db": own}) for own in (3.0, 4.0)
    ]
    found: Any = SimpleNamespace(front=rows, board=board)
    (alone,) = front_figure(SimpleNamespace(front=rows[:1], board=board)).axes  # type: ignore[arg-type]
    assert alone.get_ylabel() == "y / mm"
    figure = front_figure(found)
    figure.draw_without_rendering()
    front, best = figure.axes
    # One finger alone is no goal where several are weighed.
    assert front.get_title() == "Boards of which none is better in every goal"
    room = figure.get_window_extent()
    own = best.get_window_extent()
    longest = max(own.width / room.width, own.height / room.height)
    assert longest > 0.6
    assert (own.width > own.height) == is_wide
    # A title ends within the picture.
    for axes in (front, best):
        title = axes.title.get_window_extent()
        assert room.x0 <= title.x0
        assert title.x1 <= room.x1


def test_a_front_shows_clicks_where_they_were_weighed() -> None:
    board = shipped_board("phone5")
    summary = {"coils": 5, "robust_score": 1.0, "mass_g": 20.0, "area_cm2": 99.0}
    summary |= {"fingers_um": 3.0, "fingers_click_db": 12.0}
    rows: list[Any] = [SimpleNamespace(summary=summary | {"fingers_2_db": db}) for db in (3.0, 4.0)]
    found: Any = SimpleNamespace(front=rows, board=board)
    front, _ = front_figure(found).axes
    assert front.get_ylabel() == "2 fingers apart, a click of one, dB (10th percentile)"
    assert list(front.lines[0].get_ydata()) == [12.0, 12.0]  # type: ignore[arg-type]
    assert "More goals: tones of 2 fingers apart" in front.get_title()
