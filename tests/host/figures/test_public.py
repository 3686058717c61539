"""The names that figures and manufacture offer, and what a swipe's figure shows."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import PathCollection

from chladni.host import figures, manufacture, run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.emulation.touches import TouchScore
from chladni.sim.board.board import Board
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from wide import turned


@pytest.mark.parametrize("name", figures.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(figures, name) is not None
    assert sum(name in names for names in figures._PLACES.values()) == 1


def test_every_place_is_offered() -> None:
    assert sorted(name for names in figures._PLACES.values() for name in names) == figures.__all__
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = figures.nothing


@pytest.mark.parametrize("name", manufacture.__all__)
def test_a_name_that_moved_to_manufacture_is_found_at_its_old_place_too(name: str) -> None:
    with pytest.warns(DeprecationWarning, match=f"{name} goes with 0.3.0"):
        assert getattr(figures, name) is getattr(manufacture, name)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = manufacture.nothing


def test_nothing_is_loaded_before_it_is_asked_for() -> None:
    """matplotlib takes half a second, and its backend is the caller's to choose."""
    told = "import chladni.host.figures, sys; print('matplotlib' in sys.modules)"
    asked = "from chladni.host.figures import save; import matplotlib as m; print(m.get_backend())"
    for code, expected in (
        (told, "False"),
        (f"import os; os.environ['MPLBACKEND'] = 'svg'; {asked}", "svg"),
    ):
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        )
        assert done.stdout.strip() == expected


@pytest.fixture(scope="module")
def swiped(coarse_board: Board, coarse_table: tuple[Table, TableReport]) -> Sequence[TouchScore]:
    events = [TouchEvent(20.0 + 10.0 * k, (3.0 * k, 10.0 * k)) for k in range(5)]
    return run_loop(coarse_table[0], coarse_board, events, 100.0)[1].touches


@pytest.mark.parametrize("wide", [False, True])
def test_a_swipe_shows_its_places_and_numbers(
    coarse_board: Board, swiped: Sequence[TouchScore], wide: bool
) -> None:
    board, touches = coarse_board, list(swiped)
    if wide:
        board = turned(board)
        touches = [replace(one, target_mm=one.target_mm[::-1]) for one in touches]
    figure = figures.swipe_figure(board, touches)
    over, *curves = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    (points,) = [one for one in over.collections if isinstance(one, PathCollection)]
    assert np.asarray(points.get_offsets()).tolist() == [list(one.target_mm) for one in touches]
    assert over.get_aspect() == 1.0
    assert [axes.get_ylabel().split()[0] for axes in curves] == ["second", "focal", "SSIM", "under"]
    assert curves[2].lines[0].get_ydata() == pytest.approx([one.card.ssim for one in touches])
    width, height = figure.get_size_inches()
    assert (height > width) == wide
