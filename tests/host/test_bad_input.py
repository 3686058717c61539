"""Wrong input on the command line: named, exit code 2, no traceback, nothing written."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.drives.problem.region_grid import region_grid
from chladni.sim.board.board import Board
from chladni.tables import layout
from chladni.tables.format import pack
from chladni.tables.mirror_symmetry import NO_MIRRORS
from chladni.tables.table import Table
from conftest import ROOT, CommandLine
from made_up import LIMITS, make_section, with_crc


def board_file(folder: Path, old: str, new: str) -> Path:
    text = (ROOT / "boards" / "prototype.toml").read_text(encoding="utf-8")
    assert old in text
    path = folder / "bad.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


BAD_BOARDS = [
    ("at_mm = [24.25, 43.35]", "at_mm = [124.25, 43.35]", "actuators[1].at_mm"),
    ("at_mm = [24.25, 43.35]", "at_mm = [0.0, 0.0]", "actuators[1].at_mm"),
    ("thickness_mm = 1.0", "", "plate.thickness_mm"),
    ("thickness_mm = 1.0", "thicknes_mm = 1.0", "plate.thicknes_mm"),
    ("thickness_mm = 1.0", "thickness_mm = -1.0", "plate.thickness_mm"),
    ("frequency_hz = 160.0", "frequency_hz = 0", "drive.frequency_hz"),
]


@pytest.mark.parametrize(("old", "new", "field"), BAD_BOARDS)
@pytest.mark.parametrize("command", ["show", "solve", "field", "build"])
def test_bad_boards(
    chladni: CommandLine, tmp_path: Path, old: str, new: str, field: str, command: str
) -> None:
    path, out = board_file(tmp_path, old, new), tmp_path / "out"
    arguments = {
        "show": ["board", "show", path],
        "solve": ["solve", path, "--target", "0,0"],
        "field": ["field", path, "--target", "0,0", "-o", out],
        "build": ["table", "build", path, "-o", out],
    }[command]
    answer = chladni(*arguments, "--json")
    assert answer.code == 2
    assert answer.out == ""
    assert f"bad.toml, {field}" in answer.err
    assert not out.exists()


@pytest.fixture
def table(prototype: Board) -> Table:
    """A table of the prototype with made-up drives."""
    grid = region_grid(prototype)
    rng = np.random.default_rng(1)
    drives = rng.uniform(-5, 5, (grid.count, 5)) + 1j * rng.uniform(-5, 5, (grid.count, 5))
    return Table(
        "prototype", prototype.fingerprint(), grid, LIMITS, (make_section(drives),), NO_MIRRORS
    )


def damaged(good: bytes, how: str) -> bytes:
    data = bytearray(good)
    if how == "magic":
        data[0:4] = b"JUNK"
    elif how == "version":
        data[layout.offsets(layout.HEADER_FIELDS)["version_major"]] = 9
    elif how == "crc":
        data[-1] ^= 0xFF
        return bytes(data)
    elif how == "size":
        return bytes(data[:50])
    elif how == "total_bytes":
        return bytes(data[:-20])
    return with_crc(data)


@pytest.mark.parametrize("how", ["magic", "version", "crc", "size", "total_bytes"])
@pytest.mark.parametrize("command", ["show", "emulate"])
def test_bad_tables(
    chladni: CommandLine, tmp_path: Path, table: Table, how: str, command: str
) -> None:
    path, out = tmp_path / "bad.chl", tmp_path / "r.npz"
    path.write_bytes(damaged(pack(table), how))
    arguments = {
        "show": ["table", "show", path],
        "emulate": ["emulate", path, "--touch", "0,0@5", "--ms", "200", "-o", out],
    }[command]
    answer = chladni(*arguments, "--json")
    assert answer.code == 2
    assert answer.out == ""
    assert f"bad.chl, {how}: expected" in answer.err
    assert not out.exists()


def test_a_table_for_another_actuator_count(
    chladni: CommandLine, tmp_path: Path, table: Table
) -> None:
    path, out = tmp_path / "three.chl", tmp_path / "r.npz"
    section = table.section()
    fewer = replace(table, sections=(replace(section, iq=section.iq[:, :3]),))
    path.write_bytes(pack(fewer))
    answer = chladni("emulate", path, "--touch", "0,0@5", "--ms", "200", "-o", out)
    assert answer.code == 2
    assert "three.chl, actuators: expected 5" in answer.err
    assert not out.exists()


def test_a_table_for_another_board(chladni: CommandLine, tmp_path: Path, table: Table) -> None:
    path, out = tmp_path / "t.chl", tmp_path / "r.npz"
    path.write_bytes(pack(table))
    answer = chladni(
        "emulate", path, "--board", "paper", "--touch", "0,0@5", "--ms", "200", "-o", out
    )
    assert answer.code == 2
    assert "board_fingerprint" in answer.err
    unknown = replace(table, board_name="unknown")
    path.write_bytes(pack(unknown))
    answer = chladni("emulate", path, "--touch", "0,0@5", "--ms", "200", "-o", out)
    assert answer.code == 2
    assert "--board" in answer.err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["solve", "prototype", "--target", "40,0"], "target"),
        (["table", "build", "prototype", "-o", "t.chl", "--bits", "9"], "one of 8, 12, 16"),
        (["--json"], "COMMAND"),
        (["table", "build", "prototype", "-o", "t.chl", "--budget-bytes", "900"], "--budget-bytes"),
        (["solve", "prototype", "--target", "ten,0"], "--target"),
        (["solve", "prototype", "--target", "1,2,3"], "--target"),
        (["solve", "prototype", "--target", "nan,0"], "--target"),
        (["solve", "prototype", "--target", "0,0", "--method", "magic"], "phasor, anneal"),
        (["solve", "prototype", "--target", "0,0", "--seed", "x"], "--seed"),
        (["solve", "nowhere", "--target", "0,0"], "paper, phone15, phone5, phone8, prototype"),
        (["board", "show", "no/such.toml"], "paper, phone15, phone5, phone8, prototype"),
        (
            ["field", "paper", "--target", "0,0", "--actuator", "centre", "-o", "f.npz"],
            "--target does not go with --actuator",
        ),
        (["field", "paper", "-o", "f.npz"], "one of --target, --actuator and --drive is required"),
        (["field", "paper", "--actuator", "middle", "-o", "f.npz"], "centre, top-right"),
        (["field", "paper", "--target", "99,0", "-o", "f.npz"], "target"),
        (["field", "paper", "--target", "0,0", "-o", "missing/f.npz"], "-o"),
        (["field", "paper", "--drive", "none.json", "-o", "f.npz"], "--drive"),
        (["solve", "paper", "--target", "0,0", "--seed", "-1"], "seed"),
        (["table", "show", "/dev/zero"], "regular file"),
        (["field", "paper", "--target", "0,0", "-o", "/dev/null"], "-o"),
        (["table", "build", "paper", "-o", "missing/t.chl"], "-o"),
        (["table", "build", "paper", "-o", "t.chl", "--jobs", "0"], "--jobs"),
        (["table", "show", "none.chl"], "none.chl"),
        (["emulate", "none.chl", "--touch", "0,0@5", "--ms", "9", "-o", "r.npz"], "none.chl"),
        (["nonsense"], "nonsense"),
        (["table", "verify", "none.chl"], "none.chl"),
        (["table", "diff", "none.chl", "none.chl"], "none.chl"),
        (["table", "export", "none.chl", "--csv", "no/x.csv"], "--csv"),
        (["solve", "paper", "--target", "0,0", "--objective", "magic"], "balanced, focus"),
        (
            ["solve", "paper", "--target", "0,0", "--method", "nearest", "--objective", "focus"],
            "objective",
        ),
        (["solve", "paper", "--target", "0,0", "--steps", "0"], "steps"),
        (["solve", "paper", "--target", "0,0", "--floor-um", "3"], "--objective focus"),
        (
            ["solve", "paper", "--target", "0,0", "--objective", "focus", "--quieter-db", "-3"],
            "focus.quieter_db",
        ),
        (
            ["solve", "paper", "--target", "0,0", "--objective", "focus", "--silent-from-mm", "9"],
            "focus.quieter_from_mm",
        ),
        (["solve", "paper", "--target", "0,0", "--trace", "t.npz"], "anneal"),
        (["solve", "paper", "--target", "0,0", "--figure", "f.gif"], "--figure"),
        (
            ["solve", "paper", "--target", "0,0", "--method", "anneal", "--trace", "no/t.npz"],
            "--trace",
        ),
        (["compare", "nowhere"], "paper, phone15, phone5, phone8, prototype"),
        (["compare", "paper", "--methods", "phasor,magic"], "least-squares"),
        (["compare", "paper", "--pitch", "0"], "--pitch"),
        (["compare", "paper", "--pitch", "nan"], "--pitch"),
        (["compare", "paper", "--jobs", "0"], "--jobs"),
        (["compare", "paper", "--figure", "f.gif"], ".png"),
        (["compare", "paper", "-o", "no/c.csv"], "-o"),
        (["table", "build", "paper", "-o", "t.chl", "--objective", "magic"], "ssim, contrast"),
    ],
)
def test_bad_arguments(
    chladni: CommandLine,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    named: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    answer = chladni(*arguments)
    assert answer.code == 2
    assert answer.out == ""
    assert named in answer.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--touch", "0,0", "--ms", "200"], "X,Y@MS"),
        (["--touch", "0,0@x", "--ms", "200"], "X,Y@MS"),
        (["--touch", "50,0@5", "--ms", "200"], "--touch: expected a place"),
        (["--touch", "0,0@500", "--ms", "200"], "--touch"),
        (["--touch", "0,0@5", "--ms", "13"], "--touch, --ms"),
        (["--touch", "0,0@5", "--touch", "9,9@50", "--lift", "50", "--ms", "200"], "--touch, --ms"),
        (["--touch", "0,0@5", "--touch", "9,9@5", "--ms", "200"], "one finger goes from place"),
        (["--touch", "0,0@5", "--ms", "-1"], "--ms"),
        (["--touch", "0,0@5", "--ms", "200", "--lift", "900"], "--lift"),
        (["--touch", "0,0@5", "--ms", "200", "--level", "2"], "--level"),
    ],
)
def test_bad_scenarios(
    chladni: CommandLine, tmp_path: Path, table: Table, options: list[str], named: str
) -> None:
    path, out = tmp_path / "t.chl", tmp_path / "r.npz"
    path.write_bytes(pack(table))
    answer = chladni("emulate", path, *options, "-o", out)
    assert answer.code == 2
    assert named in answer.err
    assert not out.exists()


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "{}",
        "not json",
        '{"drive": [1, 2, 3, 4, 5]}',
        '{"drive": [{"actuator": "x", "gain": 1, "phase_deg": 0}]}',
        json.dumps({"drive": 5 * [{"actuator": "centre", "gain": 1.0, "phase_deg": 0.0}]}),
        json.dumps({"drive": 5 * [{"actuator": "centre", "gain": 10**400, "phase_deg": 0.0}]}),
        "[" * 100_000,
    ],
)
def test_bad_drive_files(chladni: CommandLine, tmp_path: Path, text: str) -> None:
    path, out = tmp_path / "d.json", tmp_path / "f.npz"
    path.write_text(text, encoding="utf-8")
    answer = chladni("field", "paper", "--drive", path, "-o", out)
    assert answer.code == 2
    assert "d.json, " in answer.err
    assert not out.exists()


def test_boards_that_no_table_can_hold_are_refused_before_solving(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """Solving three times 42,000 regions first would take an hour."""
    out = tmp_path / "t.chl"
    three = [word for hz in (100, 120, 160) for word in ("--frequency", hz)]
    for old, new, named in (
        ("pitch_mm = 5.0", "pitch_mm = 0.5", "table.bytes"),
        ("max_gain = 10.0", "max_gain = 0.0014", "drive.max_gain"),
        ("frequency_hz = 160.0", "frequency_hz = 1500.0", "table.frequency_millihertz"),
    ):
        options = three if named == "table.bytes" else []
        answer = chladni("table", "build", board_file(tmp_path, old, new), "-o", out, *options)
        assert answer.code == 2
        assert named in answer.err
        assert not out.exists()


def test_names_that_look_like_markup_are_shown_as_they_are(
    chladni: CommandLine, tmp_path: Path
) -> None:
    path = board_file(tmp_path, 'name = "centre"', 'name = "[/b]"')
    answer = chladni("board", "show", path)
    assert answer.code == 0
    assert "[/b]" in answer.out


def test_the_installed_command_shows_no_traceback(tmp_path: Path) -> None:
    """Once as a real process, as a user meets it."""
    path = board_file(tmp_path, "thickness_mm = 1.0", "thickness_mm = -1.0")
    answer = subprocess.run(
        [sys.executable, "-m", "chladni.host.cli.app", "board", "show", str(path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 2
    assert answer.stdout == ""
    assert "Traceback" not in answer.stderr
    assert "plate.thickness_mm: expected a number from 0.01 to 100, got -1.0" in answer.stderr
