"""Figure 3D: one period of vibration, and the energy image that is made of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.problem.problem import solved_board
from chladni.drives.solve import solve
from chladni.host.figures.fields import INK, draw_board, draw_displacement, draw_image, save
from chladni.sim.image import metrics
from chladni.sim.image.energy import energy_image
from paper import boards
from paper.numbers import Numbers, fixed

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

TARGET_MM = (10.0, 25.0)
SHOWN = 6
"""Instants of a period that are drawn."""
INSTANTS = 90
"""Instants that the image is compared with."""


def _vibrations() -> dict[str, ComplexArray]:
    board = boards.computed()
    middle = solved_board(board).fields.values[boards.MIDDLE]
    newton = boards.newtons_per_gain(board)
    best = solve(board, TARGET_MM)
    share = newton / board.drive.max_gain
    return {"middle coil alone": newton * middle, "best drive for +": share * best.field}


def film(field: ComplexArray, instants: int) -> FloatArray:
    """Displacements over a period, shape (instants, nx, ny)."""
    turns = np.exp(2j * np.pi * np.arange(instants) / instants)
    return np.asarray((field * turns[:, None, None]).real)


def numbers() -> Numbers:
    """Whether the closed form is the RMS over a film, and how much a field travels."""
    _, best = _vibrations().values()
    rms = np.sqrt((film(best, INSTANTS) ** 2).mean(axis=0))
    # The share in quadrature with the rest, at the phase that makes it least.
    spread = np.linalg.svd(np.stack([best.real.ravel(), best.imag.ravel()]), compute_uv=False)
    return {
        "film_ssim": fixed(metrics.ssim(energy_image(best), rms), 4),
        "film_instants": str(INSTANTS),
        "travelling": fixed(100.0 * float(spread[1] / spread[0]), 1),
    }


def draw(folder: Path) -> None:
    """Two vibrations, a row each: instants of a period, then the energy image."""
    board = boards.computed()
    vibrations = _vibrations()
    figure = Figure(figsize=(13.0, 7.4), layout="constrained")
    rows = figure.subplots(len(vibrations), SHOWN + 1, sharex=True, sharey=True)
    for line, (row, (name, field)) in enumerate(zip(rows, vibrations.items(), strict=True), 1):
        target = TARGET_MM if "+" in name else None
        scale = float(np.abs(field).max())
        for k, (axes, instant) in enumerate(zip(row, film(field, SHOWN), strict=False)):
            drawn = draw_displacement(axes, board, instant, scale=scale)
            draw_board(axes, board, target_mm=target, ink="black", small=True)
            axes.set_title(f"{360 * k // SHOWN}°", fontsize=10, color=INK)
        draw_image(row[-1], board, field)
        draw_board(row[-1], board, target_mm=target, small=True)
        row[-1].set_title("energy image", fontsize=10, color=INK)
        row[0].set_ylabel(f"{name}\ny / mm")
        for axes in row:
            axes.set_xlabel("x / mm" if line == len(rows) else "")
        figure.colorbar(drawn, ax=row.tolist(), label="displacement / µm", shrink=0.8)
    save(figure, folder / "paper-3d.png")
