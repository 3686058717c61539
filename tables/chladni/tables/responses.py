"""Responses in a table: their lookup, as the firmware does it, and their bytes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import InputError
from chladni.tables.layout import (
    FULL_SCALE,
    OBJECTIVE_NAMES,
    RESPONSES,
    RESPONSES_FIELDS,
    RESPONSES_STRUCT,
    Refuse,
    as_bytes,
    as_integers,
    is_loud,
    responses_head_bytes,
    responses_record_bytes,
)
from chladni.tables.lookup import Mixing, mixing
from chladni.tables.mirror_symmetry import JOINED
from chladni.tables.stored_regions import StoredRegions
from chladni.tables.table import ReckonedFinger, ResponsesSection, Table, dequantise

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]

METRE_UM = 1e6
METRE_PM = 1e12
Refusals = dict[str, Refuse]
"""What makes an error, by the name of the firmware's `TableStatus`."""


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

    @property
    def finger(self) -> ReckonedFinger:
        """What presses, what it feels, and what coils can push."""
        return self.section.finger

    @cached_property
    def units(self) -> FloatArray:
        """m/N that full scale stands for, of each coil and of the own compliance."""
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
        return dequantise(self.integers(x_um, y_um), 1.0) * self.units

    def of_regions(self) -> ComplexArray:
        """Responses of all regions, mirrors applied, in units of full scale.

        Shape (regions, actuators + 1), the own compliance last.
        """
        cells, actuators = self.regions.everywhere, len(self.coupling)
        channels = self.regions.symmetry.channels(actuators, cells.flips)
        own = np.full((len(channels), 1), actuators)
        every = np.concatenate((channels, own), axis=1)
        return dequantise(self.section.iq[cells.stored[:, None], every], 1.0)

    def floats(self, x_um: IntArray, y_um: IntArray) -> NDArray[np.complex64]:
        """Responses in m/N as the device has them, float32, shape (places, actuators + 1)."""
        own = self.section
        scales = [own.full_scale_pm] * len(own.coupling) + [own.own_full_scale_pm]
        units = np.array(scales, np.float32) * (np.float32(1e-12) / np.float32(FULL_SCALE))
        parts = self.integers(x_um, y_um).astype(np.float32) * units[:, None]
        return np.ascontiguousarray(parts).view(np.complex64)[..., 0]

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


def header_values(section: ResponsesSection) -> dict[str, Any]:
    """Fields of the section's header."""
    return {
        "frequency_millihertz": round(section.frequency_hz * 1000.0),
        "full_scale": section.full_scale_pm,
        "objective": OBJECTIVE_NAMES.index(RESPONSES),
        "labels": 0,
        "reserved": 0,
    }


def check_responses(section: ResponsesSection, cells: int, actuators: int, bits: int) -> None:
    """Raise `InputError` unless these responses fit a table of such cells, channels and bits."""
    wanted = ((cells, actuators + 1, 2), (actuators, actuators))
    if (section.iq.shape, section.coupling.shape) != wanted:
        shapes = (section.iq.shape, section.coupling.shape)
        raise InputError("table.responses", shapes, f"responses and coupling of shapes {wanted}")
    if np.any(section.iq & ((1 << (16 - bits)) - 1)):
        expected = f"integers of {bits} bits, in steps of {1 << (16 - bits)}"
        raise InputError("table.responses", "finer steps", expected)
    if is_loud(section.iq):
        raise InputError("table.responses", "one beyond full scale", f"at most {FULL_SCALE}")
    if not 1 <= section.own_full_scale_pm <= 0xFFFFFFFF:
        expected = f"1 to {0xFFFFFFFF} pm/N"
        raise InputError("table.own_full_scale", section.own_full_scale_pm, expected)
    finger = section.finger
    for name, value in (("full_force", finger.full_force_un), ("threshold", finger.threshold_pm)):
        if not 0 <= value <= 0xFFFFFFFF:
            raise InputError(f"table.{name}", value, f"0 to {0xFFFFFFFF}")
    for name, numbers in (("coupling", section.coupling), ("stiffness", finger.stiffness)):
        parts = np.array([np.real(numbers), np.imag(numbers)], dtype=np.float64)
        if not np.all(np.abs(parts) <= np.finfo(np.float32).max):
            raise InputError(f"table.{name}", "NaN or infinity", "numbers that float32 holds")
    if not np.array_equal(section.coupling, section.coupling.T):
        raise InputError("table.coupling", "another matrix", "a symmetric matrix")


def pack_responses(section: ResponsesSection, bits: int) -> bytes:
    """All bytes behind the section's header."""
    upper = section.coupling[np.triu_indices(len(section.coupling))].astype("<c8")
    records = as_bytes(section.iq.astype(np.int64) >> (16 - bits), bits)
    finger = section.finger
    head = RESPONSES_STRUCT.pack(
        section.own_full_scale_pm,
        finger.full_force_un,
        finger.threshold_pm,
        finger.stiffness.real,
        finger.stiffness.imag,
    )
    return head + upper.tobytes() + records.tobytes()


def responses_bytes(cells: int, actuators: int, bits: int) -> int:
    """How many those are."""
    return responses_head_bytes(actuators) + cells * responses_record_bytes(actuators, bits)


def unpack_responses(
    data: bytes,
    values: dict[str, Any],
    head: dict[str, Any],
    cells: int,
    name: str,
    refuse: Refusals,
) -> ResponsesSection:
    """The responses in the bytes behind a section's header, whose fields are `values`."""
    actuators, bits = head["actuators"], head["bits"]
    names = [field.name for field in RESPONSES_FIELDS]
    before = dict(zip(names, RESPONSES_STRUCT.unpack_from(data), strict=True))
    if before["own_full_scale"] == 0:
        raise refuse["kBadField"](f"{name} own_full_scale", 0, "1 pm/N or more")
    finger = ReckonedFinger(
        before["full_force"],
        before["threshold"],
        complex(before["stiffness"], before["stiffness_imaginary"]),
    )
    begin = responses_head_bytes(actuators)
    upper = np.frombuffer(data[RESPONSES_STRUCT.size : begin], "<c8")
    for part, numbers in (("stiffness", finger.stiffness), ("coupling", upper)):
        if not np.all(np.isfinite(numbers)):
            raise refuse["kBadDrives"](f"{name} {part}", "NaN or infinity", "finite numbers")
    rows, columns = np.triu_indices(actuators)
    coupling = np.zeros((actuators, actuators), dtype=np.complex128)
    coupling[rows, columns] = coupling[columns, rows] = upper
    record = responses_record_bytes(actuators, bits)
    records = np.frombuffer(data[begin:], np.uint8).reshape(cells, record)
    iq = as_integers(records, actuators + 1, bits) << (16 - bits)
    if is_loud(iq):
        raise refuse["kBadDrives"](f"{name} responses", "one beyond full scale", f"{FULL_SCALE}")
    return ResponsesSection(
        frequency_hz=values["frequency_millihertz"] / 1000.0,
        full_scale_pm=values["full_scale"],
        own_full_scale_pm=before["own_full_scale"],
        coupling=coupling,
        iq=iq.astype(np.int16),
        finger=finger,
    )
