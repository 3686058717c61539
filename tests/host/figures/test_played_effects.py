"""What an effect came to, drawn: its numbers above it, and the other finger at a scale that shows
how little it gets."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.calibration.hidden import hidden_plate
from chladni.host.cli.effects.setup import Setup
from chladni.host.emulation.played_effect import PlayedEffect
from chladni.host.figures.effects import played_effects_figure
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Isolation, Measured


@pytest.fixture
def played() -> PlayedEffect:
    t_s = np.arange(200) / 4000.0
    wave = np.sin(2.0 * np.pi * 160.0 * t_s)
    return PlayedEffect(
        t_s=t_s,
        asked=wave,
        own_um=8.0 * wave,
        other_um=0.8 * np.abs(wave),
        peak_um=8.0,
        other_peak_um=0.8,
        just_felt_um=0.36,
        bias_um=None,
        bias_duty=None,
        first_ms=1.0,
        rise_ms=5.0,
        envelope_error_db=0.1,
        isolation_db=20.0,
        rested=False,
    )


@pytest.mark.parametrize(("share", "is_alike"), [(0.1, True), (0.02, False)])
def test_the_other_finger_has_the_firsts_scale_where_it_can_be_seen(
    played: PlayedEffect, share: float, *, is_alike: bool
) -> None:
    assert played.other_um is not None
    less = replace(played, other_um=share * 10.0 * played.other_um)
    axes = played_effects_figure([less], ["click"]).axes
    assert (axes[1].get_ylim() == axes[2].get_ylim()) == is_alike
    assert ("scale of its own" in axes[2].get_ylabel()) != is_alike
    assert "RMS over fingertip\n(no sign) / µm" in axes[2].get_ylabel()


def test_time_is_counted_from_the_effect_where_fingers_rested(played: PlayedEffect) -> None:
    labels = [
        played_effects_figure([replace(played, rested=rested)], ["click"]).axes[-1].get_xlabel()
        for rested in (False, True)
    ]
    assert labels[0].startswith("ms from the touch")
    assert labels[1].startswith("ms from the effect's beginning")


def test_an_answer_names_plate_and_table_and_how_the_board_is_known() -> None:
    board: Board = load_board("strip5")
    table = object()
    drawn = Setup(table, board, None, None, None)  # type: ignore[arg-type]
    assert drawn.title == "strip5 as drawn"
    assert drawn.rows(as_json=True) == {"board": "strip5", "plate": None}
    measured = replace(board, measured=Measured("coils", "2026-01-01", (), *[Isolation(9.0)] * 2))
    known = replace(
        drawn,
        board=measured,
        plate=hidden_plate(board, 2),
        hidden="strip5@2",
        file=Path("made") / "t.chl",
    )
    assert known.title == "strip5 as measured, hidden plate strip5@2, table t.chl"
    assert known.rows(as_json=True) == {"board": "strip5", "plate": "strip5@2"}
    assert known.rows(as_json=False) == {
        "board": "strip5, as measured",
        "hidden plate": "strip5@2",
        "table": str(Path("made") / "t.chl"),
    }
