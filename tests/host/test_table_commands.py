"""`table verify`, `diff` and `export` on the command line."""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path

import numpy as np
import pytest

from chladni.sim.board.board import Board
from chladni.tables.format import pack, read_table
from chladni.tables.mirror_symmetry import NO_MIRRORS
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from conftest import CommandLine


@pytest.fixture
def path(tmp_path: Path, coarse_table: tuple[Table, TableReport]) -> Path:
    file = tmp_path / "t.chl"
    file.write_bytes(pack(coarse_table[0]))
    return file


def test_a_table_of_its_board_is_verified(
    chladni: CommandLine, path: Path, coarse_table: tuple[Table, TableReport], prototype: Board
) -> None:
    # The coarse board is `prototype` with other regions; its mirrors are the same.
    own = dataclasses.replace(coarse_table[0], board_fingerprint=prototype.fingerprint())
    path.write_bytes(pack(own))
    answer = chladni("table", "verify", path, "--json").json
    assert answer["verified"] is True
    assert answer["regions"] == 32
    assert answer["bytes"] == path.stat().st_size


def test_mirrors_that_the_board_has_not_are_refused(
    chladni: CommandLine, tmp_path: Path, coarse_table: tuple[Table, TableReport], prototype: Board
) -> None:
    """Silent drives are their own images under any order; the board's order is another."""
    table = dataclasses.replace(coarse_table[0], board_fingerprint=prototype.fingerprint())
    section = table.section()
    silent = dataclasses.replace(section, iq=np.zeros_like(section.iq))
    wrong = dataclasses.replace(table.symmetry, x=(1, 0, 2, 3, 4))
    file = tmp_path / "w.chl"
    file.write_bytes(pack(dataclasses.replace(table, sections=(silent,), symmetry=wrong)))
    answer = chladni("table", "verify", file)
    assert answer.code == 2
    assert "mirror_x" in answer.err


def test_diff_names_fields_and_counts_regions(
    chladni: CommandLine, path: Path, coarse_table: tuple[Table, TableReport]
) -> None:
    same = chladni("table", "diff", path, path, "--json").json
    assert same["header"] == {}
    assert same["regions_that_differ"] == 0
    table = coarse_table[0]
    # Another common phase is the same drive, and what is stored unmirrored holds the same.
    iq = table.region_iq(table.section()).copy()
    iq[3] = -iq[3]
    iq[7, 2] = (1232, -96)
    unmirrored = dataclasses.replace(
        table.section(),
        iq=iq,
        labels=np.zeros(len(iq), np.uint8),
        crossings=np.zeros((1, 2), np.uint8),
    )
    other = path.with_name("o.chl")
    other.write_bytes(pack(dataclasses.replace(table, sections=(unmirrored,), symmetry=NO_MIRRORS)))
    answer = chladni("table", "diff", path, other, "--json").json
    assert answer["regions_that_differ"] == 1
    assert answer["largest_at_region"] == 7
    assert answer["compared_hz"] == 160.0
    assert {"mirror_x", "mirror_y"} <= set(answer["header"])


def test_tables_of_one_board_differ_by_no_fingerprint(
    chladni: CommandLine, path: Path, coarse_table: tuple[Table, TableReport]
) -> None:
    """Responses depend on no objective: their fingerprint is the end of the board's."""
    table, other = coarse_table[0], path.with_name("o.chl")
    alone = dataclasses.replace(table, board_fingerprint=table.board_fingerprint % 2**32)
    other.write_bytes(pack(alone))
    assert chladni("table", "diff", path, other, "--json").json["header"] == {}
    end = f"…{alone.board_fingerprint:08x}"
    assert end in chladni("table", "show", other).out


def test_diff_compares_like_with_like(
    chladni: CommandLine, path: Path, coarse_table: tuple[Table, TableReport]
) -> None:
    """The section of a frequency both have, wherever it stands; nothing if there is none."""
    table = coarse_table[0]
    other = dataclasses.replace(
        table.section(), frequency_hz=120.0, iq=np.zeros_like(table.section().iq)
    )
    for sections, compared in (((other, table.section()), 160.0), ((other,), None)):
        second = path.with_name("s.chl")
        second.write_bytes(pack(dataclasses.replace(table, sections=sections)))
        answer = chladni("table", "diff", path, second, "--json").json
        assert answer["compared_hz"] == compared
        assert answer["regions_that_differ"] == (0 if compared else None)
        assert "frequencies_hz" in answer["header"]


def test_export_writes_every_channel(
    chladni: CommandLine, path: Path, tmp_path: Path, coarse_table: tuple[Table, TableReport]
) -> None:
    out = tmp_path / "t.csv"
    answer = chladni("table", "export", path, "--csv", out, "--json").json
    table = coarse_table[0]
    assert answer["rows"] == 32 * 5
    with out.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 32 * 5
    row = rows[11 * 5 + 3]
    assert (row["region"], row["channel"]) == ("11", "3")
    value = float(row["gain"]) * np.exp(1j * np.radians(float(row["phase_deg"])))
    assert value == pytest.approx(table.drives(table.section())[11, 3], rel=1e-4)


@pytest.mark.parametrize("place", ["-8.9375,-64.18125", "26.8125,45.84375"])
def test_a_place_has_the_phases_that_solve_gives_it(
    chladni: CommandLine, table_file: Path, place: str
) -> None:
    """At the centre of a region, within the table's rounding; the place itself moves in phase 0."""
    shown = chladni("table", "show", table_file, "--at", place, "--json").json
    assert shown["region_centre_mm"] == pytest.approx([float(part) for part in place.split(",")])
    solved = chladni("solve", "prototype", "--target", place, "--json").json
    one, other = (
        np.array([c["gain"] * np.exp(1j * np.radians(c["phase_deg"])) for c in answer["drive"]])
        for answer in (shown, solved)
    )
    # Rounding is by less than a step of twelve bits a coil, and 10 is the largest gain.
    assert np.abs(one - other).max() < 4.0 * 10.0 / 2048.0
    assert np.abs(np.angle(one)).max() > 0.1


def test_a_table_of_an_unknown_board_keeps_its_phases(
    chladni: CommandLine, table_file: Path, tmp_path: Path
) -> None:
    own = tmp_path / "own.chl"
    own.write_bytes(pack(dataclasses.replace(read_table(table_file), board_name="own")))
    shown = chladni("table", "show", own, "--at", "10,25", "--json")
    assert "phases are as the table has them" in shown.err
    table = read_table(own)
    drive = table.drive_at(table.section(), 10_000, 25_000)
    assert [c["phase_deg"] for c in shown.json["drive"]] == pytest.approx(
        np.degrees(np.angle(drive)).tolist()
    )
