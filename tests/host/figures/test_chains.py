"""The profile of a touch, and the figure it is drawn in."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.drives.problem.problem import solved_board
from chladni.host.figures.chains import FARTHEST_MM, RING, Chain, chains_figure, profile
from chladni.sim.image import metrics
from conftest import shipped_board


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
