"""How two tables differ: in their headers, and in the drives of a frequency that both have."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.tables.table import Table

ComplexArray = NDArray[np.complex128]

SAME = 1e-6
"""Drives closer than this, of full scale, are the same but for rounding."""


@dataclass(frozen=True)
class TableDifference:
    """How two tables differ.

    Attributes
    ----------
    header
        Fields that differ, each with both values.
    compared_hz
        Frequency of the compared drives; None, like all below, where grids or actuators differ or
        no frequency is common.
    regions_that_differ
        How many have another drive.
    largest
        Largest difference of a gain, of full scale.
    largest_at_region
        Where it is.
    """

    header: dict[str, list[Any]]
    compared_hz: float | None = None
    regions_that_differ: int | None = None
    largest: float | None = None
    largest_at_region: int | None = None


def difference(one: Table, other: Table) -> TableDifference:
    """Compare two tables; a drive's common phase is free, so it does not count."""
    left, right = _header(one), _header(other)
    header = {key: [left[key], right[key]] for key in left if left[key] != right[key]}
    frequencies = {section.frequency_hz for section in other.sections}
    common = [
        section.frequency_hz for section in one.sections if section.frequency_hz in frequencies
    ]
    if one.grid != other.grid or one.actuators != other.actuators or not common:
        return TableDifference(header)
    pair = [(table, table.section(common[0])) for table in (one, other)]
    drives = [table.drives(own) / own.full_scale_gain for table, own in pair]
    steps = np.array([_step(*both) for both in zip(*drives, strict=True)])
    return TableDifference(
        header=header,
        compared_hz=common[0],
        regions_that_differ=int(np.count_nonzero(steps > SAME)),
        largest=float(steps.max()),
        largest_at_region=int(steps.argmax()),
    )


def _step(one: ComplexArray, other: ComplexArray) -> float:
    """Largest difference of two drives, the common phase that suits them best taken out."""
    turn = np.vdot(other, one)
    turned = other * (turn / abs(turn)) if abs(turn) > 0.0 else other
    return float(np.abs(one - turned).max())


def _header(table: Table) -> dict[str, Any]:
    return {
        "board_name": table.board_name,
        "board_fingerprint": f"{table.board_fingerprint:#018x}",
        "actuators": table.actuators,
        **asdict(table.grid),
        **asdict(table.limits),
        "mirror_x": table.symmetry.x and list(table.symmetry.x),
        "mirror_y": table.symmetry.y and list(table.symmetry.y),
        "frequencies_hz": [section.frequency_hz for section in table.sections],
        "objectives": [section.objective for section in table.sections],
        "full_scale_gains": [section.full_scale_gain for section in table.sections],
        "labels": [len(section.crossings) for section in table.sections],
        "bits": table.bits,
    }
