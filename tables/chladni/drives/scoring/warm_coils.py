"""Coils and magnets at the temperatures that a drive without end brings them to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.coil.full_drive import full_drive

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

COPPER = 3.93e-3
"""Of its resistance at 20 °C, per kelvin."""
REMANENCE = -1.2e-3
"""Of NdFeB's, per kelvin (makers' data sheets, 20 to 80 °C)."""
STILL_AIR = 10.0
"""W/(m²·K), convection and radiation of a face a few centimetres wide (5 to 10 and 5)."""
ROOM_C, MAGNET_C = 25.0, 80.0
"""°C: of a room, and what sintered NdFeB of plain grade keeps its remanence up to."""
MAGNET_SHARE = 0.5
"""Of its coil's rise that a magnet has beyond the gap; estimated, like all of a board's heating."""


@dataclass(frozen=True)
class Warm:
    """What a drive at the coils' limit comes to once they are warm.

    Attributes
    ----------
    rise_k
        Of every coil, K, shape (actuators,).
    forces
        Over those of cold coils by the same drive, shape (actuators,). The device lowers the gains
        of cooler coils by as much as the warmest loses (`core/limits/coil_heat`), so what differs
        is what the magnets lose.
    watts
        Of all coils.
    """

    rise_k: FloatArray
    forces: FloatArray
    watts: float

    @property
    def magnet_k(self) -> float:
        """Rise of the warmest magnet above the board."""
        return float(MAGNET_SHARE * self.rise_k.max())


def warm(board: Board, drive: ComplexArray) -> Warm | None:
    """A drive at its limit, warm; None without a coil.

    A duty's mean square heats by V²/R, and R rises with it: T (1 + αT) = r P₀, where P₀ is what the
    cold coil would take. So coils end below the limit that the device keeps, which counts P₀.
    """
    full = full_drive(board, drive, board.drive.frequency_hz)
    if full is None:
        return None
    own = board.electronics
    sizes = np.abs(drive)
    cold = (full.bias**2 + full.duties**2 / 2.0) * own.full_heat_w
    rise = (np.sqrt(1.0 + 4.0 * COPPER * own.coil_k_per_w * cold) - 1.0) / (2.0 * COPPER)
    resistance = 1.0 + COPPER * rise
    magnet = 1.0 + REMANENCE * MAGNET_SHARE * rise
    gain = resistance / resistance[sizes > 0.0].max()
    current = gain / resistance
    # Heat goes with the square of the duty, and the gains lower that of cooler coils.
    watts = float((cold * gain**2 / resistance).sum())
    return Warm(rise, current * magnet, watts)


def board_rise_k(board: Board, heat: Warm) -> float:
    """How much a board's own heat warms it above the air, K: both its faces in still air.

    Coils' thermal resistance counts each coil alone; this comes on top.
    """
    width, length = board.plate.size
    return heat.watts / (2.0 * STILL_AIR * width * length)
