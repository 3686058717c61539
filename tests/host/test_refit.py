"""Foam that was measured: the board's file is kept but for it, and its table is for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from chladni.sim.board.file import load_board
from chladni.tables.format import unpack
from conftest import ROOT, CommandLine


def test_the_file_is_kept_and_its_foam_is_stiffer(chladni: CommandLine, tmp_path: Path) -> None:
    out, table = tmp_path / "b.toml", tmp_path / "t.chl"
    answer = chladni(
        "board", "refit", "strip5", "--foam", "1.9", "-o", out, "--table", table, "--json"
    )
    board, found = load_board("strip5"), load_board(out)
    assert board.foundation is not None
    assert found.foundation is not None
    stiffness = found.foundation.total_stiffness
    assert stiffness == pytest.approx(1.9 * board.foundation.total_stiffness)
    assert answer.json["stiffness_n_per_mm3"] == pytest.approx(1e-9 * stiffness)
    assert found.focus is not None
    assert found.focus.foam_ratio == 1.0
    old = (ROOT / "boards" / "strip5.toml").read_text("utf-8").splitlines()
    new = out.read_text("utf-8").splitlines()
    assert len([line for line in old if line not in new]) == 1  # foam_ratio
    assert len([line for line in new if line not in old]) == 2  # that, and stiffness_ratio
    assert unpack(table.read_bytes()).board_fingerprint == found.fingerprint()
    # What is measured again counts on top.
    again = tmp_path / "c.toml"
    chladni("board", "refit", out, "--foam", "0.5", "-o", again)
    twice = load_board(again).foundation
    assert twice is not None
    assert twice.measured_ratio == pytest.approx(0.95)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("strip5", "--foam", "100", "-o", "OUT"), "--foam: expected 0.1 to 20 times as stiff"),
        (
            ("prototype", "--foam", "2", "-o", "OUT"),
            "foundation is required: a sheet of foam",
        ),
        (("strip5", "--foam", "2", "-o", "OUT.txt"), "-o"),
    ],
)
def test_what_cannot_be_refitted_is_named(
    chladni: CommandLine, tmp_path: Path, arguments: tuple[str, ...], named: str
) -> None:
    places = {"OUT": str(tmp_path / "b.toml"), "OUT.txt": str(tmp_path / "b.txt")}
    answer = chladni("board", "refit", *(places.get(word, word) for word in arguments))
    assert answer.code == 2
    assert named in answer.err
    assert not list(tmp_path.iterdir())
