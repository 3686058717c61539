"""Plate fields: error against time, for ours, the paper's fixed double sum, and finite elements.

    .venv/bin/python bench/plate.py          prints a table, writes docs/images/plate.png

Both boards, 160 Hz and 1 kHz, five actuators, 179 × 367 points, one core. The error is relative L²
(the largest of the five) against a converged solution of the same family: the double sum with
600 × 1200 modes, and our own basis two sizes up, which agrees with finite elements to 2e-5. Times
are medians of three runs from the board onwards. scikit-fem's Argyris elements are timed on meshes
of the bare plate (no screws, no magnets): meshing and holes would only add to them.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import resource
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementTriArgyris, MeshTri
from skfem.helpers import dd, ddot, trace

from chladni.host.figures import COLOURS, save
from chladni.sim.board import Board
from chladni.sim.board_file import load_board
from chladni.sim.loads import Load
from chladni.sim.ritz.plate import RitzPlate
from chladni.sim.ritz.scaling import resolution_for, wave_number
from chladni.sim.ritz.solver import Solver
from chladni.sim.simply_supported import SimplySupportedPlate
from chladni.sim.transfer import actuator_loads, plate_geometry, plate_model

ComplexArray = NDArray[np.complex128]
ROOT = Path(__file__).resolve().parents[1]
RUNS = 3
LEVELS = (0, 1, 2, 3)
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
    """Median seconds of a few runs, and the last result."""
    seconds = []
    for _ in range(RUNS):
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


def argyris_seconds(board: Board, frequency_hz: float, cells: int) -> tuple[float, int]:
    """Seconds for scikit-fem: assemble, factorise, solve five loads, evaluate the image."""
    plate = board.plate
    nu = plate.poissons_ratio

    @BilinearForm
    def bending(u, v, _):  # type: ignore[no-untyped-def]
        return (1 - nu) * ddot(dd(u), dd(v)) + nu * trace(dd(u)) * trace(dd(v))

    @BilinearForm
    def inertia(u, v, _):  # type: ignore[no-untyped-def]
        return u * v

    # Lengths in board widths, so that the element's monomials stay of order one.
    width, ratio = plate.size[0], plate.size[1] / plate.size[0]
    started = time.perf_counter()
    x, y = np.linspace(0, 1, cells + 1), np.linspace(0, ratio, round(cells * ratio) + 1)
    basis = Basis(MeshTri.init_tensor(x, y), ElementTriArgyris(), intorder=8)
    stiffness = plate.bending_stiffness / width**2 * bending.assemble(basis)
    mass = plate.areal_mass * width**2 * inertia.assemble(basis)
    system = (1 + 1j * plate.loss_factor) * stiffness - (2 * np.pi * frequency_hz) ** 2 * mass
    factor = splu(system.tocsc())
    grid = np.stack(np.meshgrid(
        (board.x / width + 0.5) * (1 - 1e-9), (board.y / width + ratio / 2) * (1 - 1e-9),
        indexing="ij"), axis=0).reshape(2, -1)  # fmt: skip
    places = np.array([[a.at[0] / width + 0.5, a.at[1] / width + ratio / 2]
                       for a in board.actuators]).T  # fmt: skip
    forces = basis.probes(places).toarray().T
    solved = np.stack([factor.solve(force.astype(complex)) for force in forces.T])
    probes = basis.probes(grid)
    fields = [probes @ field for field in solved]
    assert all(np.all(np.isfinite(field)) for field in fields)
    return time.perf_counter() - started, basis.N


def scene_rows(board: Board, frequency_hz: float) -> list[Row]:
    """All methods on one scene."""
    scene = f"{board.name}, {frequency_hz:g} Hz"
    loads: list[Load] = actuator_loads(board)
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
        geometry, loss = plate_geometry(board), board.plate.loss_factor
        waves = wave_number(geometry, 2.0 * np.pi * frequency_hz)
        exact = ours(RitzPlate(geometry, loss, resolution_for(geometry, waves, 5)), 1e-9)
        for level in LEVELS:
            size = resolution_for(geometry, waves, level)
            seconds, found = timed(lambda s=size: ours(RitzPlate(geometry, loss, s), 1e-9))  # type: ignore[misc]
            error = error_of(found, exact)
            rows.append(Row(scene, "ours, from the board", f"{size.nx}×{size.ny}", seconds, error))
            model = RitzPlate(geometry, loss, size)
            ours(model, 1e-9)
            solver = next(iter(model._solvers.values()))
            omega = 2.0 * np.pi * frequency_hz

            def another(solver: Solver = solver, omega: float = omega) -> ComplexArray:
                case = solver.case(loads)
                solution = solver.coefficients(case, omega, loss)
                return solver.field(case, solution, loss, board.x, board.y)

            seconds, found = timed(another)
            rows.append(Row(scene, "ours, next frequency", f"{size.nx}×{size.ny}", seconds, error))
    for cells in (6, 12):
        seconds, unknowns = argyris_seconds(board, frequency_hz, cells)
        rows.append(Row(scene, "scikit-fem Argyris", f"{unknowns} unknowns", seconds, np.nan))
    return rows


def draw(rows: list[Row]) -> Figure:
    """Error against time, a panel per scene."""
    scenes = list(dict.fromkeys(row.scene for row in rows))
    methods = list(dict.fromkeys(row.method for row in rows))
    figure = Figure(figsize=(10.0, 7.0), layout="constrained")
    for axes, scene in zip(figure.subplots(2, 2).ravel(), scenes, strict=False):
        for method, colour in zip(methods, COLOURS, strict=False):
            own = [row for row in rows if row.scene == scene and row.method == method]
            known = [row for row in own if np.isfinite(row.error)]
            if known:
                axes.loglog([r.seconds for r in known], [r.error for r in known], "o-",
                            color=colour, label=method)  # fmt: skip
            for row in own:
                if not np.isfinite(row.error):
                    axes.axvline(row.seconds, color=colour, linestyle=":", label=method)
        axes.set_title(scene, fontsize=10)
        axes.set_xlabel("seconds")
        axes.set_ylabel("relative L² error")
        handles, labels = axes.get_legend_handles_labels()
        unique = dict(zip(labels, handles, strict=True))
        axes.legend(unique.values(), unique.keys(), fontsize=7, frameon=False)
    return figure


def main() -> None:
    """Print the table, write the figure."""
    rows = []
    for name in ("paper", "prototype"):
        for frequency in (160.0, 1000.0):
            rows += scene_rows(load_board(name), frequency)
    print("## Plate fields: five actuators on 179 × 367 points, 160 Hz and 1 kHz\n")
    print("![Error against time](images/plate.png)\n")
    print("| scene | method | size | ms | error |\n|---|---|---|---|---|")
    for row in rows:
        error = f"{row.error:.1e}" if np.isfinite(row.error) else "–"
        print(f"| {row.scene} | {row.method} | {row.size} | {row.seconds * 1e3:.1f} | {error} |")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(
        f"\nPeak memory of the whole benchmark, references included: {peak:.0f} MB.\n\n"
        "The error of the fixed sum and of ours is against a converged solution (see\n"
        "`bench/plate.py`). scikit-fem's rows are the bare plate, without screws or magnets, and\n"
        "their time is mostly the evaluation on the image; their error was not measured here.\n"
    )
    save(draw(rows), ROOT / "docs" / "images" / "plate.png")


if __name__ == "__main__":
    main()
