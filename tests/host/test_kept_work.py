"""Work that took long is kept until the last of its files is written."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import tomlkit
from rich.progress import Progress

from chladni.design import search
from chladni.drives.checkpoint import Checkpoint
from chladni.drives.methods import SEED
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.scoring import compare as comparing
from chladni.host.cli import compare, table_build
from chladni.host.cli.common import output
from chladni.host.cli.common.output import progress_bar
from chladni.host.cli.designing import design
from chladni.sim.errors import StoppedError
from chladni.sim.files import write_whole
from chladni.tables.build import build_table
from chladni.tables.several_fingers import build_for
from conftest import ROOT, CommandLine
from made_specs import small

COARSE = ROOT / "tests" / "chain" / "coarse.toml"


def failing(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "the output")


def interrupting(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


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
        patched.setattr(table_build, "write_whole", failing)
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
        "compare",
        coarse,
        "--methods",
        "nearest",
        "--pitch",
        "60",
        "-o",
        tmp_path / "c.csv",
        "--figure",
        tmp_path / "c.png",
    )
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
    one_layout = {"coils": 1, "evaluations": 1, "weights": {"fingers_2_db": 1.0}}
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
    monkeypatch.setattr(search, "judged", refusing)
    done = chladni(*words)
    assert done.code == 0
    assert "says more and how much foam twice as stiff takes" in " ".join(done.err.split())
    assert (
        f"`chladni fingers {out} --fingers 2 --samples 1 --seed {SEED}` scores it within"
        in done.err
    )
    assert not (tmp_path / "own.toml.partial").exists()
    assert [path.name for path in front.iterdir()] == ["own-1.toml"]


def test_a_spec_that_no_board_meets_leaves_nothing(chladni: CommandLine, tmp_path: Path) -> None:
    spec, out = tmp_path / "s.toml", tmp_path / "own.toml"
    coils = [{"name": "a", "at_mm": [100.0, 0.0]}]
    open_sheet = {"thickness_mm": {"from": 0.1, "to": 0.3}}
    document = small(actuators=coils, plate=open_sheet, design={"coils": None, "evaluations": 2})
    spec.write_text(tomlkit.dumps(document), encoding="utf-8")
    refused = chladni("design", spec, "-o", out, "--jobs", "1")
    assert refused.code == 2
    assert "1 board beyond a limit" in refused.err
    assert "actuators[0].at_mm: expected a place on the plate" in refused.err
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]


def test_boards_of_another_spec_are_named_before_they_are_lost(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, out = tmp_path / "s.toml", tmp_path / "own.toml"
    spec.write_text(tomlkit.dumps(small(design={"coils": 1, "evaluations": 1})), encoding="utf-8")
    words, kept = ("design", spec, "-o", out, "--samples", "1", "--jobs", "1"), f"{out}.partial"
    with Checkpoint(Path(kept), {"search": "another", "seed": 1}) as checkpoint:
        checkpoint.put("board x", {})
    before = Path(kept).read_bytes()
    with monkeypatch.context() as patched:
        patched.setattr(search, "layouts_of", failing)
        stopped = chladni(*words)
    assert f"chladni: {kept} has boards of another SPEC, seed or version" in stopped.err
    assert Path(kept).read_bytes() == before, "lost before there was a result"
    with monkeypatch.context() as patched:
        patched.setattr(search, "layouts_of", interrupting)
        stopped = chladni(*words)
    assert "interrupted" in stopped.err
    assert "goes on" not in stopped.err, "nothing of this SPEC was kept"
    finished = chladni(*words)
    assert finished.code == 0
    assert "another SPEC" in finished.err
    assert "a board takes" in finished.err
    assert not Path(kept).exists()


@pytest.mark.parametrize("is_kept", [False, True])
def test_ctrl_c_promises_what_was_kept_only_where_something_was(
    chladni: CommandLine,
    tmp_path: Path,
    coarse: Path,
    monkeypatch: pytest.MonkeyPatch,
    is_kept: bool,
) -> None:
    def press(done: int, _: int) -> None:
        raise KeyboardInterrupt

    def cut_off(*arguments: Any, **options: Any) -> None:
        if is_kept:
            build_table(*arguments, **{**options, "progress": press})
        raise KeyboardInterrupt

    monkeypatch.setattr(build_for, "build_table", cut_off)
    path = tmp_path / "t.chl"
    answer = chladni("table", "build", coarse, "-o", path, "--objective", "contrast")
    hint = "; the same command goes on from what was kept" * is_kept
    assert (answer.code, answer.err) == (130, f"chladni: solving: interrupted{hint}\n")
    assert (tmp_path / "t.chl.partial").exists() == is_kept


@pytest.mark.parametrize("done", [0, 5])
def test_ctrl_c_promises_what_a_device_keeps_once_it_has_something(done: int) -> None:
    def flash() -> None:
        with progress_bar("flash", kept=True) as progress:
            if done:
                progress(done, 9)
            raise KeyboardInterrupt

    with pytest.raises(StoppedError) as caught:
        flash()
    assert ("goes on" in str(caught.value)) == bool(done)


def test_where_there_is_no_bar_long_work_is_told_in_lines(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """After 20 s, then every minute, and nothing of what is done sooner."""
    now = [100.0]
    monkeypatch.setattr(output, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with output.progress_bar("boards") as progress:
        for done in range(1, 26):
            now[0] += 8.0
            progress(done, 25)
    assert capsys.readouterr().err.splitlines() == [
        "chladni: boards: 3 of 25, about 176 s are left",
        "chladni: boards: 11 of 25, about 112 s are left",
        "chladni: boards: 19 of 25, about 48 s are left",
    ]


def test_what_comes_before_the_first_piece_is_not_counted_for_the_others(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A minute of layouts, 5 of 12 boards from an earlier run; then other work, 10 s a piece."""
    now = [0.0]
    monkeypatch.setattr(output, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with output.progress_bar("boards") as progress:
        for seconds, done, total in ((60.0, 5, 12), (2.0, 6, 12), (70.0, 12, 15), (10.0, 13, 15)):
            now[0] += seconds
            progress(done, total)
    assert capsys.readouterr().err.splitlines() == [
        "chladni: boards: 5 of 12 so far",
        "chladni: boards: 13 of 15, about 20 s are left",
    ]


def test_a_search_says_early_where_it_is_and_estimates_by_its_last_pieces(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Kept boards, layouts up to 9 s, boards of two processes each 12 s, and then each 30 s."""
    now = [0.0]
    monkeypatch.setattr(output, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with output.progress_bar("boards") as progress:
        for at_s, done in ((0.1, 3), (6, 0), (9, 0), (21, 5), (21.1, 6), (33, 8), (75, 12)):
            now[0] = at_s
            progress(done, 100)
        now[0] = 105.0
        progress(14, 100)
    assert capsys.readouterr().err.splitlines() == [
        "chladni: boards: 0 of 100 so far",
        "chladni: boards: 5 of 100, about 228 s are left",
        "chladni: boards: 14 of 100, about 803 s are left",
    ]


def test_a_table_is_estimated_by_what_comes_after_its_first_batch(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A first region and then ten seconds of other work: 7462 s were told of 100."""
    now = [0.0]
    monkeypatch.setattr(output, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with output.progress_bar("solving", batch=16) as progress:
        for at_s, done in ((15.0, 1), (25.0, 2), (25.5, 17), (33.5, 81), (35.5, 97)):
            now[0] = at_s
            progress(done, 748)
    assert capsys.readouterr().err.splitlines() == [
        "chladni: solving: 2 of 748 so far",
        "chladni: solving: 97 of 748, about 81 s are left",
    ]


def test_no_more_time_is_told_than_work_has(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of `--minutes`, until they are over."""
    now = [0.0]
    monkeypatch.setattr(output, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with output.progress_bar("boards", limit_s=100.0) as progress:
        for at_s, done in ((5.0, 0), (30.0, 1), (110.0, 2)):
            now[0] = at_s
            progress(done, 100)
    assert capsys.readouterr().err.splitlines() == [
        "chladni: boards: 0 of 100 so far",
        "chladni: boards: 1 of 100, about 70 s are left",
        "chladni: boards: 2 of 100, about 7840 s are left",
    ]


def test_what_changes_its_number_tells_percent_that_never_fall(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A search that finds time for more boards: 30 of 60, and then 31 of 90."""
    now = [0.0]
    monkeypatch.setattr(output, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with output.progress_bar("search", in_percent=True) as progress:
        for at_s, done, total in ((5.0, 0, 60), (30.0, 30, 60), (60.0, 31, 90), (100.0, 36, 90)):
            now[0] = at_s
            progress(done, total)
    assert capsys.readouterr().err.splitlines() == [
        "chladni: search: 0 % so far",
        "chladni: search: 50 %, about 25 s are left",
        "chladni: search: 50 %, about 432 s are left",
    ]


def test_a_bar_in_percent_never_falls(monkeypatch: pytest.MonkeyPatch) -> None:
    """As the log's lines; on a terminal."""
    shown = []

    class Bar(Progress):
        def update(self, task: Any, **what: Any) -> None:  # type: ignore[override]
            shown.append((what["completed"], what["total"]))
            super().update(task, **what)

    monkeypatch.setattr(output, "Progress", Bar)
    with output.progress_bar("search", in_percent=True) as progress:
        for done, total in ((0, 100), (10, 100), (11, 200), (100, 200)):
            progress(done, total)
    assert shown == [(0.0, 100.0), (10.0, 100.0), (10.0, 100.0), (50.0, 100.0)]
