"""What a score promises of a board, its table keeps on the pins."""

from __future__ import annotations

from typing import Any

import pytest

from chladni.drives.scoring.board_score import FEW_PLACES, PITCH, score_board, usual_pitch
from chladni.host.emulation.table_score import score_table
from chladni.sim.board.board import Board
from chladni.sim.board.file import board_from_document, load_board
from chladni.tables.build import build_table
from chladni.tables.format import pack

CORNERS = [(x, y) for x in (-22.0, 22.0) for y in (-37.0, 37.0)]
ON_FEET: dict[str, Any] = {
    "name": "feet",
    "plate": {"size_mm": [54.0, 84.0], "thickness_mm": 1.5, "material": "acrylic"},
    "magnet": {"radius_mm": 5.0, "height_mm": 3.0, "density_kg_m3": 7500.0},
    "coil": {"resistance_ohm": 8.0, "force_factor_n_per_a": 0.8, "inductance_mh": 0.5},
    "electronics": {"coil_ohm": 8.0, "supply_v": 5.0, "drive": "bridge"},
    "drive": {"frequency_hz": 160.0},
    "focus": {},
    "image": {"points": [28, 43]},
    "regions": {"pitch_mm": 6.0},
    "springs": [{"at_mm": at, "part": "rubber-foot-10x5"} for at in CORNERS],
    "actuators": [
        {"name": f"coil-{k}", "at_mm": at}
        for k, at in enumerate(
            [(-14.0, -26.0), (14.0, -26.0), (0.0, 0.0), (-14.0, 26.0), (14.0, 26.0)]
        )
    ],
}


@pytest.mark.parametrize(
    ("board", "compensated"),
    [
        (load_board("strip5"), False),
        (load_board("quiet5"), False),
        (board_from_document(ON_FEET), True),
    ],
    ids=lambda own: getattr(own, "name", None),
)
def test_a_table_keeps_what_the_score_said_within_1_db(board: Board, compensated: bool) -> None:
    """From 20 mm on, at the median and at the worst tenth of places.

    On feet both have drives that make up for a pressing finger's load.
    """
    score = score_board(board, samples=0)
    assert score.compensated is compensated
    promised = score.second_finger_20mm_db
    table, report = build_table(board)
    assert report.fingers.compensated is compensated
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
