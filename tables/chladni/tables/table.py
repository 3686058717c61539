"""A drive table in memory, as the device has it: integers, regions, mirrors and branches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import InputError
from chladni.tables.coding import FULL_SCALE, MAX_SHIFT
from chladni.tables.folding import UNFOLDED, Folding
from chladni.tables.lookup import lookup, unfolded
from chladni.tables.regions import RegionGrid

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Limits:
    """What the device keeps to, from the board file; µs."""

    ramp_us: int
    touch_timeout_us: int
    max_on_us: int


@dataclass(frozen=True)
class Section:
    """The drives of one frequency and objective.

    Attributes
    ----------
    labels
        uint8, shape (stored regions,): regions of one label lie on one branch of optima, and the
        device interpolates between them.
    crossings
        uint8, shape (labels, 2): what becomes of a label across the mirrors in x and y
        (`CUT`, `JOINED` or `NEGATED`).
    iq
        int16, shape (stored regions, actuators, 2): in-phase and quadrature as the device decodes
        them, where 32767 stands for `full_scale_gain`.
    """

    frequency_hz: float
    objective: str
    full_scale_gain: float
    labels: NDArray[np.uint8]
    crossings: NDArray[np.uint8]
    iq: NDArray[np.int16]

    @property
    def start_shift(self) -> int:
        """Where the stream's shift begins: at that of the first drive, as far as it has one."""
        used = int(np.bitwise_or.reduce(np.abs(self.iq.astype(np.int64)), axis=None))
        return min(MAX_SHIFT, (used & -used).bit_length() - 1) if used else 0


@dataclass(frozen=True)
class Table:
    """A drive table in memory: what all its sections share, and the sections.

    A device plays the first section unless it is asked for another frequency.
    """

    board_name: str
    board_fingerprint: int
    grid: RegionGrid
    limits: Limits
    sections: tuple[Section, ...]
    folding: Folding = UNFOLDED

    @property
    def actuators(self) -> int:
        """Channels of every drive."""
        return int(self.sections[0].iq.shape[1])

    def section(self, frequency_hz: float | None = None) -> Section:
        """The section of a frequency, or the first.

        Raises
        ------
        InputError
            There is none; names those there are.
        """
        if frequency_hz is None:
            return self.sections[0]
        for section in self.sections:
            if round(section.frequency_hz * 1000.0) == round(frequency_hz * 1000.0):
                return section
        known = ", ".join(f"{section.frequency_hz:g}" for section in self.sections)
        raise InputError("frequency", f"{frequency_hz:g} Hz", f"one of the table's: {known} Hz")

    def region_iq(self, section: Section) -> NDArray[np.int16]:
        """Drives of all regions, int16 of shape (regions, actuators, 2), mirrors applied."""
        cells = self.folding.regions(self.grid)
        return unfolded(self, section, cells.stored, cells.flips)

    def drives(self, section: Section) -> ComplexArray:
        """Drives of all regions as the table holds them, shape (regions, actuators)."""
        return dequantise(self.region_iq(section), section.full_scale_gain)

    def drive_at(self, section: Section, x_um: int, y_um: int) -> ComplexArray:
        """What the device plays at a place, interpolated, shape (actuators,)."""
        found = lookup(self, section, np.array([x_um]), np.array([y_um]))
        return dequantise(found[0], section.full_scale_gain)


def quantise(drives: ComplexArray, full_scale_gain: float) -> NDArray[np.int16]:
    """Drives of any shape as integers, in-phase and quadrature along a new last axis."""
    scaled = np.stack((drives.real, drives.imag), axis=-1) * (FULL_SCALE / full_scale_gain)
    return np.asarray(np.clip(np.rint(scaled), -FULL_SCALE, FULL_SCALE).astype(np.int16))


def dequantise(iq: NDArray[np.int16], full_scale_gain: float) -> ComplexArray:
    """Integers with in-phase and quadrature along the last axis as complex drives."""
    pair = iq.astype(np.float64) * (full_scale_gain / FULL_SCALE)
    return np.asarray(pair[..., 0] + 1j * pair[..., 1])
