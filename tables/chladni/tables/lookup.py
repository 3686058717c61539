"""The drive of a place between region centres, in integers: the reference of the device's lookup.

Four centres surround a place. Those with the nearest one's label belong to the same branch of
optima and are interpolated; one across a cut gives its weight to the corners next to it, so that
drives stay continuous within a branch and jump only half-way between centres.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chladni.tables.regions import FRACTION_BITS

if TYPE_CHECKING:
    from chladni.tables.table import Section, Table

IntArray = NDArray[np.int64]

CUT, JOINED, NEGATED = 0, 1, 2
"""What becomes of a label across a mirror: no interpolation; interpolation; the same with the image
turned by half a wave, as the drive of an odd field continues."""
ONE = 1 << FRACTION_BITS


def lookup(table: Table, section: Section, x_um: IntArray, y_um: IntArray) -> NDArray[np.int16]:
    """Drives at places, int16 of shape (places, actuators, 2).

    Parameters
    ----------
    x_um, y_um
        Micrometres from the board's centre, shape (places,). Places off the board get the drive of
        the nearest place on it.
    """
    grid = table.grid
    x, y = (
        _between(at, cells)
        for at, cells in zip(grid.position(x_um, y_um), (grid.columns, grid.rows), strict=True)
    )
    # Corners in the order 00, 10, 01, 11: bit 0 is x, bit 1 is y.
    columns, rows = [x.low, x.high] * 2, [y.low, y.low, y.high, y.high]
    cells = [table.folding.cells(grid, *corner) for corner in zip(columns, rows, strict=True)]
    values = np.stack([unfolded(table, section, cell.stored, cell.flips) for cell in cells])
    labels = np.stack([section.labels[cell.stored] for cell in cells])
    flips = np.stack([cell.flips for cell in cells])
    nearest = (x.fraction >= ONE // 2) + 2 * (y.fraction >= ONE // 2)
    every = np.arange(nearest.size)
    label, flip = labels[nearest, every], flips[nearest, every]
    crosses = section.crossings[label] != CUT
    member = (labels == label) & np.all((flips == flip) | crosses, axis=-1)
    weight_x = np.stack((ONE - x.fraction, x.fraction))
    weight_y = np.stack((ONE - y.fraction, y.fraction))
    weights = np.stack([weight_x[k & 1] * weight_y[k >> 1] for k in range(4)])
    weights = _without_strangers(weights, member)
    total = (values.astype(np.int64) * weights[:, :, None, None]).sum(axis=0)
    return np.asarray(((total + ONE * ONE // 2) >> (2 * FRACTION_BITS)).astype(np.int16))


class _Between(NamedTuple):
    """Where places lie between two neighbouring cells' centres; the fraction is in 1/256."""

    low: IntArray
    high: IntArray
    fraction: IntArray


def _between(at: IntArray, cells: int) -> _Between:
    # The centre of a cell is half a cell from its edge; beyond the outermost centres all is flat.
    inner = np.clip(at - ONE // 2, 0, (cells - 1) * ONE)
    low = inner >> FRACTION_BITS
    high = np.where(at < ONE // 2, low, np.minimum(low + 1, cells - 1))
    return _Between(low, high, inner & (ONE - 1))


def unfolded(
    table: Table, section: Section, stored: NDArray[np.intp], flips: NDArray[np.bool_]
) -> NDArray[np.int16]:
    """Drives of cells, (cells, actuators, 2): stored ones with their mirrors applied."""
    orders = table.folding.orders(table.actuators)[flips[:, 0] * 1, flips[:, 1] * 1]
    values = section.iq[stored[:, None], orders]
    odd = section.crossings[section.labels[stored]] == NEGATED
    negated = np.logical_xor.reduce(odd & flips, axis=-1)
    return np.asarray(np.where(negated[:, None, None], -values, values))


def _without_strangers(weights: IntArray, member: NDArray[np.bool_]) -> IntArray:
    """Weights (4, places) that leave out corners which are no members, their sums kept."""
    kept = weights * member
    for k in range(4):
        one, other, opposite = k ^ 1, k ^ 2, k ^ 3
        lost = np.where(member[k], 0, weights[k])
        half = lost >> 1
        both = member[one] & member[other]
        kept[one] += np.where(both, half, np.where(member[one], lost, 0))
        kept[other] += np.where(both, lost - half, np.where(member[one], 0, lost * member[other]))
        kept[opposite] += np.where(member[one] | member[other], 0, lost)
    return kept
