"""Figure 3C: two actuators at once make the sum of what each makes alone.

In the plate's model that is so by construction. What could break it is the firmware, so the three
drives are played on its emulator and their fields made of what the pins did.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.problem.problem import solved_board
from chladni.host.figures.fields import INK, draw_board, draw_displacement, save
from chladni.sim.fields.driven import back_emf_coupling
from chladni.sim.image.energy import compose
from paper import boards
from paper.numbers import Numbers, fixed, rounded
from paper.pins import Played, play

ComplexArray = NDArray[np.complex128]

PAIRS = {
    "coil across": boards.ACROSS,
    "diagonal coil": boards.DIAGONAL,
    "middle coil": boards.MIDDLE,
}
GAIN = 0.8
LAG = np.exp(-0.25j * np.pi)
"""The second is an eighth of a period late, so that sums are of phasors and not of sizes."""


@dataclass(frozen=True)
class Pair:
    """A corner coil and another: alone, and both at once."""

    alone: tuple[Played, Played]
    both: Played

    @property
    def fields(self) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """First, second, their sum, and both at once, m."""
        board = boards.computed()
        transfer = boards.newtons_per_gain(board) * solved_board(board).fields.values
        first, second, both = (compose(transfer, one.gains) for one in (*self.alone, self.both))
        return first, second, first + second, both

    @property
    def duties(self) -> int:
        """Duties that were recorded of the two at once."""
        return 2 * len(self.both.recording.duty_steps)

    @property
    def different_duties(self) -> int:
        """Of those, how many are not what the channel does when it plays alone."""
        first, second, both = (one.recording.duty_steps for one in (*self.alone, self.both))
        # The channel that is silent has duty 0.
        return int(np.count_nonzero(np.maximum(first, second) != both))


@cache
def _pair(other: int) -> Pair:
    board = boards.computed()
    gains = np.zeros((2, len(board.actuators)), dtype=np.complex128)
    gains[0, boards.CORNER], gains[1, other] = GAIN, GAIN * LAG
    first, second, both = (play(board, one) for one in (*gains, gains.sum(axis=0)))
    return Pair((first, second), both)


def numbers() -> Numbers:
    """What is left of the difference, and what all coils at full gain draw."""
    board = boards.computed()
    every = play(board, np.ones(len(board.actuators), dtype=np.complex128))
    pairs = [_pair(other) for other in PAIRS.values()]
    coupling = np.linalg.norm(back_emf_coupling(board, solved_board(board).fields), 2)
    return {
        "duties": fixed(sum(pair.duties for pair in pairs)),
        "different_duties": fixed(sum(pair.different_duties for pair in pairs)),
        "every_gain": fixed(abs(every.gains).min(), 3),
        "every_ma": fixed(every.supply_ma),
        "supply_ma": fixed(board.electronics.supply_limit_ma),
        "coupling": rounded(float(coupling), 1),
    }


def draw(folder: Path) -> None:
    """A row a pair: each alone, the sum, and both at once, on one scale."""
    board = boards.computed()
    figure = Figure(figsize=(9.0, 12.0), layout="constrained")
    rows = figure.subplots(len(PAIRS), 4, sharex=True, sharey=True)
    for row, (name, other) in zip(rows, PAIRS.items(), strict=True):
        pair = _pair(other)
        titles = ("corner coil alone", f"{name} alone", "sum of the two", "both at once")
        turn = np.exp(-1j * np.angle(pair.fields[2].flat[np.abs(pair.fields[2]).argmax()]))
        instants = [(field * turn).real for field in pair.fields]
        scale = max(float(np.abs(instant).max()) for instant in instants)
        for axes, instant, title in zip(row, instants, titles, strict=True):
            drawn = draw_displacement(axes, board, instant, scale=scale)
            draw_board(axes, board, ink="black", small=True)
            axes.set_title(title, fontsize=10, color=INK)
            axes.set_xlabel("x / mm" if other == boards.MIDDLE else "")
        row[0].set_ylabel("y / mm")
        figure.colorbar(drawn, ax=row.tolist(), label="displacement at an instant / µm", shrink=0.8)
    save(figure, folder / "paper-3c.png")
