"""A drive table in memory, as the device has it: integers, regions and mirrors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.region_grid import RegionGrid
from chladni.sim.board.board import Board
from chladni.sim.errors import ArgumentError, InputError
from chladni.tables.layout import BITS, FULL_SCALE, RESPONSES
from chladni.tables.lookup import images, mixing
from chladni.tables.mirror_symmetry import NO_MIRRORS, MirrorSymmetry
from chladni.tables.stored_regions import StoredRegions

ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Limits:
    """What the device keeps to, from the board file; µs."""

    ramp_us: int
    touch_timeout_us: int
    max_on_us: int


def limits_of(board: Board) -> Limits:
    """The limits of a board's file."""
    own = board.electronics
    return Limits(
        ramp_us=round(own.ramp_ms * 1000.0),
        touch_timeout_us=round(own.touch_timeout_ms * 1000.0),
        max_on_us=round(own.max_on_s * 1e6),
    )


@dataclass(frozen=True)
class Section:
    """The drives of one frequency and objective.

    Attributes
    ----------
    labels
        uint8, shape (stored regions,): regions of one label belong to one branch of optima, and the
        device interpolates between them.
    crossings
        uint8, shape (labels, 2): what becomes of a label across the mirrors in x and y
        (`CUT`, `JOINED` or `NEGATED`).
    iq
        int16, shape (stored regions, actuators, 2): in-phase and quadrature, where 32767 stands for
        `full_scale_gain`; whole multiples of what the lowest of the table's bits is worth.
    """

    frequency_hz: float
    objective: str
    full_scale_gain: float
    labels: NDArray[np.uint8]
    crossings: NDArray[np.uint8]
    iq: NDArray[np.int16]


@dataclass(frozen=True)
class ReckonedFinger:
    """What drives for several fingers reckon with; 0 where it is not known.

    Attributes
    ----------
    full_force_un
        Peak force that one coil can give in a touch without end, µN.
    threshold_pm
        Displacement that a resting fingertip just feels, RMS over it, peak in time, pm.
    stiffness
        Force over displacement of a fingertip that presses, of numbers that float32 holds, N/m.
    """

    full_force_un: int = 0
    threshold_pm: int = 0
    stiffness: complex = 0j


@dataclass(frozen=True)
class ResponsesSection:
    """What each coil does at the stored regions' centres, at one frequency.

    Attributes
    ----------
    full_scale_pm, own_full_scale_pm
        Picometres per newton that 32767 stands for: of coils, of a fingertip's own compliance.
    coupling
        How one finger's push moves another (drives/fingers/coupling.py), complex128 of numbers that
        float32 holds, shape (actuators, actuators), symmetric, N/m.
    iq
        int16, shape (stored regions, actuators + 1, 2): real and imaginary part of each coil's
        response and, last, of the own compliance, with as many bits as drives have.
    finger
        What presses, what it feels, and what coils can push.
    """

    frequency_hz: float
    full_scale_pm: int
    own_full_scale_pm: int
    coupling: ComplexArray
    iq: NDArray[np.int16]
    finger: ReckonedFinger = ReckonedFinger()


SomeSection = TypeVar("SomeSection", Section, ResponsesSection)


@dataclass(frozen=True)
class Table:
    """A drive table in memory: what all its sections share, and the sections.

    A device plays the first section unless it is asked for another frequency. Its integers are
    stored in `bits` bits each. `sections` are of drives; a table has these, `responses`, or both.
    """

    board_name: str
    board_fingerprint: int
    grid: RegionGrid
    limits: Limits
    sections: tuple[Section, ...]
    symmetry: MirrorSymmetry = NO_MIRRORS
    bits: int = BITS[-1]
    responses: tuple[ResponsesSection, ...] = ()

    @cached_property
    def regions(self) -> StoredRegions:
        """Its regions, and where their drives are found."""
        return StoredRegions(self.grid, self.symmetry)

    @property
    def actuators(self) -> int:
        """Channels of every drive."""
        if self.sections:
            return int(self.sections[0].iq.shape[1])
        return int(self.responses[0].iq.shape[1]) - 1

    def section(self, frequency_hz: float | None = None) -> Section:
        """The drives of a frequency, or the first.

        Raises
        ------
        InputError
            There are none; names those there are.
        """
        return _of_frequency(self.sections, frequency_hz, "drives", RESPONSES)

    def responses_section(self, frequency_hz: float | None = None) -> ResponsesSection:
        """The responses of a frequency, or the first; raises as `section` does."""
        return _of_frequency(self.responses, frequency_hz, RESPONSES, "drives")

    def sections_at(
        self, frequency_hz: float | None = None
    ) -> tuple[Section | None, ResponsesSection | None]:
        """Drives and responses of a frequency, or of the first; one of them may be missing.

        Raises
        ------
        ArgumentError
            Both are missing; names the frequencies there are.
        """
        known = [one.frequency_hz for one in self.sections]
        known += [one.frequency_hz for one in self.responses]
        wanted = known[0] if frequency_hz is None else frequency_hz
        drives = _with_frequency(self.sections, wanted)
        responses = _with_frequency(self.responses, wanted)
        if drives is None and responses is None:
            raise _no_such(wanted, known)
        return drives, responses

    def region_iq(self, section: Section) -> NDArray[np.int16]:
        """Drives of all regions, int16 of shape (regions, actuators, 2), mirrors applied."""
        return images(self.symmetry, section, self.regions.everywhere, section.iq)

    def drives(self, section: Section) -> ComplexArray:
        """Drives of all regions as the table holds them, shape (regions, actuators)."""
        return dequantise(self.region_iq(section), section.full_scale_gain)

    def lookup(self, section: Section, x_um: IntArray, y_um: IntArray) -> NDArray[np.int16]:
        """What the device plays at places, interpolated, int16 of shape (places, actuators, 2)."""
        mixed = mixing(self.regions, section, self.actuators, x_um, y_um)
        return mixed.of_integers(section.iq)

    def drive_at(self, section: Section, x_um: int, y_um: int) -> ComplexArray:
        """What the device plays at a place, interpolated, shape (actuators,)."""
        found = self.lookup(section, np.array([x_um]), np.array([y_um]))
        return dequantise(found[0], section.full_scale_gain)


def _of_frequency(
    sections: Sequence[SomeSection], frequency_hz: float | None, kind: str, others: str
) -> SomeSection:
    if not sections:
        hint = "`chladni table build --for both` makes both"
        raise InputError("table", f"only {others}", f"a section of {kind}", hint=hint)
    if frequency_hz is None:
        return sections[0]
    found = _with_frequency(sections, frequency_hz)
    if found is None:
        raise _no_such(frequency_hz, [one.frequency_hz for one in sections])
    return found


def _with_frequency(sections: Sequence[SomeSection], frequency_hz: float) -> SomeSection | None:
    """Frequencies are whole numbers of mHz; NaN and infinity are none."""
    return next((one for one in sections if abs(one.frequency_hz - frequency_hz) < 0.5e-3), None)


def _no_such(frequency_hz: float, known: Sequence[float]) -> ArgumentError:
    texts = ", ".join(dict.fromkeys(f"{one:g}" for one in known))
    return ArgumentError("frequency_hz", f"{frequency_hz:g} Hz", f"one of the table's: {texts} Hz")


def quantise(drives: ComplexArray, full_scale_gain: float, bits: int = 16) -> NDArray[np.int16]:
    """Drives of any shape as integers, in-phase and quadrature along a new last axis.

    Of fewer than 16 bits they are multiples of 2^(16 − bits), none beyond full scale.
    """
    step = 1 << (16 - bits)
    most = FULL_SCALE // step
    scaled = np.stack((drives.real, drives.imag), axis=-1) * (FULL_SCALE / full_scale_gain / step)
    # Rounding both parts up may take a gain at full scale beyond it: then both are cut.
    rounded = np.clip(np.rint(scaled), -most, most)
    is_loud = ((rounded * step) ** 2).sum(axis=-1, keepdims=True) > FULL_SCALE**2
    return np.asarray((np.where(is_loud, np.trunc(scaled), rounded) * step).astype(np.int16))


def dequantise(iq: NDArray[np.int16], full_scale_gain: float) -> ComplexArray:
    """Integers with in-phase and quadrature along the last axis as complex drives."""
    pair = iq.astype(np.float64) * (full_scale_gain / FULL_SCALE)
    return np.asarray(pair[..., 0] + 1j * pair[..., 1])
