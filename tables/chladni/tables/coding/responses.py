"""The bytes of a section of responses behind its header: own scale, coupling, records."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import InputError
from chladni.tables.coding.integers import as_bytes, as_integers, is_loud
from chladni.tables.layout import (
    FULL_SCALE,
    OBJECTIVE_NAMES,
    OWN_SCALE_BYTES,
    RESPONSES,
    Refuse,
    responses_head_bytes,
    responses_record_bytes,
)
from chladni.tables.table import ResponsesSection

ComplexArray = NDArray[np.complex128]
Refusals = dict[str, Refuse]
"""What makes an error, by the name of the firmware's `TableStatus`."""


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
    parts = np.abs(np.stack((section.coupling.real, section.coupling.imag)))
    if not np.all(parts <= np.finfo(np.float32).max):
        raise InputError("table.coupling", "NaN or infinity", "numbers that float32 holds")
    if not np.array_equal(section.coupling, section.coupling.T):
        raise InputError("table.coupling", "another matrix", "a symmetric matrix")


def pack_responses(section: ResponsesSection, bits: int) -> bytes:
    """All bytes behind the section's header."""
    upper = section.coupling[np.triu_indices(len(section.coupling))].astype("<c8")
    records = as_bytes(section.iq.astype(np.int64) >> (16 - bits), bits)
    return struct.pack("<I", section.own_full_scale_pm) + upper.tobytes() + records.tobytes()


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
    own_full_scale = struct.unpack_from("<I", data)[0]
    if own_full_scale == 0:
        raise refuse["kBadField"](f"{name} own_full_scale", 0, "1 pm/N or more")
    begin = responses_head_bytes(actuators)
    upper = np.frombuffer(data[OWN_SCALE_BYTES:begin], "<c8")
    if not np.all(np.isfinite(upper)):
        raise refuse["kBadDrives"](f"{name} coupling", "NaN or infinity", "finite numbers")
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
        own_full_scale_pm=own_full_scale,
        coupling=coupling,
        iq=iq.astype(np.int16),
    )
