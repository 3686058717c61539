"""How two tables differ: in their headers, and in the drives of a frequency that both have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import is_of
from chladni.tables.responses import TableResponses
from chladni.tables.table import ResponsesSection, Section, Table

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
    compared_responses_hz
        Frequency of the compared responses; None as `compared_hz`.
    responses_that_differ
        How many regions have others.
    largest_of_responses, largest_of_coupling
        Largest difference of a response or an own compliance, and of a number of the coupling, of
        the largest.
    """

    header: dict[str, list[Any]]
    compared_hz: float | None = None
    regions_that_differ: int | None = None
    largest: float | None = None
    largest_at_region: int | None = None
    compared_responses_hz: float | None = None
    responses_that_differ: int | None = None
    largest_of_responses: float | None = None
    largest_of_coupling: float | None = None


def difference(one: Table, other: Table) -> TableDifference:
    """Compare two tables; a drive's common phase is free, so it does not count."""
    left, right = _header(one), _header(other)
    header = {key: [left[key], right[key]] for key in left if left[key] != right[key]}
    if is_of(one.board_fingerprint, other.board_fingerprint):
        header.pop("board_fingerprint", None)
    if one.grid != other.grid or one.actuators != other.actuators:
        return TableDifference(header)
    return TableDifference(header, **_of_drives(one, other), **_of_responses(one, other))


def _of_drives(one: Table, other: Table) -> dict[str, Any]:
    common = _common(one.sections, other.sections)
    if common is None:
        return {}
    pair = [(table, table.section(common)) for table in (one, other)]
    drives = [table.drives(own) / own.full_scale_gain for table, own in pair]
    steps = np.array([_step(*both) for both in zip(*drives, strict=True)])
    return {
        "compared_hz": common,
        "regions_that_differ": int(np.count_nonzero(steps > SAME)),
        "largest": float(steps.max()),
        "largest_at_region": int(steps.argmax()),
    }


def _of_responses(one: Table, other: Table) -> dict[str, Any]:
    common = _common(one.responses, other.responses)
    if common is None:
        return {}
    left, right = (TableResponses.of(table, common) for table in (one, other))
    steps = np.abs(left.of_regions() * left.units - right.of_regions() * right.units)
    steps /= np.maximum(left.units, right.units)
    coupling = np.abs(left.coupling - right.coupling).max()
    largest = max(np.abs(left.coupling).max(), np.abs(right.coupling).max())
    return {
        "compared_responses_hz": common,
        "responses_that_differ": int(np.count_nonzero(steps.max(axis=1) > SAME)),
        "largest_of_responses": float(steps.max()),
        "largest_of_coupling": float(coupling / largest) if largest else 0.0,
    }


def _common(
    one: Sequence[Section | ResponsesSection], other: Sequence[Section | ResponsesSection]
) -> float | None:
    """The first frequency that both have."""
    known = {section.frequency_hz for section in other}
    return next((own.frequency_hz for own in one if own.frequency_hz in known), None)


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
        "responses_hz": [section.frequency_hz for section in table.responses],
        "full_scales_pm": [section.full_scale_pm for section in table.responses],
        "own_full_scales_pm": [section.own_full_scale_pm for section in table.responses],
        "bits": table.bits,
    }
