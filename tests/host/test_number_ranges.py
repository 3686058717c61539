"""Every number on the command line has a range: what lies outside is refused before any work."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
import typer

from chladni.drives.solve import solve
from chladni.host.cli.command_line import app
from chladni.host.cli.common.ending import run
from chladni.sim.board.board import Board
from chladni.sim.board.fingers import Focus
from chladni.sim.cost import allow_large_cost
from chladni.sim.errors import InputError
from chladni.tables.build import build_table
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from conftest import ROOT, CommandLine

BOARD = str(ROOT / "tests" / "chain" / "coarse.toml")
NEEDED: dict[str, list[str]] = {
    "field": ["paper", "--target", "0,0", "-o", "f.npz"],
    "solve": ["strip5", "--target", "0,0", "--objective", "focus"],
    "board refit": ["strip5", "-o", "b.toml", "--foam", "1"],
    "table build": [BOARD, "-o", "t.chl"],
    "table show": ["t.chl"],
    "table score": ["t.chl"],
    "design": ["strip", "-o", "b.toml"],
    "modes": ["paper"], "sweep": ["paper"], "compare": ["paper"], "board score": ["paper"],
    "flash": ["t.chl"],
    "device touch": ["0,0"], "device stream": ["1@0"], "device waveform": ["sine"],
    "play": ["click", "--at", "0,0"],
    "device config": ["get"], "device network": ["show"], "device frequency": ["160"],
}  # fmt: skip
"""Of the commands that refuse some numbers only once the rest is right, the rest."""
NONE_LIKE_IT = [math.nan, math.inf, 1e300, -1.0, 1e-300, 10**30, -1]
MAY_BE_TINY = {"lift", "ms", "seconds", "level", "quieter_from_mm", "quieter_db", "silent_from_mm",
               "floor_um", "beside", "minutes"}  # fmt: skip
"""What is next to zero is as good as any other there."""
MAY_BE_NEGATIVE = {"level_db"}
COMMANDS = typer.main.get_command(app)
"""Made once, for `chladni` makes them at every call."""


def commands(group: Any, *path: str) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, *path, name)
        else:
            yield " ".join((*path, name)), command


def numbers() -> Iterator[Any]:
    """Every option and argument that is a number: the command, its name, whether it is whole."""
    for command, parsed in commands(COMMANDS):
        for name, hint in get_type_hints(parsed.callback).items():
            kinds = {kind for one in (hint, *get_args(hint)) for kind in (one, *get_args(one))}
            if kinds & {int, float}:
                parameter = next(one for one in parsed.params if one.name == name)
                yield pytest.param(command, parameter, int in kinds, id=f"{command} {name}")


@pytest.mark.parametrize(("command", "parameter", "is_whole"), [*numbers()])
def test_a_number_out_of_range_is_refused_in_one_line(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    parameter: Any,
    is_whole: bool,
) -> None:
    monkeypatch.chdir(tmp_path)
    name = max(parameter.opts, key=len)
    is_option = name.startswith("-")
    for value in NONE_LIKE_IT:
        if isinstance(value, int) != is_whole:
            continue
        if value == 1e-300 and parameter.name in MAY_BE_TINY:
            continue
        if value == -1.0 and parameter.name in MAY_BE_NEGATIVE:
            continue
        needed = NEEDED.get(command, []) if is_option else []
        given = [f"{name}={value}"] if is_option else ["--", str(value)]
        arguments = [*command.split(), *needed, *given]
        code = run("chladni", lambda: COMMANDS(arguments, prog_name="chladni"))  # noqa: B023
        out, err = capsys.readouterr()
        assert (code, out, err.count("\n")) == (2, "", 1), (value, err)
        assert list(tmp_path.iterdir()) == []


def test_there_are_numbers_to_refuse() -> None:
    names = [one.id for one in numbers()]
    assert {"table score samples", "device touch seconds", "device frequency hertz"} <= set(names)
    assert len(names) > 40


def test_a_survey_of_too_many_places_is_refused_before_it_is_made(chladni: CommandLine) -> None:
    """Each of 100 million places takes a drive of its own."""
    try:
        answer = chladni("board", "score", "prototype", "--pitch", "0.1", "--samples", "100")
    finally:
        allow_large_cost(False)
    assert answer.code == 2
    assert "places takes about" in answer.err
    assert "or go on with --large" in answer.err


def test_a_floor_next_to_nothing_is_no_floor(prototype: Board) -> None:
    first, second = [
        solve(replace(prototype, focus=Focus(floor_um=floor)), (9.0, 20.0), objective="focus").drive
        for floor in (1e-300, 0.0)
    ]
    assert np.array_equal(first, second)


def test_python_is_told_of_frequencies_that_are_none(
    coarse_table: tuple[Table, TableReport], coarse_board: Board
) -> None:
    for value in (math.nan, math.inf):
        with pytest.raises(InputError, match="frequency_hz"):
            coarse_table[0].section(value)
        with pytest.raises(InputError, match="frequencies_hz"):
            build_table(coarse_board, frequencies_hz=[value])
