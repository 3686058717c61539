"""Work that took long is kept until the last of its files is written."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
import tomlkit

from chladni.design import search
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.scoring import compare as comparing
from chladni.host.cli import compare, design, table
from chladni.sim.files import write_whole
from conftest import ROOT, CommandLine
from made_specs import small

COARSE = ROOT / "tests" / "chain" / "coarse.toml"


def failing(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "the output")


def refusing(*_: object, **__: object) -> None:
    raise AssertionError("solved again")


@pytest.fixture
def coarse(tmp_path: Path) -> Path:
    """Few regions and few image points."""
    text = COARSE.read_text(encoding="utf-8")
    path = tmp_path / "coarse.toml"
    document = tomlkit.parse(text)
    document["image"]["points"] = [21, 41]
    document["regions"]["pitch_mm"] = 60.0
    path.write_text(tomlkit.dumps(document), encoding="utf-8")
    return path


def test_a_table_that_cannot_be_written_is_not_solved_again(
    chladni: CommandLine, tmp_path: Path, coarse: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("table", "build", coarse, "-o", tmp_path / "t.chl", "--objective", "contrast")
    with monkeypatch.context() as patched:
        patched.setattr(table, "write_whole", failing)
        answer = chladni(*words)
    assert answer.code == 1
    assert "No space left" in answer.err
    assert (tmp_path / "t.chl.partial").exists()
    monkeypatch.setitem(OBJECTIVES, "contrast", refusing)
    assert chladni(*words).code == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["coarse.toml", "t.chl"]


def test_rows_stay_until_their_figure_is_written(
    chladni: CommandLine, tmp_path: Path, coarse: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = (
        "compare", coarse, "--methods", "nearest", "--pitch", "60", "-o", tmp_path / "c.csv",
        "--figure", tmp_path / "c.png",
    )  # fmt: skip
    with monkeypatch.context() as patched:
        patched.setattr(compare, "write_figure", failing)
        assert chladni(*words).code == 1
    assert (tmp_path / "c.csv.partial").exists()
    monkeypatch.setattr(comparing, "solve_problem", refusing)
    monkeypatch.setattr(compare, "write_figure", lambda *_: None)
    assert chladni(*words).code == 0
    assert not (tmp_path / "c.csv.partial").exists()


def test_a_front_that_cannot_be_written_is_not_searched_again(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, out, front = tmp_path / "s.toml", tmp_path / "own.toml", tmp_path / "front"
    front.mkdir()
    one_layout = {"coils": 1, "evaluations": 1}
    spec.write_text(tomlkit.dumps(small(design=one_layout)), encoding="utf-8")
    words = ("design", spec, "-o", out, "--samples", "1", "--jobs", "1", "--front", front)

    def write(path: Path, data: bytes) -> None:
        if path.parent == front:
            failing()
        write_whole(path, data)

    with monkeypatch.context() as patched:
        patched.setattr(design, "write_whole", write)
        assert chladni(*words).code == 1
    assert (tmp_path / "own.toml.partial").exists()
    monkeypatch.setattr(search, "evaluate", refusing)
    assert chladni(*words).code == 0
    assert not (tmp_path / "own.toml.partial").exists()
    assert [path.name for path in front.iterdir()] == ["own-1.toml"]
