"""Figures 4 and 5C: the paper's annealing, in its authors' scene and in ours, beside theirs."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.methods.anneal import Chain, phasors, read_trace
from chladni.drives.problem.problem import solved_board
from chladni.drives.solve import gauge, solve
from chladni.host.figures.fields import COLOURS, INK, save
from chladni.sim.image import metrics
from paper import authors, boards
from paper.authors import Run
from paper.from_rest import FromRest
from paper.numbers import Numbers, fixed

ComplexArray = NDArray[np.complex128]

SEEDS = (1, 2, 3)
LONG, SHORT = 10_000, 1000
"""Steps: of the paper's algorithm, and of the authors' runs for the four targets."""
THEIRS, RESTING, STEADY = "authors, selected steps", "ours, from rest", "ours, steady state"
STYLE = {THEIRS: COLOURS[1], RESTING: COLOURS[0], STEADY: COLOURS[2]}


@dataclass(frozen=True)
class Chains:
    """Chains from several starts in two scenes, a list a target.

    In the steady state the first target's are long. `other_phase` is the SSIM of two energy images
    of the middle coil alone from rest: of a drive that begins as a sine, and as a cosine.
    """

    from_rest: list[list[Chain]]
    steady: list[list[Chain]]
    other_phase: float


@cache
def chains() -> Chains:
    """All of them, in about a minute."""
    targets = [run.target_mm for run in authors.short_runs()]
    scene = FromRest.of(boards.computed(), targets)
    lengths = [LONG if k == 0 else SHORT for k in range(len(targets))]
    middle = np.zeros(len(scene.board.actuators), dtype=np.complex128)
    middle[boards.MIDDLE] = 1.0
    return Chains(
        [[scene.anneal(k, SHORT, seed) for seed in SEEDS] for k in range(len(targets))],
        [
            [_steady(target, steps, seed) for seed in SEEDS]
            for target, steps in zip(targets, lengths, strict=True)
        ],
        metrics.ssim(scene.image(middle), scene.image(1j * middle)),
    )


def _steady(target_mm: tuple[float, float], steps: int, seed: int) -> Chain:
    """The same chain in the steady state, as `chladni solve --method anneal` runs it."""
    with tempfile.TemporaryDirectory() as folder:
        trace = Path(folder) / "trace.npz"
        solve(boards.computed(), target_mm, method="anneal", seed=seed, steps=steps, trace=trace)
        return read_trace(trace)[0]


def numbers() -> Numbers:
    """What the authors' chains and ours begin and end with."""
    own, long = chains(), authors.long_run()
    found = {
        "other_phase": fixed(own.other_phase, 2),
        "seeds": str(len(SEEDS)),
        "long_first": fixed(long.first, 3),
        "long_best": fixed(long.best, 3),
        "steady_long": _range([max(chain.ssim) for chain in own.steady[0]]),
    }
    for k, (resting, steady) in enumerate(zip(own.from_rest, own.steady, strict=True), 1):
        for name, several in (("rest", resting), ("steady", steady)):
            found[f"{name}_{k}"] = _range([max(chain.ssim[: SHORT + 1]) for chain in several])
    return found


def _range(values: list[float]) -> str:
    ends = [fixed(end, 3) for end in (min(values), max(values))]
    return " to ".join(dict.fromkeys(ends))


def draw(folder: Path) -> None:
    """Both figures."""
    save(_five_phasors(), folder / "paper-4.png")
    save(_traces(), folder / "paper-5c.png")


def _five_phasors() -> Figure:
    """1800 gains, what they add up to, and the best drive there is."""
    board, run = boards.computed(), authors.short_runs()[0]
    problem = solved_board(board).problem(run.target_mm)
    state = chains().steady[0][0].state
    figure = Figure(figsize=(12.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
    drawn = left.imshow(
        state,
        aspect="auto",
        cmap="RdBu_r",
        interpolation="nearest",
        extent=(-0.5, state.shape[1] - 0.5, len(state) - 0.5, -0.5),
    )
    figure.colorbar(drawn, ax=left, label="gain", shrink=0.8)
    left.set_yticks(range(len(state)), [actuator.name for actuator in board.actuators])
    left.set_xlabel("phase / °")
    left.set_title("What is searched: a gain per phase and actuator", fontsize=10, color=INK)
    right.set_title("What the plate gets of it: a phasor per actuator", fontsize=10, color=INK)
    annealed = gauge(problem, phasors(state))
    best = solve(board, run.target_mm).drive
    for drive, marker, name in ((annealed, "o", "annealing"), (best, "s", "best drive")):
        right.plot([], [], marker, color=INK, markerfacecolor="none", label=name)
        for value, colour in zip(drive, COLOURS, strict=False):
            right.plot([0.0, value.real], [0.0, value.imag], color=colour, linewidth=1.2)
            right.plot(
                value.real, value.imag, marker, color=colour, markersize=7, markerfacecolor="none"
            )
    for actuator, colour in zip(board.actuators, COLOURS, strict=False):
        right.plot([], [], color=colour, label=actuator.name)
    right.set_xlabel("in phase with the target / gain")
    right.set_ylabel("a quarter period ahead / gain")
    right.set_xlim(-1.5, 11.5)
    right.set_ylim(-3.0, 3.0)
    right.set_aspect("equal")
    right.axhline(0.0, color="#cccccc", linewidth=0.6, zorder=0)
    right.axvline(0.0, color="#cccccc", linewidth=0.6, zorder=0)
    right.legend(
        frameon=False, fontsize=8, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.28)
    )
    return figure


def _traces() -> Figure:
    """The long run, and the four targets'."""
    figure = Figure(figsize=(12.0, 7.4), layout="constrained")
    top, bottom = np.asarray(figure.subfigures(2, 1, height_ratios=[1.2, 1.0])).tolist()
    own = chains()
    axes = top.subplots()
    _draw(axes, authors.long_run(), own.from_rest[0], own.steady[0], LONG)
    axes.set_xscale("log")
    axes.set_title("The paper's figure 5C: (10, 25) mm, 10 000 steps", fontsize=10, color=INK)
    axes.legend(frameon=False, fontsize=9, loc="lower right")
    runs = authors.short_runs()
    panels = bottom.subplots(1, len(runs), sharey=True)
    for axes, run, resting, steady in zip(panels, runs, own.from_rest, own.steady, strict=True):
        _draw(axes, run, resting, steady, SHORT)
        axes.set_title("({}, {}) mm".format(*map(fixed, run.target_mm)), fontsize=10, color=INK)
    for axes in panels[1:]:
        axes.set_ylabel("")
    return figure


def _draw(
    axes: Axes, run: Run, resting: Sequence[Chain], steady: Sequence[Chain], steps: int
) -> None:
    for name, several in ((RESTING, resting), (STEADY, steady)):
        for number, chain in enumerate(several):
            shown = chain.ssim[1 : steps + 1]
            axes.plot(
                np.arange(1, len(shown) + 1),
                shown,
                color=STYLE[name],
                linewidth=0.7,
                label=name if number == 0 else None,
            )
    axes.plot(
        run.steps, run.ssim, "o-", color=STYLE[THEIRS], markersize=3, linewidth=0.8, label=THEIRS
    )
    axes.set_xlabel("step")
    axes.set_ylabel("SSIM")
