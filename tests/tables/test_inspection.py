"""What a finished table is asked in Python: its board, whether it is whole, how two differ."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import chladni.host
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Measured
from chladni.sim.board.writing import board_file
from chladni.sim.errors import ChladniError, InputError
from chladni.tables import board_for, difference, pack, verify_table
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from conftest import CommandLine


@pytest.fixture
def table(coarse_table: tuple[Table, TableReport], prototype: Board) -> Table:
    """A table of few regions that names `prototype` as its board."""
    return dataclasses.replace(coarse_table[0], board_fingerprint=prototype.fingerprint())


def test_a_table_that_the_firmware_reads_otherwise_is_refused(
    table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(pack(table))
    found = verify_table(path)
    # 4 columns and 8 rows: a lattice of 4 places a region, and 3 more along each axis.
    assert found.places_checked == (4 * 4 + 3) * (4 * 8 + 3)
    own = Table.lookup

    def one_off(*arguments: object) -> np.ndarray:
        drives = own(*arguments).copy()  # type: ignore[arg-type]
        drives[-1, -1, -1] += 1
        return drives

    monkeypatch.setattr(Table, "lookup", one_off)
    with pytest.raises(ChladniError, match="the firmware reads other drives at 160 Hz"):
        verify_table(path)


def test_a_table_has_the_board_that_it_was_made_for(table: Table, prototype: Board) -> None:
    assert board_for(table) == prototype
    with pytest.raises(InputError, match=r"t\.chl, actuators: expected 16"):
        board_for(table, "pad16", file="t.chl")
    with pytest.raises(InputError, match=r"t\.chl, board_fingerprint: expected 0x"):
        board_for(table, "strip5", file="t.chl")
    with pytest.raises(
        InputError, match=r"'mine' is no shipped board, and no mine\.toml is beside"
    ):
        board_for(dataclasses.replace(table, board_name="mine"))


def test_a_spec_beside_a_table_is_no_board(table: Table, prototype: Board, tmp_path: Path) -> None:
    """The answer of a design has the SPEC's name, and lies beside it."""
    own = dataclasses.replace(table, board_name="mine")
    (tmp_path / "mine.toml").write_text("[design]\ncoils = 5\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"no mine\.toml is beside the table"):
        board_for(own, file=str(tmp_path / "t.chl"))
    (tmp_path / "t.toml").write_bytes(board_file(prototype))
    assert board_for(own, file=str(tmp_path / "t.chl")) == prototype


@pytest.mark.parametrize("name", ["mine.toml", "t.toml"])
def test_a_board_file_beside_its_table_is_found(
    table: Table, prototype: Board, tmp_path: Path, name: str
) -> None:
    own = dataclasses.replace(table, board_name="mine")
    (tmp_path / name).write_bytes(board_file(dataclasses.replace(prototype, name="mine")))
    assert board_for(own, file=str(tmp_path / "t.chl")).name == "mine"
    with pytest.raises(InputError, match=r"no mine\.toml is beside the table"):
        board_for(own, file=str(tmp_path / "other" / "u.chl"))
    # A shipped name is what it was, whatever lies beside.
    (tmp_path / "prototype.toml").write_text("name = 3", encoding="utf-8")
    assert board_for(table, file=str(tmp_path / "t.chl")) == prototype


def test_a_measured_board_beside_its_table_is_found_under_a_shipped_name(
    coarse_table: tuple[Table, TableReport],
    prototype: Board,
    tmp_path: Path,
    chladni: CommandLine,
) -> None:
    measured = dataclasses.replace(
        prototype,
        plate=dataclasses.replace(prototype.plate, thickness=1.02e-3),
        measured=Measured("coils", "2026-11-26", ()),
    )
    own = dataclasses.replace(coarse_table[0], board_fingerprint=measured.fingerprint())
    file = tmp_path / "t.chl"
    file.write_bytes(pack(own))
    (tmp_path / "t.toml").write_bytes(board_file(measured))
    assert board_for(own, file=str(file)) == measured
    assert "prototype, as measured" in chladni("table", "show", file).out
    (tmp_path / "t.toml").unlink()
    assert "as measured" not in chladni("table", "show", file).out
    # The drawn board's table is not the measured one's, though both have one name.
    with pytest.raises(InputError, match=r"'prototype' as it was measured.*another version of"):
        board_for(coarse_table[0], _written(tmp_path / "measured.toml", measured))
    again = dataclasses.replace(measured, measured=None)
    with pytest.raises(InputError, match=r"as its file is now.*build it again for this one"):
        board_for(coarse_table[0], _written(tmp_path / "again.toml", again))


def _written(path: Path, board: Board) -> Path:
    path.write_bytes(board_file(board))
    return path


def test_the_old_name_of_board_for_warns_and_works(table: Table, prototype: Board) -> None:
    with pytest.warns(DeprecationWarning, match=r"chladni\.tables\.board_for"):
        renamed = chladni.host.board_of
    assert renamed(table, None, file="t.chl") == prototype


def test_tables_of_other_grids_differ_in_their_headers_alone(table: Table) -> None:
    wider = dataclasses.replace(table.grid, width_um=table.grid.width_um + 1)
    found = difference(table, dataclasses.replace(table, grid=wider))
    assert found.header == {"width_um": [table.grid.width_um, table.grid.width_um + 1]}
    assert found.largest is None
    assert difference(table, table).largest == 0.0
