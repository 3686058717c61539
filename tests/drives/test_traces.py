"""Traces of annealings: what is in one is checked before anything goes on from it."""

from __future__ import annotations

import contextlib
import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.drives.methods.anneal import MOST_STEPS, anneal, read_trace
from chladni.drives.methods.base import Options
from chladni.drives.problem.problem import Problem, solved_board
from chladni.sim.board.board import Board
from chladni.sim.board.parts import Image
from chladni.sim.errors import InputError
from chladni.sim.files import read_arrays, write_arrays


@pytest.fixture(scope="module")
def problem(prototype: Board) -> Problem:
    return solved_board(prototype).problem((10.0, 25.0))


def trace_of(problem: Problem, path: Path) -> dict[str, Any]:
    anneal(problem, Options(steps=3, trace=path))
    return dict(read_arrays(path, "--trace", 10**6))


BAD_TRACES: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "NaN": lambda a: {"state": a["state"] * float("nan")},
    "an infinite SSIM": lambda a: {"ssim": a["ssim"] + float("inf")},
    "a NaN best": lambda a: {"best_ssim": a["best_ssim"] * float("nan")},
    "another shape": lambda a: {"state": a["state"][:, :5]},
    "fewer actuators": lambda a: {"state": a["state"][:2], "best_drive": a["best_drive"][:2]},
    "no steps": lambda a: {"ssim": a["ssim"][:0]},
    "words": lambda a: {"ssim": a["ssim"].astype(str)},
    "gains beyond": lambda a: {"state": a["state"] * 1e300},
    "single precision": lambda a: {"state": a["state"].astype("f4")},
    "no state": lambda a: {"state": None},
    "a generator that stands still": lambda a: {"about": _still(str(a["about"]))},
    "another generator": lambda a: {"about": str(a["about"]).replace("PCG64", "MT19937")},
    "no object": lambda a: {"about": "[]"},
    "no key": lambda a: {"about": str(a["about"]).replace('"key"', '"kay"')},
    "deep": lambda a: {"about": "[" * 100_000},
}


def _still(about: str) -> str:
    """PCG64 with an even increment may repeat one number, and a draw waits for another."""
    document = json.loads(about)
    document["rng"]["state"] |= {"state": 0, "inc": 0}
    return json.dumps(document)


@pytest.mark.parametrize("case", BAD_TRACES)
def test_a_trace_that_no_annealing_wrote_is_refused(
    problem: Problem, tmp_path: Path, case: str
) -> None:
    path = tmp_path / "t.npz"
    arrays = trace_of(problem, path)
    arrays |= BAD_TRACES[case](arrays)
    write_arrays(path, **{name: array for name, array in arrays.items() if array is not None})
    before = path.read_bytes()
    with pytest.raises(InputError, match="trace"):
        anneal(problem, Options(steps=5, trace=path))
    assert path.read_bytes() == before


def test_a_trace_of_a_board_that_was_edited_since_is_left_as_it_is(
    problem: Problem, tmp_path: Path
) -> None:
    """Its image points, by which an annealing compares."""
    path = tmp_path / "t.npz"
    trace_of(problem, path)
    before = path.read_bytes()
    board = dataclasses.replace(problem.board, image=Image((21, 41)))
    with pytest.raises(InputError, match=r"a trace of method anneal, board .*; it is one of"):
        anneal(solved_board(board).problem((10.0, 25.0)), Options(steps=5, trace=path))
    assert path.read_bytes() == before


def test_a_trace_is_neither_read_nor_written_through_a_link(
    problem: Problem, tmp_path: Path
) -> None:
    path, link = tmp_path / "t.npz", tmp_path / "link.npz"
    trace_of(problem, path)
    before = path.read_bytes()
    for target in (path, tmp_path / "none"):
        link.symlink_to(target)
        with pytest.raises(InputError, match="a link"):
            anneal(problem, Options(steps=5, trace=link))
        link.unlink()
    assert path.read_bytes() == before
    assert [own.name for own in tmp_path.iterdir()] == ["t.npz"]


def test_more_steps_than_a_trace_holds_are_refused_before_the_first(
    problem: Problem, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="at most 10,000,000 with a trace"):
        anneal(problem, Options(steps=MOST_STEPS + 1, trace=tmp_path / "t.npz"))


@settings(max_examples=100, deadline=None)
@given(begin=st.integers(0, 3000), cut=st.integers(0, 20), put=st.binary(max_size=8))
def test_any_change_of_a_traces_bytes_gives_the_same_chain_or_words(
    prototype: Board, tmp_path_factory: pytest.TempPathFactory, begin: int, cut: int, put: bytes
) -> None:
    path = tmp_path_factory.mktemp("trace") / "t.npz"
    anneal(solved_board(prototype).problem((10.0, 25.0)), Options(steps=1, trace=path))
    good = read_trace(path)
    data = path.read_bytes()
    path.write_bytes(data[:begin] + put + data[begin + cut :])
    with contextlib.suppress(InputError):
        chain, key = read_trace(path)
        assert (chain.ssim, key) == (good[0].ssim, good[1])
