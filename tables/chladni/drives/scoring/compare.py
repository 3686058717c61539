"""Every method on a grid of targets, each with the whole scorecard."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from chladni.drives.batch import Target, on_workers, over_targets
from chladni.drives.checkpoint import Checkpoint, Result
from chladni.drives.methods import METHODS, SEED, Options, Progress
from chladni.drives.objectives import OBJECTIVES, default_objective
from chladni.drives.problem.problem import Problem, solved_board
from chladni.drives.problem.region_grid import RegionGrid, region_grid
from chladni.drives.scoring.felt import disagreement, remark
from chladni.drives.scoring.scorecard import NullModels, null_models, score_on
from chladni.drives.solve import solve_problem
from chladni.drives.workers import Workers
from chladni.sim.board.board import Board, to_document
from chladni.sim.board.parts import Regions
from chladni.sim.errors import check_estimate
from chladni.sim.fields.transfer import TOLERANCE

NUMBERS = (
    "ssim", "focal_error_mm", "centroid_error_mm", "contrast_db", "contrast_limit_db",
    "second_finger_db", "louder_fraction", "spot_mm2", "finger_um", "full_volts", "sensation_db",
    "evaluations", "seconds",
)  # fmt: skip
"""What a row holds beside its place and its method."""
NULLS = ("silent", "misplaced")
"""Null models that are no drive: they have an SSIM and nothing else. The third one, the nearest
actuator, is a method."""


@dataclass(frozen=True)
class Row:
    """One method on one target; a null model has NaN where it has no number."""

    x_mm: float
    y_mm: float
    method: str
    objective: str
    numbers: dict[str, float]


def contenders(methods: Sequence[str] | None = None, own: str = "ssim") -> list[tuple[str, str]]:
    """(method, objective) of all that is compared; `phasor` once per objective, `own` first."""
    objectives = sorted(OBJECTIVES, key=lambda objective: objective != own)
    return [
        (method, objective)
        for method in methods or METHODS
        for objective in (objectives if method == "phasor" else ("ssim",))
    ]


def compare(
    board: Board,
    *,
    pitch: float,
    methods: Sequence[str] | None = None,
    seed: int = SEED,
    steps: int | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
    kept: Path | None = None,
    scheduler: str | None = None,
    allow_unmet: bool = False,
) -> tuple[RegionGrid, list[Row]]:
    """Score methods on targets all over a board.

    Parameters
    ----------
    pitch
        Distance of the targets, m; they are the centres of equal cells.
    methods
        Keys of `METHODS`; all by default.
    steps
        Of the annealings, in place of their own 10 000.
    kept
        Checkpoint of the finished targets. It stays until the rows are written and
        `remove_checkpoint` called.
    scheduler
        Address of a Dask scheduler, whose workers do it.
    allow_unmet
        Go on with fields that do not meet their tolerance.

    Returns
    -------
    tuple[RegionGrid, list[Row]]
        The cells, and a row per target and contender, targets in the grid's order.
    """
    grid = region_grid(replace(board, regions=Regions(pitch=pitch)))
    targets = [grid.centre_mm(region) for region in range(grid.count)]
    chosen = contenders(methods, default_objective(board))
    key = {
        "board": to_document(board),
        "methods": chosen,
        "pitch": pitch,
        "seed": seed,
        "steps": steps,
    }
    rows: list[Row] = []
    with Checkpoint(kept, key, partial(_is_result, chosen=chosen)) as checkpoint:
        work = partial(_score_all, chosen=chosen, seed=seed, steps=steps)
        solved = solved_board(board)
        check_estimate(solved.fields.error_estimate, TOLERANCE, allow_unmet=allow_unmet)
        if scheduler is not None:
            with Workers(scheduler=scheduler) as workers:
                on_workers(
                    workers, board, targets, work, checkpoint, with_finger=True, progress=progress
                )
        results = over_targets(
            solved, targets, work, jobs=jobs, checkpoint=checkpoint, with_finger=True
        )
        for number, (target, result) in enumerate(zip(targets, results, strict=True), 1):
            rows += [_row(target, entry) for entry in result["rows"]]
            if progress:
                progress(number, len(targets))
    return grid, rows


def summary(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Per method: the median of every number, and of what is below the contrast's limit."""
    result = []
    for method, objective in dict.fromkeys((row.method, row.objective) for row in rows):
        own = [row.numbers for row in rows if (row.method, row.objective) == (method, objective)]
        entry: dict[str, Any] = {"method": method, "objective": objective, "targets": len(own)}
        for name in NUMBERS:
            entry[name] = _median([numbers[name] for numbers in own])
        entry["below_limit_db"] = _median([n["contrast_limit_db"] - n["contrast_db"] for n in own])
        entry["ssim_min"] = min(numbers["ssim"] for numbers in own)
        misled = sum(
            disagreement(n["ssim"], n["focal_error_mm"], n["second_finger_db"]) is not None
            for n in own
        )
        entry["remark"] = remark(misled, len(own))
        result.append(entry)
    return result


def as_csv(rows: Sequence[Row]) -> bytes:
    """All rows, with a header; an absent number is an empty cell."""
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer)
    writer.writerow(["x_mm", "y_mm", "method", "objective", *NUMBERS])
    for row in rows:
        numbers = [row.numbers[name] for name in NUMBERS]
        cells = ["" if np.isnan(number) else f"{number:.6g}" for number in numbers]
        writer.writerow([f"{row.x_mm:g}", f"{row.y_mm:g}", row.method, row.objective, *cells])
    return buffer.getvalue().encode()


def _score_all(
    problem: Problem, chosen: Sequence[tuple[str, str]], seed: int, steps: int | None
) -> Result:
    nulls = null_models(problem)
    rows = []
    for method, objective in chosen:
        # Only annealings take the caller's steps; the others know best how many they need.
        own_steps = steps if method.endswith("anneal") else None
        solution = solve_problem(problem, method, Options(objective, seed, own_steps))
        card = asdict(score_on(problem, solution.field, nulls, drive=solution.drive))
        card |= {"evaluations": solution.evaluations, "seconds": solution.seconds, **card["felt"]}
        numbers = {name: _kept(card[name]) for name in NUMBERS}
        rows.append({"method": method, "objective": objective, "numbers": numbers})
    return {"rows": rows + _null_rows(nulls)}


def _null_rows(nulls: NullModels) -> list[Result]:
    nothing = dict.fromkeys(NUMBERS, "nan")
    return [
        {"method": name, "objective": "–", "numbers": {**nothing, "ssim": getattr(nulls, name)}}
        for name in NULLS
    ]


def _kept(number: float | None) -> float | str:
    """A number for a checkpoint, whose JSON holds finite ones; the others as words."""
    value = float("nan") if number is None else float(number)
    return value if np.isfinite(value) else str(value)


def _row(target: Target, entry: Result) -> Row:
    numbers = {name: float(value) for name, value in entry["numbers"].items()}
    return Row(*target, entry["method"], entry["objective"], numbers)


def _is_result(result: Result, chosen: Sequence[tuple[str, str]]) -> bool:
    """Whether a checkpoint's result is one of `_score_all` for these contenders."""
    rows = result.get("rows")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        return False
    found = [(row.get("method"), row.get("objective"), row.get("numbers")) for row in rows]
    wanted = [*chosen, *((name, "–") for name in NULLS)]
    return [row[:2] for row in found] == wanted and all(_are_numbers(row[2]) for row in found)


def _are_numbers(numbers: Any) -> bool:
    return (
        isinstance(numbers, dict)
        and list(numbers) == list(NUMBERS)
        and all(type(n) is float or n in ("nan", "inf", "-inf") for n in numbers.values())
    )


def _median(values: Sequence[float]) -> float | None:
    known = [value for value in values if not np.isnan(value)]
    return float(np.median(known)) if known else None
