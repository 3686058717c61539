"""What every plate model answers: natural frequencies, and fields under unit loads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.cost import Cost, begin
from chladni.sim.plate.loads import Load
from chladni.sim.plate.modes import ModeShapes

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FIELD_BYTES, FIELD_SECONDS = 48.0, 5e-8
"""Per point of a field: what it takes with the copies that are made of it on its way."""
MODE_BYTES, MODE_SECONDS = 18.0, 3e-7
"""The same of a mode."""


@dataclass(frozen=True)
class Response:
    """Steady-state displacement per newton under several loads, w(t) = Re(values · exp(iωt)).

    Attributes
    ----------
    values
        complex128, shape (loads, nx, ny), m/N.
    modes_used
        Modes (or Ritz functions) that carry the field.
    error_estimate
        Relative L² error over the board, the largest of the loads.
    frequency_hz
        Of the drive.
    tolerance
        What `error_estimate` was asked to be below.
    """

    values: ComplexArray
    modes_used: int
    error_estimate: float
    frequency_hz: float
    tolerance: float

    @property
    def tolerance_met(self) -> bool:
        """Whether the estimated error is as small as was asked for."""
        return self.error_estimate <= self.tolerance

    @property
    def velocity(self) -> ComplexArray:
        """iω times the displacement, m/(s·N)."""
        return np.asarray(2j * np.pi * self.frequency_hz * self.values)

    @property
    def acceleration(self) -> ComplexArray:
        """−ω² times the displacement, m/(s²·N)."""
        return np.asarray(-((2.0 * np.pi * self.frequency_hz) ** 2) * self.values)


@dataclass(frozen=True)
class Excitation:
    """Unit loads at one frequency, and where their fields are wanted.

    Attributes
    ----------
    x, y
        The grid, m.
    tolerance
        Relative L² error asked for.
    """

    loads: Sequence[Load]
    frequency_hz: float
    x: FloatArray
    y: FloatArray
    tolerance: float

    @property
    def omega(self) -> float:
        """Angular frequency, rad/s."""
        return 2.0 * np.pi * self.frequency_hz

    @property
    def image_points(self) -> int:
        """How many places fields are wanted at."""
        return self.x.size * self.y.size


class PlateModel(ABC):
    """A plate that can be asked for modes and fields."""

    @abstractmethod
    def natural_frequencies(self, count: int) -> FloatArray:
        """The lowest natural frequencies without loss, Hz, shape (count,); rigid motions are 0."""

    def modes(self, count: int, loads: Sequence[Load], x: FloatArray, y: FloatArray) -> ModeShapes:
        """The lowest modes on the grid x × y (m), and what unit loads do to them.

        Raises
        ------
        TooLargeError
            Modes or plate would take more memory than is allowed.
        """
        values = count * x.size * y.size
        begin(
            Cost(
                f"{count} modes on {x.size} × {y.size} points",
                MODE_BYTES * values,
                MODE_SECONDS * values,
                "image.points",
            )
        )
        return self._modes(count, loads, x, y)

    @abstractmethod
    def _modes(self, count: int, loads: Sequence[Load], x: FloatArray, y: FloatArray) -> ModeShapes:
        """The model's own way to the modes."""

    def respond(
        self,
        loads: Sequence[Load],
        *,
        frequency_hz: float,
        x: FloatArray,
        y: FloatArray,
        tolerance: float,
    ) -> Response:
        """Fields on the grid x × y (m) under unit loads, to a relative L² error of `tolerance`.

        Raises
        ------
        ResonanceError
            The plate has no loss and `frequency_hz` lies on a mode.
        TooLargeError
            Fields or plate would take more memory than is allowed.
        """
        count = len(loads) * x.size * y.size
        begin(
            Cost(
                f"{len(loads)} fields of {x.size} × {y.size} points",
                FIELD_BYTES * count,
                FIELD_SECONDS * count,
                "image.points",
            )
        )
        return self._respond(Excitation(loads, frequency_hz, x, y, tolerance))

    def cost(self, frequency_hz: float, tolerance: float, points: int) -> Cost:
        """What the plate itself takes for fields so exact on so many points, about."""
        return Cost("a plate", 0.0, 0.0, "image.points")

    @abstractmethod
    def _respond(self, excitation: Excitation) -> Response:
        """The model's own way to the fields."""
