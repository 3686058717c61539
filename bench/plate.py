"""Plate fields: error against time, for ours, the paper's fixed double sum, and finite elements.

    .venv/bin/python bench/plate.py          prints a table, writes docs/images/plate.png

Both boards, 160 Hz and 1 kHz, five actuators, 179 × 367 points, one core. The error is relative L²
(the largest of the five) against a converged solution of the same family: the double sum with
600 × 1200 modes, and our own basis two sizes up, which agrees with finite elements to 2e-5. Times
are medians of five to 400 runs from the board onwards, error estimate included; the finite
elements, a hundred times slower, run once (common/finite_elements.py). Memory that was freed stays
with the process: what the system takes for handing out pages depends on what ran before.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import contextlib
import ctypes
import statistics
import sys
import time
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from itertools import count, product
from pathlib import Path

import numpy as np
from common.finite_elements import FemRun, oracle, scikit_fem
from common.random_boards import full_board
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.host.figures.fields import save
from chladni.sim import board_from_document
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.cost import allow_large_cost
from chladni.sim.fields.board_plate import plate_geometry, plate_model
from chladni.sim.fields.transfer import TOLERANCE, actuator_loads
from chladni.sim.navier.plate import SimplySupportedPlate
from chladni.sim.plate.loads import Load
from chladni.sim.plate.response import Response
from chladni.sim.ritz.basis.resolution import resolution_for, wave_number
from chladni.sim.ritz.plate import RitzPlate

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
ROOT = Path(__file__).resolve().parents[1]
RUNS, MOST_RUNS, LEAST_SECONDS = 5, 400, 1.0
SAME_ERROR = 1e-4
BOARDS = ("paper", "prototype")
LEVELS = (0, 1, 2, 3)
MESHES = {
    "paper": ((12e-3, 16), (6e-3, 32)),
    "prototype": ((8e-3, 16), (4e-3, 32)),
}
"""(element size in metres, segments on a circle) per board."""
SUMS = ((15, 30), (30, 60), (60, 120), (120, 240))


@dataclass(frozen=True)
class Row:
    """One method on one scene."""

    scene: str
    method: str
    size: str
    seconds: float
    error: float


def timed(work: Callable[[], ComplexArray]) -> tuple[float, ComplexArray]:
    """Median seconds of a few runs, more of them where they are short, and the last result."""
    seconds: list[float] = []
    result = work()
    while len(seconds) < RUNS or (sum(seconds) < LEAST_SECONDS and len(seconds) < MOST_RUNS):
        del result  # Two of them would fight for the cache.
        started = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - started)
    return statistics.median(seconds), result


def error_of(found: ComplexArray, exact: ComplexArray) -> float:
    """Largest relative L² error of several fields."""
    change = np.linalg.norm((found - exact).reshape(len(exact), -1), axis=1)
    return float((change / np.linalg.norm(exact.reshape(len(exact), -1), axis=1)).max())


def double_sum(board: Board, frequency_hz: float, m: int, n: int) -> ComplexArray:
    """The paper's sum over a fixed m × n modes, written with the same matrix products as ours."""
    plate = board.plate
    wave_x = np.arange(1, m + 1) * np.pi / plate.size[0]
    wave_y = np.arange(1, n + 1) * np.pi / plate.size[1]
    squares = plate.bending_stiffness / plate.areal_mass * (wave_x[:, None] ** 2 + wave_y**2) ** 2
    gain = (
        4.0
        / (plate.size[0] * plate.size[1] * plate.areal_mass)
        / (squares * (1.0 + 1j * plate.loss_factor) - (2.0 * np.pi * frequency_hz) ** 2)
    )
    shape_x = np.sin(np.outer(board.x + plate.size[0] / 2.0, wave_x))
    shape_y = np.sin(np.outer(board.y + plate.size[1] / 2.0, wave_y))
    fields = []
    for load in actuator_loads(board):
        at_x = np.sin(wave_x * (load.x + plate.size[0] / 2.0))
        at_y = np.sin(wave_y * (load.y + plate.size[1] / 2.0))
        fields.append(shape_x @ (gain * np.outer(at_x, at_y)) @ shape_y.T)
    return np.array(fields)


def scene_rows(board: Board, frequency_hz: float) -> list[Row]:
    """All methods on one scene."""
    scene = f"{board.name}, {frequency_hz:g} Hz"
    loads = actuator_loads(board)
    rows = []

    def ours(model: RitzPlate | SimplySupportedPlate, tolerance: float) -> ComplexArray:
        return model.respond(
            loads, frequency_hz=frequency_hz, x=board.x, y=board.y, tolerance=tolerance
        ).values

    if board.name == "paper":
        exact = double_sum(board, frequency_hz, 600, 1200)
        for m, n in SUMS:
            seconds, found = timed(lambda m=m, n=n: double_sum(board, frequency_hz, m, n))  # type: ignore[misc]
            rows.append(Row(scene, "fixed double sum", f"{m}×{n}", seconds, error_of(found, exact)))
        for tolerance in (1e-2, 1e-3, 1e-4, 1e-5):
            model = plate_model(board)
            assert isinstance(model, SimplySupportedPlate)
            seconds, found = timed(lambda t=tolerance, p=model: ours(p, t))  # type: ignore[misc]
            rows.append(Row(scene, "ours", f"{tolerance:g}", seconds, error_of(found, exact)))
    else:
        exact, own = ritz_rows(board, frequency_hz, scene)
        rows += own
    routes: dict[str, Callable[..., FemRun]] = {
        "scikit-fem Argyris": scikit_fem,
        "the tests' own Argyris": oracle,
    }
    for method, route in routes.items():
        for size, segments in MESHES[board.name]:
            run = route(board, frequency_hz, size, segments)
            name = f"{run.unknowns} unknowns"
            rows.append(Row(scene, method, name, run.seconds, error_of(run.fields, exact)))
            print(f"{scene} {method} {name}: image {run.image_seconds:.1f} s", file=sys.stderr)
    return rows


def ritz_rows(board: Board, frequency_hz: float, scene: str) -> tuple[ComplexArray, list[Row]]:
    """A converged reference and our own basis at several sizes."""
    geometry, loss = plate_geometry(board), board.plate.loss_factor
    waves = wave_number(geometry, 2.0 * np.pi * frequency_hz)
    loads = actuator_loads(board)
    steps = (1.0 + 1e-4 * k for k in count(1))

    def fields(model: RitzPlate, loads: list[Load], frequency_hz: float) -> ComplexArray:
        return model.respond(
            loads, frequency_hz=frequency_hz, x=board.x, y=board.y, tolerance=1e-9
        ).values

    exact = fields(
        RitzPlate(geometry, loss, resolution_for(geometry, waves, 5)), loads, frequency_hz
    )
    rows = []
    for level in LEVELS:
        size = resolution_for(geometry, waves, level)
        name = f"{size.nx}×{size.ny}"
        model = RitzPlate(geometry, loss, size)
        seconds, found = timed(
            lambda s=size: fields(RitzPlate(geometry, loss, s), loads, frequency_hz)
        )  # type: ignore[misc]
        error = error_of(found, exact)
        rows.append(Row(scene, "ours, from the board", name, seconds, error))
        for _ in range(RUNS):
            fields(model, loads, frequency_hz * next(steps))
        seconds, _ = timed(lambda m=model: fields(m, loads, frequency_hz * next(steps)))  # type: ignore[misc]
        rows.append(Row(scene, "ours, next frequency", name, seconds, error))
        # Moved a little every time, so that nothing about the loads is known beforehand.
        seconds, _ = timed(lambda m=model: fields(m, moved(loads, next(steps)), frequency_hz))  # type: ignore[misc]
        rows.append(Row(scene, "ours, new loads", name, seconds, error))
    return exact, rows


def moved(loads: list[Load], factor: float) -> list[Load]:
    """Five target loads, off the magnets and of their size."""
    return [Load(0.6 * load.x + 0.01 * factor, 0.4 * load.y, load.radius) for load in loads]


def peak_megabytes(board: Board) -> float:
    """Largest memory our fields hold at once, from the board to the image."""
    tracemalloc.start()
    plate_model(board).respond(
        actuator_loads(board), frequency_hz=160.0, x=board.x, y=board.y, tolerance=TOLERANCE
    )
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 1e6


def seconds_at(rows: list[Row], error: float) -> tuple[float, bool]:
    """Time at which a method reaches an error, between its rows; False if none of them does."""
    rows = sorted(rows, key=lambda row: row.error)
    if rows[0].error > error:
        return rows[0].seconds, False
    errors, seconds = np.log([r.error for r in rows]), np.log([r.seconds for r in rows])
    return float(np.exp(np.interp(np.log(error), errors, seconds))), True


def print_ratios(rows: list[Row]) -> None:
    """Every method that starts from the board against ours, at one error."""
    print(f"Seconds to {SAME_ERROR:g}, interpolated between the rows above, over those of ours:\n")
    print("| scene | method | times ours |\n|---|---|---|")
    for scene in dict.fromkeys(row.scene for row in rows):
        own = [row for row in rows if row.scene == scene]
        mine, _ = seconds_at(
            [r for r in own if r.method in ("ours", "ours, from the board")], SAME_ERROR
        )
        for method in dict.fromkeys(r.method for r in own if not r.method.startswith("ours")):
            seconds, reached = seconds_at([r for r in own if r.method == method], SAME_ERROR)
            note = "" if reached else " at its last row, short of that"
            print(f"| {scene} | {method} | {seconds / mine:.3g}{note} |")
    print()


def draw(rows: list[Row]) -> Figure:
    """Error against time, a panel per scene."""
    scenes = list(dict.fromkeys(row.scene for row in rows))
    figure = Figure(figsize=(10.0, 7.0), layout="constrained")
    for axes, scene in zip(figure.subplots(2, 2).ravel(), scenes, strict=False):
        methods = list(dict.fromkeys(row.method for row in rows if row.scene == scene))
        for k, method in enumerate(methods):
            own = [row for row in rows if row.scene == scene and row.method == method]
            axes.loglog(
                [r.seconds for r in own], [r.error for r in own], "o-", color=f"C{k}", label=method
            )
        axes.margins(y=0.25)  # room for the legend above the curves
        axes.set_title(scene, fontsize=10)
        axes.set_xlabel("seconds")
        axes.set_ylabel("relative L² error")
        axes.legend(fontsize=7, frameon=False)
    return figure


def print_full_boards() -> None:
    """Twelve boards of sixteen coils and twelve other features, no mirror: error against time."""
    print(
        "Twelve random boards of phone size with sixteen magnets, six screws, two holes, two\n"
        "springs and two masses, no mirror, on one core. Gap: the least between any two. Errors\n"
        "are against a basis of level 4. The default tolerance is 0.005.\n"
    )
    print("| edges | gap, mm | seed | tolerance | functions | s | estimate | error |")
    print("|---|---|---|---|---|---|---|---|")
    allow_large_cost(True)
    for edges, gap, seed in product(("free", "simply supported", "clamped"), (1.0, 3.0), (0, 1)):
        board = board_from_document(full_board(seed, edges, gap))
        for row in full_board_rows(board):
            print(f"| {edges} | {gap:g} | {seed} | {row} |", flush=True)
    allow_large_cost(False)
    print()


def full_board_rows(board: Board) -> list[str]:
    """A board at two tolerances: functions, seconds, estimate and error."""
    geometry, loads = plate_geometry(board), actuator_loads(board)

    def fields(model: RitzPlate, tolerance: float) -> Response:
        return model.respond(loads, frequency_hz=160.0, x=board.x, y=board.y, tolerance=tolerance)

    finest = resolution_for(geometry, wave_number(geometry, 2.0 * np.pi * 160.0), 4)
    exact = fields(RitzPlate(geometry, 0.02, finest), 1e-9).values
    rows = []
    for tolerance in (5e-2, TOLERANCE):
        started = time.perf_counter()
        found = fields(RitzPlate(geometry, 0.02), tolerance)
        seconds = time.perf_counter() - started
        rows.append(
            f"{tolerance:g} | {found.modes_used} | {seconds:.1f} | {found.error_estimate:.1e} "
            f"| {error_of(found.values, exact):.1e}"
        )
    return rows


def keep_memory() -> None:
    """Have freed memory used again, not given back: the same for every method (glibc only)."""
    trim_threshold, mmap_threshold = -1, -3
    with contextlib.suppress(AttributeError, OSError):
        for option in (trim_threshold, mmap_threshold):
            ctypes.CDLL(None).mallopt(option, 1 << 30)


def main() -> None:
    """Print the table, write the figure."""
    keep_memory()
    rows = []
    for name in BOARDS:
        for frequency in (160.0, 1000.0):
            rows += scene_rows(load_board(name), frequency)
    print("## Plate fields: five actuators on 179 × 367 points, 160 Hz and 1 kHz\n")
    print("![Error against time](../images/plate.png)\n")
    print("| scene | method | size | ms | error |\n|---|---|---|---|---|")
    for row in rows:
        print(
            f"| {row.scene} | {row.method} | {row.size} | {row.seconds * 1e3:.1f} "
            f"| {row.error:.1e} |"
        )
    print()
    print_ratios(rows)
    peaks = [f"{peak_megabytes(load_board(name)):.0f} MB for `{name}`" for name in BOARDS]
    print(
        f"Peak memory at the default tolerance: {', '.join(peaks)}.\n"
        "Errors are against a converged solution; on `prototype` ours and the tests' own\n"
        "elements, which share no code, meet at 2e-5. scikit-fem spends two thirds of its time on\n"
        "probing the image. *New loads* asks a kept plate for five other places.\n"
    )
    print_full_boards()
    save(draw(rows), ROOT / "docs" / "images" / "plate.png")


if __name__ == "__main__":
    main()
