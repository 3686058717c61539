"""What a command writes: never over what it reads."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from chladni.sim.files import read_text
from conftest import ROOT, CommandLine

SPEC = """
[plate]
size_mm = [30.0, 20.0]
thickness_mm = 1.0
material = "acrylic"

[design]
coils = 2
evaluations = 2
"""


@pytest.mark.parametrize("named", ["board.toml", "board"])
def test_a_table_takes_no_boards_place(chladni: CommandLine, tmp_path: Path, named: str) -> None:
    """Once it did, and the search that the board came from was gone with it."""
    board, kept = tmp_path / "board.toml", tmp_path / "board.toml.partial"
    shutil.copy(ROOT / "boards" / "strip5.toml", board)
    kept.write_bytes(b"boards of a search")
    before = board.read_bytes()
    refused = chladni("table", "build", tmp_path / named, "-o", board)
    assert refused.code == 2
    assert "-o: expected another file than the one read" in refused.err
    other = chladni("table", "build", tmp_path / named, "-o", tmp_path / "other.toml")
    assert other.code == 2
    assert "-o: expected a name for a table, as in board.chl" in other.err
    assert board.read_bytes() == before
    assert kept.read_bytes() == b"boards of a search"
    assert not (tmp_path / "other.toml").exists()


def test_a_found_board_takes_no_specs_place(chladni: CommandLine, tmp_path: Path) -> None:
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC, encoding="utf-8")
    refused = chladni("design", spec, "-o", spec)
    assert (refused.code, "another file than the one read" in refused.err) == (2, True)
    front = tmp_path / "front"
    front.mkdir()
    inside = front / "best-7.toml"
    inside.write_text(SPEC, encoding="utf-8")
    refused = chladni("design", inside, "-o", tmp_path / "best.toml", "--front", front)
    assert (refused.code, "--front: expected another file" in refused.err) == (2, True)
    assert read_text(spec, "spec", 10_000) == read_text(inside, "spec", 10_000) == SPEC


def test_a_shipped_name_is_not_the_file_of_that_name_beside_it(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stopped search of a shipped SPEC goes on into the board that it wrote."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "boards" / "strip5.toml", "phone5.toml")
    asked = ("design", "phone5", "-o", "phone5.toml", "--front", "none/front")
    refused = chladni(*asked)
    assert (refused.code, "--front: expected a folder" in refused.err) == (2, True)


def test_an_effect_is_converted_to_another_file(chladni: CommandLine, tmp_path: Path) -> None:
    effect = tmp_path / "own.haptic"
    assert chladni("effects", "convert", "click", "-o", effect).code == 0
    before = effect.read_bytes()
    refused = chladni("effects", "convert", effect, "-o", effect)
    assert (refused.code, "another file than the one read" in refused.err) == (2, True)
    assert effect.read_bytes() == before
