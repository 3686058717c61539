"""Methods over a board, and work that is cut off and goes on."""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.drives.batch import over_targets
from chladni.drives.checkpoint import Checkpoint, Result
from chladni.drives.methods import METHODS, Found, Options
from chladni.drives.objectives import OBJECTIVES
from chladni.drives.problem.problem import Problem, solved_board
from chladni.drives.scoring.compare import NUMBERS, Row, as_csv, compare, contenders, summary
from chladni.drives.solve import solve
from chladni.sim.board.board import Board
from chladni.tables.build import build_table
from chladni.tables.format import pack
from conftest import made_once

CHEAP = ["phasor", "nearest", "contrast", "gerchberg-saxton"]


@pytest.fixture(scope="module")
def rows(prototype: Board, tmp_path_factory: pytest.TempPathFactory) -> list[Row]:
    def make() -> list[Row]:
        return compare(prototype, pitch=36e-3, methods=CHEAP)[1]

    return made_once(tmp_path_factory, "compared", make)


def test_all_methods_and_objectives_are_compared() -> None:
    pairs = contenders()
    assert {method for method, _ in pairs} == set(METHODS)
    assert [objective for method, objective in pairs if method == "phasor"] == list(OBJECTIVES)


def test_a_row_is_what_solve_and_its_scorecard_say(prototype: Board, rows: list[Row]) -> None:
    row = next(r for r in rows if r.method == "nearest" and r.x_mm > 0 and r.y_mm > 50)
    solution = solve(prototype, (row.x_mm, row.y_mm), method="nearest")
    assert row.numbers["ssim"] == pytest.approx(solution.ssim, abs=1e-9)


def test_phasor_is_best_at_each_of_its_aims(rows: list[Row]) -> None:
    for place in {(row.x_mm, row.y_mm) for row in rows}:
        own = [row for row in rows if (row.x_mm, row.y_mm) == place]
        best = {row.objective: row for row in own if row.method == "phasor"}
        drives = [row for row in own if not np.isnan(row.numbers["contrast_db"])]
        assert best["ssim"].numbers["ssim"] >= max(r.numbers["ssim"] for r in own) - 1e-4
        top = max(r.numbers["contrast_db"] for r in drives)
        assert best["contrast"].numbers["contrast_db"] >= top - 1e-9
        for row in drives:
            assert row.numbers["contrast_db"] <= row.numbers["contrast_limit_db"] + 1e-9


def test_null_models_stand_in_the_same_table(rows: list[Row]) -> None:
    names = {row.method for row in rows}
    assert {"silent", "misplaced", "nearest"} <= names
    entries = {(e["method"], e["objective"]): e for e in summary(rows)}
    assert entries["phasor", "ssim"]["ssim"] > entries["silent", "–"]["ssim"]
    assert entries["silent", "–"]["seconds"] is None
    json.dumps(list(entries.values()), allow_nan=False)


def test_summary_takes_medians(rows: list[Row]) -> None:
    own = [row.numbers["focal_error_mm"] for row in rows if row.method == "nearest"]
    entry = next(e for e in summary(rows) if e["method"] == "nearest")
    assert entry["focal_error_mm"] == np.median(own)
    assert entry["targets"] == len(own)


def test_csv_holds_every_number(rows: list[Row]) -> None:
    table = list(csv.DictReader(io.StringIO(as_csv(rows).decode())))
    assert len(table) == len(rows)
    for line, row in zip(table, rows, strict=True):
        assert line["method"] == row.method
        for name in NUMBERS:
            known = not np.isnan(row.numbers[name])
            assert (line[name] != "") == known
            if known:
                assert float(line[name]) == pytest.approx(row.numbers[name], rel=1e-5, abs=1e-12)


def test_mirrored_targets_score_alike(rows: list[Row]) -> None:
    by_place = {(round(r.x_mm, 6), round(r.y_mm, 6), r.method, r.objective): r for r in rows}
    for (x, y, method, objective), row in by_place.items():
        if method != "phasor" or objective not in ("ssim", "contrast"):
            continue
        image = by_place[-x, -y, method, objective]
        # Two searches of the same hill, from starts that are not mirrored.
        assert image.numbers["ssim"] == pytest.approx(row.numbers["ssim"], abs=2e-3)


# Work that is cut off


class KilledError(Exception):
    """Stands for a kill: nothing tidies up after it."""


def interrupted(work: Callable[[Problem], Result], after: int) -> Callable[[Problem], Result]:
    calls = 0

    def run(problem: Problem) -> Result:
        nonlocal calls
        calls += 1
        if calls > after:
            raise KilledError
        return work(problem)

    return run


def number_of(problem: Problem) -> Result:
    return {"value": float(np.abs(problem.wanted).sum())}


def test_finished_targets_are_not_done_again(prototype: Board, tmp_path: Path) -> None:
    solved, kept = solved_board(prototype), tmp_path / "out.partial"
    targets = [(float(x), 3.0) for x in range(-9, 10)]
    straight = list(over_targets(solved, targets, number_of, jobs=1))
    with pytest.raises(KilledError), Checkpoint(kept, {"of": "this"}) as checkpoint:
        list(
            over_targets(solved, targets, interrupted(number_of, 7), jobs=1, checkpoint=checkpoint)
        )
    done = len(kept.read_text(encoding="utf-8").splitlines()) - 1
    assert 0 < done <= 7
    # A line torn by the kill is dropped.
    kept.write_bytes(kept.read_bytes() + b'{"name": "3.0,')
    left = interrupted(number_of, len(targets) - done)
    with Checkpoint(kept, {"of": "this"}) as checkpoint:
        assert list(over_targets(solved, targets, left, jobs=1, checkpoint=checkpoint)) == straight


def killed_after_one(kept: Path) -> None:
    with contextlib.suppress(KilledError), Checkpoint(kept, {"seed": 1}) as checkpoint:
        checkpoint.put("a", {"value": 1.5})
        raise KilledError


def test_what_was_kept_of_other_work_is_not_used(tmp_path: Path) -> None:
    kept = tmp_path / "out.partial"
    killed_after_one(kept)
    with Checkpoint(kept, {"seed": 1}) as checkpoint:
        assert checkpoint.get("a") == {"value": 1.5}
    killed_after_one(kept)
    with Checkpoint(kept, {"seed": 2}) as checkpoint:
        assert checkpoint.get("a") is None


@pytest.mark.slow
def test_a_build_cut_off_gives_the_same_bytes(coarse_board: Board, tmp_path: Path) -> None:
    kept = tmp_path / "t.partial"
    whole = pack(build_table(coarse_board, jobs=1)[0])

    def kill(done: int, _: int) -> None:
        if done == 3:
            raise KilledError

    with pytest.raises(KilledError):
        build_table(coarse_board, progress=kill, partial=kept)
    assert kept.exists()
    assert pack(build_table(coarse_board, partial=kept)[0]) == whole
    # It is still to be written.
    assert kept.exists()


def test_a_table_of_a_board_that_was_edited_meanwhile_is_its_own(
    prototype: Board, tmp_path: Path
) -> None:
    """Of its own image points, which decide the drives."""
    kept = tmp_path / "t.partial"
    few = dataclasses.replace(prototype, regions=dataclasses.replace(prototype.regions, pitch=6e-2))
    few = dataclasses.replace(few, image=dataclasses.replace(few.image, points=(21, 41)))
    edited = dataclasses.replace(few, image=dataclasses.replace(few.image, points=(11, 21)))

    def kill(_: int, __: int) -> None:
        raise KilledError

    with pytest.raises(KilledError):
        build_table(few, progress=kill, partial=kept)
    assert b'"result"' in kept.read_bytes()
    whole = pack(build_table(edited)[0])
    assert pack(build_table(edited, partial=kept)[0]) == whole


def test_of_two_frequencies_the_first_is_not_solved_again(
    prototype: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "t.partial"
    few = dataclasses.replace(prototype, regions=dataclasses.replace(prototype.regions, pitch=6e-2))
    solved: list[float] = []
    own = OBJECTIVES["contrast"]

    def killed_at_the_second(problem: Problem, options: Options) -> Found:
        solved.append(problem.board.drive.frequency_hz)
        if solved[-1] == 200.0:
            raise KilledError
        return own(problem, options)

    monkeypatch.setitem(OBJECTIVES, "contrast", killed_at_the_second)
    for _ in range(2):
        with pytest.raises(KilledError):
            build_table(
                few, objective="contrast", frequencies_hz=(160.0, 200.0), jobs=1, partial=kept
            )
    assert solved == [160.0, 200.0, 200.0]


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_a_table_of_each_objective(coarse_board: Board, objective: str) -> None:
    few = dataclasses.replace(
        coarse_board, regions=dataclasses.replace(coarse_board.regions, pitch=36e-3)
    )
    table, report = build_table(few, objective=objective)
    assert report.regions == table.grid.count == 8
    assert report.ssim_loss_max < 5e-3
    exact = np.abs(solve(few, table.grid.centre_mm(0), objective=objective).field)
    fields = solved_board(few).fields.values
    stored = np.abs(np.tensordot(table.drives(table.section())[0], fields, axes=1))
    assert np.abs(stored - exact).max() < 0.03 * exact.max()  # 0.25 dB


def test_a_comparison_cut_off_has_the_same_rows(prototype: Board, tmp_path: Path) -> None:
    """Null models have no number but one; what is absent comes back as absent."""
    kept = tmp_path / "c.csv.partial"
    options: dict[str, Any] = {"pitch": 60e-3, "methods": ["nearest"], "jobs": 1}

    def kill(done: int, _: int) -> None:
        if done == 2:
            raise KilledError

    with pytest.raises(KilledError):
        compare(prototype, **options, kept=kept, progress=kill)
    assert len(kept.read_bytes().splitlines()) == 3
    rows = compare(prototype, **options, kept=kept)[1]
    assert any(np.isnan(row.numbers["finger_um"]) for row in rows)
    timeless = [dataclasses.replace(row, numbers={**row.numbers, "seconds": 0.0}) for row in rows]
    straight = [
        dataclasses.replace(row, numbers={**row.numbers, "seconds": 0.0})
        for row in compare(prototype, **options)[1]
    ]
    assert repr(timeless) == repr(straight)
    # Of a board that was edited since, nothing is taken over: half the volts are half the way.
    weaker = dataclasses.replace(prototype.electronics, supply_v=prototype.electronics.supply_v / 2)
    edited = compare(dataclasses.replace(prototype, electronics=weaker), **options, kept=kept)[1]
    for one, other in zip(rows, edited, strict=True):
        if one.method == "nearest":
            assert other.numbers["full_volts"] < 0.9 * one.numbers["full_volts"]
