"""Responses in a table: made of a solved board, and read as a device reads them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from chladni.drives.fingers.responses import Responses
from chladni.sim.board.quantity import MM
from chladni.tables.lookup import Mixing, mixing
from chladni.tables.mirror_symmetry import JOINED
from chladni.tables.stored_regions import StoredRegions
from chladni.tables.table import ResponsesSection, Table, dequantise, quantise

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]

METRE_UM = 1e6
METRE_PM = 1e12


@dataclass(frozen=True)
class _OneLabel:
    """Responses are smooth: all of one label, which goes on across mirrors as it is."""

    labels: NDArray[np.uint8]
    crossings: NDArray[np.uint8]


@dataclass(frozen=True)
class TableResponses:
    """A plate as a table has it (`drives.fingers.Plate`), bit by bit what the firmware reads.

    Places are rounded to micrometres; those off the board have the responses of the nearest place
    on it.
    """

    regions: StoredRegions
    section: ResponsesSection

    @classmethod
    def of(cls, table: Table, frequency_hz: float | None = None) -> TableResponses:
        """A table's responses of a frequency, or the first; `InputError` if there are none."""
        return cls(table.regions, table.responses_section(frequency_hz))

    @property
    def coupling(self) -> ComplexArray:
        """M, shape (actuators, actuators), N/m."""
        return self.section.coupling

    @cached_property
    def _units(self) -> FloatArray:
        """m/N that 1 stands for, of each coil and of the own compliance."""
        own = self.section
        scales = [own.full_scale_pm] * len(own.coupling) + [own.own_full_scale_pm]
        return np.array(scales) / METRE_PM

    def at(self, places: FloatArray) -> ComplexArray:
        """What each coil does at places (k, 2), m; shape (k, actuators), m/N."""
        return self._all_at(places)[:, :-1]

    def own_at(self, places: FloatArray) -> ComplexArray:
        """A fingertip's own compliance at places (k, 2), m; shape (k,), m/N."""
        return self._all_at(places)[:, -1]

    def _all_at(self, places: FloatArray) -> ComplexArray:
        x_um, y_um = np.rint(np.asarray(places) * METRE_UM).astype(np.int64).T
        return dequantise(self.integers(x_um, y_um), 1.0) * self._units

    def integers(self, x_um: IntArray, y_um: IntArray) -> NDArray[np.int16]:
        """What the device interpolates, int16 of shape (places, actuators + 1, 2)."""
        return self._mixing(x_um, y_um).of_integers(self.section.iq)

    def _mixing(self, x_um: IntArray, y_um: IntArray) -> Mixing:
        actuators = len(self.coupling)
        one = _OneLabel(
            np.zeros(self.regions.count, np.uint8), np.full((1, 2), JOINED, dtype=np.uint8)
        )
        mixed = mixing(self.regions, one, actuators, x_um, y_um)
        # A fingertip's own compliance stands for itself on the other side of a mirror.
        own = np.full((*mixed.channels.shape[:2], 1), actuators)
        return replace(mixed, channels=np.concatenate((mixed.channels, own), axis=2))


def section_of(known: Responses, regions: StoredRegions, bits: int) -> ResponsesSection:
    """The responses of a board at the centres of its stored regions, as integers of so many bits.

    Raises
    ------
    InputError
        When the table is packed, if a response is beyond 4.29 mm/N.
    """
    numbers = regions.numbers.tolist()
    places = np.array([regions.grid.centre_mm(region) for region in numbers]) * MM
    coils, own = known.at(places), known.own_at(places)[:, None]
    scales = [int(np.ceil(float(np.abs(part).max()) * METRE_PM)) or 1 for part in (coils, own)]
    parts = [
        quantise(part, scale / METRE_PM, bits)
        for part, scale in zip((coils, own), scales, strict=True)
    ]
    return ResponsesSection(
        frequency_hz=known.frequency_hz,
        full_scale_pm=scales[0],
        own_full_scale_pm=scales[1],
        coupling=known.coupling.astype(np.complex64).astype(np.complex128),
        iq=np.concatenate(parts, axis=1),
    )
