"""An error names what was given: arguments to Python, options to a command line."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from chladni.drives import solve
from chladni.drives.scoring.board_score import score_board
from chladni.drives.scoring.compare import compare
from chladni.host import TouchEvent, UdpPort, read_key, run_loop
from chladni.sim import InputError, load_board, target_field
from chladni.sim.board.board import Board
from chladni.sim.errors import ArgumentError, MissingArgumentError, TooLargeError
from chladni.tables import build_table
from chladni.tables.table import Table
from conftest import ROOT, CommandLine

GIVEN: list[tuple[str, Callable[[Board], object]]] = [
    ("target_mm", lambda board: solve(board, (999.0, 0.0))),
    ("target_mm", lambda board: target_field(board, (999.0, 0.0))),
    ("method", lambda board: solve(board, (0.0, 0.0), method="x")),
    ("objective", lambda board: solve(board, (0.0, 0.0), objective="x")),
    ("objective", lambda board: build_table(board, objective="x")),
    ("bits", lambda board: build_table(board, bits=9)),
    ("seed", lambda board: build_table(board, seed=-1)),
    ("pitch", lambda board: score_board(board, pitch=-1.0)),
    (
        "scheduler",
        lambda board: compare(
            board, pitch=70e-3, methods=["nearest"], scheduler="tcp://127.0.0.1:1"
        ),
    ),
    ("board", lambda board: load_board("nowhere")),
    ("address", lambda board: UdpPort(":::")),
    ("key", lambda board: read_key(Path("nowhere"))),
]


@pytest.mark.parametrize("number", range(len(GIVEN)))
def test_python_is_told_of_arguments(
    prototype: Board, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    monkeypatch.setattr("chladni.drives.workers.SCHEDULER_S", 0.5)
    name, call = GIVEN[number]
    with pytest.raises(InputError) as caught:
        call(prototype)
    assert caught.value.field == name
    assert "--" not in str(caught.value)


@pytest.mark.parametrize(
    ("events", "milliseconds", "name"),
    [
        ([], 200.0, "touches"),
        ([TouchEvent(20.0, (0.0, 0.0)), TouchEvent(30.0, (50.0, 0.0))], 200.0, "touches[1]"),
        ([TouchEvent(20.0, (0.0, 0.0)), TouchEvent(300.0, None)], 200.0, "touches[1]"),
        ([TouchEvent(20.0, (0.0, 0.0))], -1.0, "milliseconds"),
        ([TouchEvent(20.0, (0.0, 0.0))], 23.0, "touches, milliseconds"),
    ],
)
def test_a_loop_is_told_of_arguments(
    coarse_board: Board,
    coarse_table: tuple[Table, object],
    events: list[TouchEvent],
    milliseconds: float,
    name: str,
) -> None:
    with pytest.raises(InputError) as caught:
        run_loop(coarse_table[0], coarse_board, events, milliseconds)
    assert caught.value.field == name


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["solve", "paper", "--target", "999,0"], "--target: "),
        (["solve", "paper", "--target", "0,0", "--method", "x"], "--method: "),
        (["solve", "paper", "--target", "0,0", "--objective", "x"], "--objective: "),
        (["solve", "paper", "--target", "0,0", "--seed", "-1"], "--seed: "),
        (["solve", "nowhere", "--target", "0,0"], "BOARD: "),
        (["field", "paper", "--target", "99,0", "-o", "f.npz"], "--target: "),
        (["table", "build", "paper", "-o", "t.chl", "--objective", "x"], "--objective: "),
        (["table", "build", "paper", "-o", "t.chl", "--bits", "9"], "--bits: "),
        (["table", "show", "none.chl"], "none.chl, TABLE: "),
        (["board", "score", "paper", "--pitch", "-1"], "--pitch: "),
        (["board", "show", "nowhere"], "BOARD: "),
        (["device", "info", "--emulator", "--board", "nowhere"], "--board: "),
        (["device", "info", "--emulator", "--table", "none.chl"], "none.chl, --table: "),
        (["device", "info", "--udp", ":::", "--key", "none"], "--udp: "),
        (["device", "stream", "2@0", "--emulator"], "DRIVE: "),
        (["device", "config", "set", "link_baud=1", "--emulator"], "link_baud: "),
    ],
)
def test_a_command_line_is_told_of_options(
    chladni: CommandLine,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    named: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    answer = chladni(*arguments)
    assert answer.code == 2
    assert answer.err.startswith(f"chladni: {named}")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["board", "score", "paper", "--pitch", "5 mm"],
         "--pitch: expected a number, got '5 mm'; without 'mm': -h says what it is in"),
        (["table", "build", "paper", "-o", "t.chl", "--frequency", "160Hz"],
         "--frequency: expected a number, got '160Hz'; without 'Hz': -h says what it is in"),
        (["board", "score", "paper", "--samples", "1.5"],
         "--samples: expected a whole number, got '1.5'"),
        (["modes", "paper", "--count", "x"], "--count: expected a whole number, got 'x'"),
    ],
)  # fmt: skip
def test_what_is_no_number_is_told_like_other_errors(
    chladni: CommandLine, arguments: list[str], told: str
) -> None:
    answer = chladni(*arguments)
    assert (answer.code, answer.err) == (2, f"chladni: {told}\n")


@pytest.mark.parametrize(
    ("arguments", "near"),
    [
        (["effects", "show", "clik"], "click"),
        (["effects", "build", "calcuator", "-o", "c.che"], "calculator"),
        (["play", "--bank", "calcuator", "--at", "0,0", "--emulator"], "calculator"),
        (["solve", "paper", "--target", "0,0", "--method", "phasr"], "phasor"),
        (["board", "show", "phon5"], "phone5"),
        (["device", "config", "set", "lvel=0.5", "--port", "none"], "level"),
    ],
)
def test_a_name_that_is_nearly_one_is_suggested(
    chladni: CommandLine, arguments: list[str], near: str
) -> None:
    answer = chladni(*arguments)
    assert answer.code == 2
    assert answer.err.endswith(f"; {near}, perhaps\n")


def test_a_frequency_that_a_table_has_not(chladni: CommandLine, table_file: Path) -> None:
    answer = chladni("table", "show", table_file, "--frequency", "100")
    assert answer.err.startswith("chladni: --frequency: expected one of the table's: 160 Hz")


def test_names_are_changed_one_by_one_and_once() -> None:
    options = {"touches": "--touch", "milliseconds": "--ms", "large": "--large"}
    error = ArgumentError("touches[3], milliseconds, touches, other", 1, "another")
    error.on_command_line(options)
    assert str(error) == "--touch, --ms, other: expected another, got 1"
    missing = MissingArgumentError("touches", "a place")
    missing.on_command_line(options)
    assert str(missing) == "--touch is required: a place"
    large = TooLargeError("work", 3e9, 2e9, "points")
    assert str(large).endswith("lower points, or go on with allow_large_cost(True)")
    large.on_command_line(options)
    assert str(large).endswith("lower points, or go on with --large")
    # A key of a file stays what it is, whatever options are called.
    key = InputError("touches", 1, "another", file="f.toml")
    key.on_command_line(options)
    assert str(key) == "f.toml, touches: expected another, got 1"


def test_no_error_below_the_command_line_names_an_option() -> None:
    """But for what the studio's own server says, which only `chladni studio` starts."""
    found = []
    for package in ("sim", "tables", "host"):
        for path in (ROOT / package / "chladni").rglob("*.py"):
            if "cli" not in path.parts and "studio" not in path.parts:
                calls = re.findall(r'Error\(\s*f?"--', path.read_text(encoding="utf-8"))
                found += [path.name] * len(calls)
    assert found == []
