"""Sets of fingers as the firmware's core takes them, made up or from boards; not a test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers.responses import Responses, interpolated
from chladni.drives.fingers.silence import KnownPlate, Place, ring_offsets
from chladni.host.emulation import _emulator
from chladni.sim.fields.transfer import transfer_fields
from conftest import shipped_board

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class MadeUpPlate:
    """Responses that are known at the fingers' points alone; a `KnownPlate`.

    Attributes
    ----------
    centres
        Middles of the fingers, m, shape (fingers, 2).
    points
        m/N, shape (fingers, 7, channels).
    own
        m/N, shape (fingers,).
    coupling
        N/m, shape (channels, channels), symmetric.
    """

    centres: FloatArray
    points: ComplexArray
    own: ComplexArray
    coupling: ComplexArray

    def at(self, places: FloatArray) -> ComplexArray:
        return self.points.reshape(-1, self.points.shape[2])

    def own_at(self, places: FloatArray) -> ComplexArray:
        return self.own

    @property
    def fingers(self) -> list[Place]:
        return [(float(x), float(y)) for x, y in self.centres]

    def in_single_precision(self) -> MadeUpPlate:
        """What the core is given: rounding of what comes in is no error of its own."""
        return replace(
            self,
            **{
                name: getattr(self, name).astype(np.complex64).astype(np.complex128)
                for name in ("points", "own", "coupling")
            },
        )


@dataclass(frozen=True)
class CoreDrives:
    """What the core found: as `FingerDrives`, of drives whose largest is 1."""

    drives: ComplexArray
    means: ComplexArray
    shares: FloatArray
    of_loudest: FloatArray
    regularisation: FloatArray


def known_at(plate: KnownPlate, fingers: Sequence[Place]) -> MadeUpPlate:
    """What a plate does at fingers."""
    centres = np.asarray(fingers, dtype=np.float64)
    places = (centres[:, None] + ring_offsets()).reshape(-1, 2)
    points = plate.at(places).reshape(len(centres), len(ring_offsets()), -1)
    return MadeUpPlate(centres, points, plate.own_at(centres), plate.coupling)


def random_plate(
    generator: np.random.Generator, fingers: int, channels: int, *, scale: float = 1e-5
) -> MadeUpPlate:
    """Responses without any order, but for what a finger's points have in common."""

    def numbers(*shape: int) -> ComplexArray:
        return generator.normal(size=shape) + 1j * generator.normal(size=shape)

    points = numbers(fingers, 1, channels) + 0.3 * numbers(fingers, 7, channels)
    coupling = numbers(channels, channels) / (channels * scale)
    return MadeUpPlate(
        generator.uniform(-0.05, 0.05, (fingers, 2)),
        points * scale,
        (3.0 + numbers(fingers)) * scale,
        (coupling + coupling.T) / 2.0,
    )


def core_set(
    plate: MadeUpPlate,
    *,
    stiffness: complex = 0.0,
    regularisation: float = 0.0,
    levels: FloatArray | None = None,
    thresholds: FloatArray | None = None,
) -> _emulator.FingerSet:
    """For the core's solver; a λ of 0 is chosen by it."""
    count, _, channels = plate.points.shape
    return _emulator.FingerSet(
        channels=channels,
        points=plate.points.ravel().tolist(),
        own=plate.own.tolist(),
        coupling=plate.coupling[np.triu_indices(channels)].tolist(),
        stiffness=stiffness,
        levels_n=(np.ones(count) if levels is None else levels).tolist(),
        thresholds_m=(np.zeros(count) if thresholds is None else thresholds).tolist(),
        regularisations=[regularisation] * count,
    )


def core_drives(fingers: _emulator.FingerSet) -> CoreDrives:
    """The core's answer."""
    gains, means, shares, of_loudest, regularisation = zip(
        *_emulator.finger_drives(fingers), strict=True
    )
    return CoreDrives(
        np.array(gains),
        np.array(means),
        np.array(shares),
        np.array(of_loudest),
        np.array(regularisation),
    )


def coarse_plate(name: str) -> Responses:
    """A board's responses 4 mm apart, and a coupling of Nyström's: M = C⁻¹, from coil to coil.

    Real plates, unlike numbers at random, make equations of bad condition.
    """
    board = shipped_board(name)
    points = [max(9, round(side / 4e-3)) for side in board.plate.size]
    board = replace(board, image=replace(board.image, points=(points[0], points[1])))
    fields = transfer_fields(board)
    coils = np.array([actuator.at for actuator in board.actuators])
    between = interpolated(board.x, board.y, fields.values, coils)
    coupling = np.linalg.pinv((between + between.T) / 2.0, rcond=1e-6)
    stiffest = np.abs(np.diag(between)).max()
    ends = [np.array([-0.5, 0.5]) * (side - 6e-3) for side in board.plate.size]
    return Responses(
        x=board.x,
        y=board.y,
        values=fields.values,
        own_x=ends[0],
        own_y=ends[1],
        own=np.full((2, 2), stiffest, dtype=np.complex128),
        coupling=np.asarray((coupling + coupling.T) / 2.0, dtype=np.complex128),
        frequency_hz=fields.frequency_hz,
    )


def drawn_fingers(
    generator: np.random.Generator, plate: Responses, fingers: int, apart: float
) -> FloatArray:
    """Middles at random, at least so far apart (m), shape (fingers, 2)."""
    low = np.array([plate.own_x[0], plate.own_y[0]])
    high = np.array([plate.own_x[-1], plate.own_y[-1]])
    while True:
        drawn = generator.uniform(low, high, (fingers, 2))
        distances = np.hypot(*(drawn[:, None] - drawn[None, :]).transpose(2, 0, 1))
        if np.all(distances[np.triu_indices(fingers, 1)] >= apart):
            return drawn
