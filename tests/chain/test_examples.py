"""Every example runs as its page says, makes its figure, and stays short."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic

import matplotlib.pyplot as plt
import numpy as np
import pytest

from chladni.sim import load_board
from chladni.tables import pack, read_table
from conftest import ROOT, Answer, shipped_board, shipped_table

EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.py"))
MOST_LINES = 40
LEAST_COLOURS = 20


Run = Callable[..., Answer]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run an example as a script, in this process, which has loaded all modules already."""

    def run_script(name: str, *arguments: object) -> Answer:
        path, code = str(ROOT / "examples" / f"{name}.py"), 0
        monkeypatch.setattr(sys, "argv", [path, *map(str, arguments)])
        try:
            runpy.run_path(path, run_name="__main__")
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
        said = capsys.readouterr()
        return Answer(code, said.out, said.err)

    return run_script


def of_field(said: str, folder: Path) -> None:
    del folder
    assert re.search(r"prototype at 160 Hz: 20\.\d µm per newton", said)


def of_table(said: str, folder: Path) -> None:
    table = read_table(folder / "strip5.chl")
    assert table.board_fingerprint == shipped_board("strip5").fingerprint()
    second = re.search(r"second finger 20 mm away: (\S+) dB below", said)
    assert second is not None
    assert float(second[1]) > 15.0


def of_swipe(said: str, folder: Path) -> None:
    del folder
    rows = re.findall(r"(\d+) ms  second finger +\+(\S+) dB", said)
    assert [int(at) for at, _ in rows] == list(range(20, 421, 50))


def of_design(said: str, folder: Path) -> None:
    board = load_board(folder / "mine.toml")
    assert board.name == "mine"
    assert 2 <= len(board.actuators) <= 3
    assert "boards; the best has coils at y = " in said


CHECKS: dict[str, Callable[[str, Path], None]] = {
    "field": of_field,
    "table": of_table,
    "swipe": of_swipe,
    "design": of_design,
}


def check_figure(path: Path) -> None:
    """A picture of its own size that is not blank."""
    picture = plt.imread(path)
    assert min(picture.shape[:2]) > 300
    assert len(np.unique(picture[::3, ::3, :3].reshape(-1, 3), axis=0)) > LEAST_COLOURS


@pytest.mark.slow
@pytest.mark.parametrize("name", CHECKS)
def test_an_example_runs_and_draws(name: str, run: Run, tmp_path: Path) -> None:
    done = run(name, tmp_path / "new")
    assert (done.code, done.err) == (0, "")
    CHECKS[name](done.out, tmp_path / "new")
    check_figure(tmp_path / "new" / f"example-{name}.png")


@contextmanager
def emulated(table: Path) -> Iterator[str]:
    """A port of an emulated device, in a process of its own."""
    command = [sys.executable, "-m", "chladni.host.cli.app", "emulate", str(table), "--serial"]
    process = subprocess.Popen([*command, "--ms", "600000"], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process.stdout.readline().strip()
    finally:
        process.terminate()
        process.wait()


@pytest.mark.slow
def test_the_device_on_a_port_plays(
    run: Run, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    table = tmp_path / "t.chl"
    table.write_bytes(pack(shipped_table(tmp_path_factory, "strip5")[0]))
    with emulated(table) as port:
        begun = monotonic()
        done = run("device", port, tmp_path)
    assert done.code == 0, done.err
    assert "verified=True" in done.out
    found = re.search(r"playing; played (\S+) s", done.out)
    assert found is not None
    assert 0.95 < float(found[1]) < monotonic() - begun
    check_figure(tmp_path / "example-device.png")


@pytest.mark.slow
def test_a_device_of_another_board_is_left_alone(run: Run, port: str, tmp_path: Path) -> None:
    """The emulated prototype has five channels, as `strip5` has."""
    done = run("device", port, tmp_path)
    assert done.code == 2
    assert "a table for prototype" in done.err


def test_a_port_that_is_not_there_is_said(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # where no other folder is named, `out` is made
    for arguments, words in (
        ((), "no port given: no such port"),
        (("nowhere",), "nowhere: no such port"),
    ):
        done = run("device", *arguments)
        assert done.code == 2
        assert words in done.err


def test_the_page_shows_every_example_and_they_are_short() -> None:
    page = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    assert sorted([*CHECKS, "device"]) == EXAMPLES
    for name in EXAMPLES:
        text = (ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8")
        assert text.count("\n") <= MOST_LINES
        assert f"```python\n{text}```" in page
        assert f"](images/example-{name}.png)" in page
        assert (ROOT / "docs" / "images" / f"example-{name}.png").is_file()
