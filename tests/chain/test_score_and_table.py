"""What a score promises of a board, its table keeps on the pins."""

from __future__ import annotations

import pytest

from chladni.drives.scoring.board_score import FEW_PLACES, PITCH, score_board, usual_pitch
from chladni.host.emulation.table_score import score_table
from chladni.sim.board.file import load_board
from chladni.tables.build import build_table
from chladni.tables.format import pack


@pytest.mark.parametrize("name", ["strip5", "quiet5"])
def test_a_table_keeps_what_the_score_said_within_1_db(name: str) -> None:
    """From 20 mm on, at the median and at the worst tenth of places."""
    board = load_board(name)
    promised = score_board(board, samples=0).second_finger_20mm_db
    table, _ = build_table(board)
    kept = score_table(table, board, size=len(pack(table)), samples=0).second_finger_20mm_db
    assert promised is not None
    assert kept is not None
    assert kept.median == pytest.approx(promised.median, abs=1.0)
    assert kept.p10 == pytest.approx(promised.p10, abs=1.0)
    assert kept.p10 < kept.median < 60.0


def test_a_small_board_is_scored_at_more_places() -> None:
    pitches = [usual_pitch(load_board(name)) for name in ("strip5", "pad16", "phone5")]
    assert pitches == [PITCH / 2.0, PITCH / 2.0, PITCH]
    assert score_board(load_board("pad16"), samples=0).places > FEW_PLACES
    assert score_board(load_board("strip5"), pitch=PITCH, samples=0).places == 9
