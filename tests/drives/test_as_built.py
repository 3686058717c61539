"""What a board keeps as it is built and touched: closed forms, and rows in their order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.drives.scoring.as_built import AsBuilt, score_as_built, score_together
from chladni.drives.scoring.kept_focus import KeptFocus
from chladni.drives.scoring.warm_coils import board_rise_k, warm
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.errors import ArgumentError
from conftest import CommandLine, shipped_board
from wired_boards import SWITCHED

PITCH, SAMPLES, SEED = 20e-3, 2, 5


@pytest.fixture(scope="module")
def board() -> Board:
    """`strip5` with fewer image points, on a sheet that a press does not stretch."""
    own = shipped_board("strip5")
    plate = replace(own.plate, thickness=0.6e-3)
    return replace(own, plate=plate, image=replace(own.image, points=(29, 121)))


@pytest.fixture(scope="module")
def built(board: Board) -> AsBuilt:
    return score_as_built(board, pitch=PITCH, samples=SAMPLES, seed=SEED)


def um(kept: KeptFocus | None) -> float:
    assert kept is not None
    assert kept.finger_um is not None
    return kept.finger_um.median


def level(kept: KeptFocus | None) -> float:
    assert kept is not None
    assert kept.second_finger_20mm_db is not None
    return kept.second_finger_20mm_db.p10


def test_warm_coils_take_what_their_own_resistance_leaves() -> None:
    """T (1 + αT) = r P₀ for each coil; the device evens out all but what the magnets lose."""
    own = load_board(SWITCHED / "strip5.toml")
    drive = np.array([1.0, 0.6, 0.0, 0.3j, -0.1])
    found, full = warm(own, drive), full_drive(own, drive, 160.0)
    assert found is not None
    assert full is not None
    electronics = own.electronics
    amplitude = full.duties
    cold = (full.bias**2 + amplitude**2 / 2.0) * electronics.supply_v**2 / electronics.coil_ohm
    rise = found.rise_k
    assert rise * (1.0 + 3.93e-3 * rise) == pytest.approx(electronics.coil_k_per_w * cold)
    # Half of a coil's rise comes to its magnet, which loses 0.12 % per kelvin.
    loudest = 1.0 / (1.0 + 3.93e-3 * rise.max())
    assert found.forces == pytest.approx(loudest * (1.0 - 0.6e-3 * rise))
    # 14 × 60 mm at 10 W/(m²·K) on both faces.
    assert board_rise_k(own, found) == pytest.approx(found.watts / 0.0168)


def test_every_row_is_worse_than_the_board_as_drawn_where_it_must_be(built: AsBuilt) -> None:
    presses = [um(built.pressed[newtons]) for newtons in ("0.3", "1", "3")]
    assert um(built.nominal) > presses[0] > presses[1] > presses[2] > 0.2 * um(built.nominal)
    # On foam alone a force moves √k less; a strip under coils is nearer to k.
    assert built.foam_twice is not None
    assert 1.4 < um(built.nominal) / um(built.foam_twice) < 2.3
    assert built.magnet_k is not None
    assert built.board_k is not None
    assert built.magnet_k.median > built.board_k.median
    # Copper at a rise of 40 to 50 K, and little of a magnet's.
    assert 0.75 < um(built.warm) / um(built.nominal) < 0.9
    assert level(built.warm) == pytest.approx(level(built.nominal), abs=0.5)
    # Of eleven places the median is within 2 %: the loudest tenth says it.
    assert built.film is not None
    filmed, drawn = built.film.finger_um, built.nominal.finger_um
    assert filmed is not None
    assert drawn is not None
    assert filmed.p90 < drawn.p90
    assert um(built.together) < min(um(built.film), um(built.warm), presses[1])
    assert level(built.nominal) > level(built.nearest_coil)
    assert built.pressed_mm is None


def test_a_board_without_foam_has_no_row_of_it() -> None:
    assert score_as_built(shipped_board("prototype"), pitch=40e-3, samples=1).foam_twice is None


@pytest.mark.soak
def test_a_thin_sheet_goes_down_and_stretches() -> None:
    found = score_as_built(shipped_board("strip5"), pitch=PITCH, samples=SAMPLES)
    assert found.pressed_mm is not None
    assert 0.1 < found.pressed_mm.median < 0.3
    assert um(found.nominal) > um(found.pressed["1"]) > um(found.pressed["3"])
    assert level(found.pressed["3"]) < level(found.nominal)


def test_the_last_row_alone_is_the_same(board: Board, built: AsBuilt) -> None:
    assert score_together(board, pitch=PITCH, samples=SAMPLES, seed=SEED) == built.together


def test_a_board_with_a_layer_gets_no_film_besides(board: Board) -> None:
    panel = shipped_board("pad16").panel
    assert panel is not None
    filmed = replace(board, panel=replace(panel, place="on", film=50e-6, size=board.plate.size))
    found = score_as_built(filmed, pitch=30e-3, samples=1)
    assert found.film is None


@pytest.mark.parametrize("newtons", [0.01, 100.0])
def test_what_no_finger_presses_with_is_refused(chladni: CommandLine, newtons: float) -> None:
    with pytest.raises(ArgumentError, match=r"0\.05 to 10 N"):
        score_as_built(shipped_board("strip5"), newtons=newtons)
    refused = chladni("board", "score", "strip5", "--built", "--press", newtons)
    assert refused.code == 2
    assert "press" in refused.err
    assert "0.05 to 10 N" in refused.err
