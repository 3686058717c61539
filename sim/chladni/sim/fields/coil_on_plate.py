"""One coil over frequency as it drives its own board: the plate's resonances, not a latch's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.transfer import TOLERANCE, actuator_loads
from chladni.sim.plate.response import PlateModel

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class PlateCurve:
    """A sweep through a plate: Hz, and the acceleration's amplitude under the coil, m/s²."""

    frequencies_hz: FloatArray
    acceleration: FloatArray


def acceleration_on_plate(
    board: Board,
    actuator: int,
    frequencies_hz: FloatArray,
    *,
    model: PlateModel | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> ComplexArray:
    """Acceleration of the plate under a coil per volt at that coil alone, m/(s²·V).

        a = −ω² H F,   F = Fᵇ/(1 + Z H),   Fᵇ = BL/(R + iωL),   Z = iω BL²/(R + iωL)

    H is the plate's displacement per newton where the coil is, Z the brake by the voltage that its
    own motion induces (0 where `coil.motion_acts_back` is false). The other coils are not
    connected.

    Parameters
    ----------
    actuator
        Its number in the board file, from 0.
    frequencies_hz
        Shape (frequencies,).
    model
        `plate_model(board)`, if it is at hand.
    progress
        Called with how many frequencies are done, and how many there are.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    ResonanceError
        The plate is undamped, and one of the frequencies lies on a mode.
    """
    coil = board.known_coil
    model = model or plate_model(board)
    load = actuator_loads(board)[actuator]
    x, y = (np.array([along]) for along in board.actuators[actuator].at)
    compliance = np.empty(len(frequencies_hz), dtype=np.complex128)
    for k, one in enumerate(frequencies_hz):
        found = model.respond([load], frequency_hz=float(one), x=x, y=y, tolerance=TOLERANCE)
        compliance[k] = found.values[0, 0, 0]
        if progress is not None:
            progress(k + 1, len(frequencies_hz))
    omega = 2.0 * np.pi * np.asarray(frequencies_hz, dtype=np.float64)
    blocked = coil.force_factor / (coil.resistance + 1j * omega * coil.inductance)
    brake = 1j * omega * coil.force_factor * blocked if coil.motion_acts_back else 0.0
    return np.asarray(-(omega**2) * compliance * blocked / (1.0 + brake * compliance))
