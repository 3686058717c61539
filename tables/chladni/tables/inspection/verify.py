"""Whether a table is whole: its bytes, its board, and what the firmware reads of it everywhere."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board.board import Board
from chladni.sim.errors import ChladniError, InputError
from chladni.sim.fields.board_mirrors import board_mirrors
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import read_table_bytes, unpack
from chladni.tables.inspection.owner import board_for
from chladni.tables.responses import TableResponses
from chladni.tables.table import Table

LATTICE = 4
"""Places each way, per region: centres, borders and what is interpolated between them."""
BEYOND = 0.55
"""Half the board's side and a twentieth more: the device keeps such a touch on the board."""


@dataclass(frozen=True)
class Verification:
    """What was checked of a table.

    Attributes
    ----------
    board
        Name of its board.
    places_checked
        At which the firmware's reading was compared, over all sections.
    bytes
        Of the file.
    """

    board: str
    regions: int
    sections: int
    places_checked: int
    bytes: int


def verify_table(path: str | Path, board: str | Path | None = None) -> Verification:
    """Check a table's file whole.

    Parameters
    ----------
    path
        The table (.chl).
    board
        Path of its board's file, or a shipped name; see `board_for`.

    Raises
    ------
    InputError
        The bytes are no table, or not one of the board.
    ChladniError
        The firmware's own code reads other drives or responses from the same bytes.
    """
    # Read once: what is checked is what was unpacked.
    data = read_table_bytes(path)
    table = unpack(data, file=str(path))
    owner = board_for(table, board, file=str(path))
    _check_mirrors(table, owner, str(path))
    firmware = FirmwareReader(data, table.actuators)
    x_um, y_um = _everywhere(table)
    for section in table.sections:
        played = firmware.integers(section.frequency_hz, x_um, y_um)
        if not np.array_equal(played, table.lookup(section, x_um, y_um)):
            raise _other(path, "drives", section.frequency_hz)
    for known in table.responses:
        own = TableResponses(table.regions, known)
        read, coupling = firmware.responses(known.frequency_hz, x_um, y_um)
        is_same = np.array_equal(read, own.floats(x_um, y_um))
        if not is_same or not np.array_equal(coupling, known.coupling):
            raise _other(path, "responses", known.frequency_hz)
    sections = len(table.sections) + len(table.responses)
    return Verification(owner.name, table.grid.count, sections, sections * x_um.size, len(data))


def _other(path: str | Path, kind: str, frequency_hz: float) -> ChladniError:
    return ChladniError(
        f"{path}: the firmware reads other {kind} at {frequency_hz:g} Hz",
        hint="build the table again with this version",
    )


def _check_mirrors(table: Table, owner: Board, file: str) -> None:
    """A mirror that a table uses is its board's."""
    mirrors = board_mirrors(owner)
    for name, own, found in (
        ("mirror_x", table.symmetry.x, mirrors.x),
        ("mirror_y", table.symmetry.y, mirrors.y),
    ):
        if own is not None and own != found:
            raise InputError(name, own, f"{found}, the board's own", file=file)


def _everywhere(table: Table) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Places on a lattice finer than the regions, and a little beyond the board, µm."""
    grid = table.grid
    spans = ((grid.width_um, grid.columns), (grid.length_um, grid.rows))
    x, y = (np.linspace(-BEYOND, BEYOND, LATTICE * cells + 3) * span for span, cells in spans)
    lattice = np.meshgrid(np.rint(x), np.rint(y))
    x_um, y_um = (np.ascontiguousarray(axis.ravel(), dtype=np.int64) for axis in lattice)
    return x_um, y_um
