"""The drive of a place between region centres, in integers: the reference of the device's lookup.

A place in a mirrored half is first folded over to the stored one. Four centres surround it. Those
with the nearest one's label belong to the same branch of optima and are interpolated; one across a
cut gives way to the corner next to it, so that drives stay continuous within a branch and jump only
half-way between centres. Then the mirror exchanges the actuators.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from chladni.tables.folding import Cells
from chladni.tables.regions import FRACTION_BITS, position

if TYPE_CHECKING:
    from chladni.tables.table import Section, Table

IntArray = NDArray[np.int64]

CUT, JOINED, NEGATED = 0, 1, 2
"""What becomes of a label across a mirror: no interpolation; interpolation; the same with the image
turned by half a wave, as the drive of an odd field continues."""
NO_LABEL = 255
ONE = 1 << FRACTION_BITS


def lookup(table: Table, section: Section, x_um: IntArray, y_um: IntArray) -> NDArray[np.int16]:
    """Drives at places, int16 of shape (places, actuators, 2).

    Parameters
    ----------
    x_um, y_um
        Micrometres from the board's centre, shape (places,). Places off the board get the drive of
        the nearest place on it.
    """
    grid, folding = table.grid, table.folding
    x, y = (
        _between(offset, span, cells, nodes, order is not None)
        for offset, span, cells, nodes, order in zip(
            grid.offsets(x_um, y_um), (grid.width_um, grid.length_um), (grid.columns, grid.rows),
            folding.nodes(grid), (folding.x, folding.y), strict=True,
        )
    )  # fmt: skip
    # Corners in the order 00, 10, 01, 11: bit 0 is x, bit 1 is y.
    corners = [folding.cells(grid, *at) for at in (
        (x.low, y.low), (x.high, y.low), (x.low, y.high), (x.high, y.high))]  # fmt: skip
    values = np.stack([unfolded(table, section, at.stored, at.flips) for at in corners])
    labels = np.stack([labels_of(section, at) for at in corners])
    every = np.arange(values.shape[1])
    nearest = (x.fraction >= ONE // 2) + 2 * (y.fraction >= ONE // 2)
    label = labels[nearest, every]
    taken = _without_strangers(labels == label)
    sign = signs_of(section, label, np.stack((x.is_flipped, y.is_flipped), axis=-1))
    top = sign * ONE * y.fraction
    bottom = sign * ONE * ONE - top
    right = [(row * x.fraction) >> FRACTION_BITS for row in (bottom, top)]
    weights = np.stack((bottom - right[0], right[0], top - right[1], right[1]))
    mixed = values.astype(np.int64)[taken, every]
    total = (mixed * weights[:, :, None, None]).sum(axis=0)
    mix = (total >> (2 * FRACTION_BITS)).astype(np.int16)
    orders = folding.orders(table.actuators)[x.is_flipped * 1, y.is_flipped * 1]
    return np.asarray(np.take_along_axis(mix, orders[:, :, None], axis=1))


class Branches(Protocol):
    """What tells branches apart: a table's section, or drives that are to become one."""

    @property
    def labels(self) -> NDArray[np.uint8]:
        """Of the stored regions."""

    @property
    def crossings(self) -> NDArray[np.uint8]:
        """Of every label across the mirrors in x and y."""


class _Between(NamedTuple):
    """Where places lie between two neighbouring cells' centres; the fraction is in 1/256."""

    low: IntArray
    high: IntArray
    fraction: IntArray
    is_flipped: NDArray[np.bool_]


def _between(
    offset_um: IntArray, span_um: int, cells: int, nodes: int, is_mirrored: bool
) -> _Between:
    flipped = (offset_um > (span_um - 1) // 2) & is_mirrored
    at = position(np.where(flipped, span_um - 1 - offset_um, offset_um), span_um, cells)
    # The centre of a cell is half a cell from its edge; beyond the outermost centres all is flat.
    inner = np.maximum(at - ONE // 2, 0)
    low = inner >> FRACTION_BITS
    return _Between(low, np.minimum(low + 1, nodes - 1), inner & (ONE - 1), flipped)


def labels_of(section: Branches, cells: Cells) -> IntArray:
    """Labels of cells; none for an image across a cut."""
    label = section.labels[cells.stored].astype(np.int64)
    is_cut = np.any(cells.flips & (section.crossings[label] == CUT), axis=-1)
    return np.where(is_cut, NO_LABEL, label)


def signs_of(section: Branches, label: IntArray, flips: NDArray[np.bool_]) -> IntArray:
    """−1 where the image of a label's drive is its negative."""
    odd = np.logical_xor.reduce((section.crossings[label] == NEGATED) & flips, axis=-1)
    return np.where(odd, -1, 1)


def unfolded(
    table: Table, section: Section, stored: NDArray[np.intp], flips: NDArray[np.bool_]
) -> NDArray[np.int16]:
    """Drives of cells, (cells, actuators, 2): stored ones with their mirrors applied."""
    orders = table.folding.orders(table.actuators)[flips[:, 0] * 1, flips[:, 1] * 1]
    values = section.iq[stored[:, None], orders]
    signs = signs_of(section, section.labels[stored].astype(np.int64), flips)
    return np.asarray((values * signs[:, None, None]).astype(np.int16))


def _without_strangers(member: NDArray[np.bool_]) -> IntArray:
    """The corner that stands for each (4, places): itself, or the next along x, y, or across."""
    taken = np.empty(member.shape, dtype=np.int64)
    for k in range(4):
        others = np.where(member[k ^ 1], k ^ 1, np.where(member[k ^ 2], k ^ 2, k ^ 3))
        taken[k] = np.where(member[k], k, others)
    return taken
