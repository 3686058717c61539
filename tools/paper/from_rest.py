"""The scene of the authors' program: an undamped plate that lies still until its drives set in.

The energy image is the RMS over the first period. A motion is linear in ten reals (cosine and sine
part of five drives), so E² = vᵀMv at every point, with M the time mean of products of the
actuators' own motions. That makes an image in a millisecond, and a chain of 1000 steps in
four seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.drives.methods.anneal import Chain, advance, first_gains, phasors, redraw_gain
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.transfer import actuator_loads
from chladni.sim.image import metrics
from chladni.sim.plate.loads import Load
from chladni.sim.plate.modes import ModeShapes

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MODES = 120
"""Up to 20 kHz; the next hundred change an SSIM by at most 2e-3 (20 random drives)."""
INSTANTS = 48
"""Of the period."""


@dataclass(frozen=True)
class FromRest:
    """The board's modes, and the energy that products of its actuators' motions make.

    Attributes
    ----------
    modes
        Under a unit load of each actuator, then of each target.
    pairs
        Mean products of two motions, each pair once; shape (55, points). In single precision,
        which changes an SSIM by less than 1e-6 and halves the time of a step.
    """

    board: Board
    modes: ModeShapes
    pairs: NDArray[np.float32]

    @classmethod
    def of(cls, board: Board, targets_mm: list[tuple[float, float]]) -> FromRest:
        """A board, without its loss."""
        board = replace(board, plate=replace(board.plate, loss_factor=0.0))
        loads = actuator_loads(board)
        loads += [Load(x * MM, y * MM, loads[0].radius) for x, y in targets_mm]
        modes = plate_model(board).modes(MODES, loads, board.x, board.y)
        count = len(board.actuators)
        films = [film for k in range(count) for film in motions(modes, k, board)]
        pairs = [
            (1.0 if first == second else 2.0) * (films[first] * films[second]).mean(axis=0)
            for first in range(2 * count)
            for second in range(first + 1)
        ]
        # In units of the largest, so that single precision has room.
        largest = max(float(np.abs(pair).max()) for pair in pairs)
        return cls(board, modes, np.array([pair / largest for pair in pairs], dtype=np.float32))

    def image(self, drive: ComplexArray) -> FloatArray:
        """Energy image of drives Im(c exp(iωt)) that set in at once, shape (nx, ny), any scale."""
        # exp(iφ) is the paper's sin(ωt + φ): its real part goes with the sine.
        reals = np.stack([drive.imag, drive.real], axis=1).ravel()
        reals = reals / np.abs(reals).max()
        first, second = np.tril_indices(reals.size)
        energy = (reals[first] * reals[second]).astype(np.float32) @ self.pairs
        shape = (self.board.x.size, self.board.y.size)
        return np.asarray(np.sqrt(np.maximum(energy, 0.0)), dtype=np.float64).reshape(shape)

    def target(self, number: int) -> FloatArray:
        """Energy image of a unit load sin ωt at one of the targets."""
        film = motions(self.modes, len(self.board.actuators) + number, self.board)[1]
        return np.asarray(np.sqrt((film**2).mean(axis=0))).reshape(
            self.board.x.size, self.board.y.size
        )

    def anneal(self, number: int, steps: int, seed: int) -> Chain:
        """The authors' chain towards one of the targets."""
        target = self.target(number)

        def ssim(drive: ComplexArray) -> float:
            return metrics.ssim(self.image(drive), target)

        rng = np.random.default_rng(seed)
        state = first_gains(rng, len(self.board.actuators))
        first = ssim(phasors(state))
        chain = Chain(state, [first], (first, phasors(state)), rng)
        while chain.step < steps:
            advance(chain, redraw_gain, phasors, ssim)
        return chain


def motions(modes: ModeShapes, load: int, board: Board) -> tuple[FloatArray, FloatArray]:
    """The first period under one unit load, cos ωt and then sin ωt, each (instants, points)."""
    frequency = board.drive.frequency_hz
    times = (np.arange(INSTANTS) + 0.5) / INSTANTS / frequency
    losses = np.zeros(modes.frequencies_hz.size)
    single = replace(modes, participation=modes.participation[[load]])
    cosine, sine = (
        single.from_rest(np.array([phase]), frequency, times, losses).reshape(INSTANTS, -1)
        for phase in (1.0, -1j)
    )
    return cosine, sine
