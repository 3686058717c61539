"""A table's fingerprint is of what its build reads from the board, and of nothing else."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.sim.board.board import Board, is_of, to_document
from chladni.sim.board.file import board_from_document, load_board
from chladni.sim.board.writing import board_file
from chladni.sim.errors import InputError
from chladni.tables.build import table_of
from chladni.tables.inspection.owner import board_for
from chladni.tables.stored_regions import stored_regions
from chladni.tables.table import Section, Table
from wired_boards import SWITCHED

Changes = dict[str, dict[str, Any]]

COMMON: Changes = {
    "plate": {
        "thickness_mm": 0.21, "youngs_modulus_gpa": 23.0, "loss_factor": 0.03,
        "corner_radius_mm": 1.0, "size_mm": [14.0, 60.5],
    },
    "image": {"points": [13, 31]}, "regions": {"pitch_mm": 7.0},
    "drive": {"frequency_hz": 161.0, "max_gain": 9.0},
    "electronics": {"ramp_ms": 5.0, "touch_timeout_ms": 90.0, "max_on_s": 9.0},
    "foundation": {"thickness_mm": 2.1, "loss_factor": 0.3, "coil_cut_out_mm": 3.5},
    "magnet": {"height_mm": 4.1, "remanence_t": 1.25, "density_kg_m3": 7400.0},
    "winding": {"gap_mm": 0.9}, "coil": {"motion_acts_back": False},
    "panel": {
        "pixels": [100, 100], "size_mm": [14.0, 60.0], "place": "on", "film_mm": 0.1,
        "material": "pet",
    },
    "finger": {"mass_g": 5.0, "damping_n_s_per_m": 3.0, "stiffness_n_per_mm": 1.0},
}  # fmt: skip
"""Other values, each of which every table depends on."""
OF_FOCUS: Changes = {
    "focus": {
        "quieter_from_mm": 12.0,
        "quieter_db": 3.0,
        "silent_from_mm": 19.0,
        "reserve_db": 1.5,
        "foam_ratio": 1.5,
        "floor_um": 50.0,
    },
    "electronics": {
        "pwm_bits": 11,
        "supply_v": 4.0,
        "supply_limit_ma": 500.0,
        "max_duty": 0.9,
        "least_duty": 0.05,
        "coil_k_per_w": 90.0,
        "coil_limit_k": 50.0,
    },
}
"""Those that only tables of `focus` depend on."""
OF_NEITHER: Changes = {
    "plate": {"material": "Aluminium"}, "active": {"margin_mm": 3.0},
    "coil": {"moving_mass_g": 0.9, "resonance_hz": 170.0, "mechanical_q": 9.0, "rms_voltage": 1.0},
    "electronics": {
        "pwm_pins": [4, 2, 15, 16, 17], "coil_heating_s": 12.0, "chip": "esp32s3", "diode_v": 0.3,
    },
    "panel": {"pixels": [100, 100], "size_mm": [14.0, 60.0], "place": "beside"},
    "finger": {"mass_g": 2.0, "damping_n_s_per_m": 2.0, "stiffness_n_per_mm": 0.6},
}  # fmt: skip
"""Those that no table depends on. This finger is the usual one, which presses without any."""


def cases(changes: Changes) -> list[tuple[str, str, Any]]:
    found: list[tuple[str, str, Any]] = []
    for block, values in changes.items():
        if block in ("panel", "finger"):
            found.append((block, "", values))
        else:
            found += [(block, key, value) for key, value in values.items()]
    return found


def small_document() -> dict[str, Any]:
    """`strip5` with switches, few points and few regions: a table in a quarter of a second."""
    document = to_document(load_board(SWITCHED / "strip5.toml"))
    return document | {"image": {"points": [11, 31]}, "regions": {"pitch_mm": 9.0}}


def changed(block: str, key: str, value: Any) -> Board:
    document = small_document()
    if key:
        document[block][key] = value
    else:
        document[block] = value
    return board_from_document(document)


@pytest.fixture(scope="module")
def small_board() -> Board:
    return board_from_document(small_document())


def differ(small_board: Board, board: Board) -> tuple[bool, bool]:
    """Whether the fingerprint of `ssim` differs, and that of `focus`."""
    one, other = (
        board.fingerprint(objective) != small_board.fingerprint(objective)
        for objective in ("ssim", "focus")
    )
    return one, other


@pytest.mark.parametrize(("block", "key", "value"), cases(COMMON))
def test_a_fingerprint_follows_what_every_build_reads(
    small_board: Board, block: str, key: str, value: Any
) -> None:
    board = changed(block, key, value)
    assert differ(small_board, board) == (True, True)
    assert not is_of(small_board.fingerprint("ssim"), board.fingerprint())


@pytest.mark.parametrize(("block", "key", "value"), cases(OF_FOCUS))
def test_what_a_focus_depends_on_refuses_no_table_of_another_objective(
    small_board: Board, block: str, key: str, value: Any
) -> None:
    board = changed(block, key, value)
    assert differ(small_board, board) == (False, True)
    assert is_of(small_board.fingerprint("ssim"), board.fingerprint())
    assert not is_of(small_board.fingerprint("focus"), board.fingerprint())


@pytest.mark.parametrize(("block", "key", "value"), cases(OF_NEITHER))
def test_a_fingerprint_leaves_out_what_no_build_reads(
    small_board: Board, block: str, key: str, value: Any
) -> None:
    assert differ(small_board, changed(block, key, value)) == (False, False)


def test_no_name_is_in_a_fingerprint(small_board: Board) -> None:
    first, *rest = small_board.actuators
    called = (dataclasses.replace(first, name="left"), *rest)
    renamed = dataclasses.replace(small_board, name="other", actuators=called)
    assert renamed.fingerprint() == small_board.fingerprint()


def silent_table(board: Board, objective: str) -> Table:
    """A table as a build would make it, but for its drives."""
    regions = stored_regions(board)
    section = Section(
        160.0,
        objective,
        10.0,
        np.zeros(regions.count, np.uint8),
        np.zeros((1, 2), np.uint8),
        np.zeros((regions.count, len(board.actuators), 2), np.int16),
    )
    return table_of(board, regions, [section], 8)


def written(board: Board, path: Path) -> Path:
    path.write_bytes(board_file(board, []))
    return path


@pytest.mark.parametrize("objective", ["ssim", "focus"])
def test_a_table_is_of_every_board_that_it_would_be_built_alike_for(
    small_board: Board, tmp_path: Path, objective: str
) -> None:
    table = silent_table(small_board, objective)
    other = written(changed("electronics", "pwm_pins", [4, 2, 15, 16, 17]), tmp_path / "b.toml")
    assert board_for(table, other).electronics.pwm_pins[0] == 4
    edited = written(changed("image", "points", [13, 31]), tmp_path / "e.toml")
    with pytest.raises(InputError, match=r"board_fingerprint: expected .*build it again"):
        board_for(table, edited)
    weaker = written(changed("electronics", "coil_limit_k", 50.0), tmp_path / "w.toml")
    if objective == "ssim":
        assert board_for(table, weaker).electronics.coil_limit_k == 50.0
    else:
        with pytest.raises(InputError, match="board_fingerprint"):
            board_for(table, weaker)


def test_a_table_of_0_2_is_taken_if_its_limits_are_the_boards_too(
    small_board: Board, tmp_path: Path
) -> None:
    earlier = small_board.fingerprint_of_0_2()
    table = dataclasses.replace(silent_table(small_board, "focus"), board_fingerprint=earlier)
    own = written(small_board, tmp_path / "b.toml")
    assert board_for(table, own).name == small_board.name
    faded = written(changed("electronics", "ramp_ms", 5.0), tmp_path / "f.toml")
    with pytest.raises(InputError, match="board_fingerprint"):
        board_for(table, faded)


def test_shipped_boards_still_know_tables_of_0_2() -> None:
    """As 0.2.0 worked it out."""
    assert load_board("prototype").fingerprint_of_0_2() == 7273783351836534857
    assert load_board("strip5").fingerprint_of_0_2() == 17393792787801177024
