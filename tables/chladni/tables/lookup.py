"""The drive of a place between region centres, in integers: the reference of the device's lookup.

A place in a mirrored half is first taken over to the stored one. Four centres surround it. Those
with the nearest one's label belong to the same branch of optima and are interpolated; one across a
cut gives way to the corner next to it, so that drives stay continuous within a branch and jump only
half-way between centres. Then the mirror exchanges the actuators.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.region_grid import FRACTION_BITS, position
from chladni.tables.mirror_symmetry import MirrorSymmetry, is_cut_off, signs
from chladni.tables.stored_regions import Cells, StoredRegions

IntArray = NDArray[np.int64]
ComplexArray = NDArray[np.complex128]

NO_LABEL = 255
ONE = 1 << FRACTION_BITS


class Labelled(Protocol):
    """What belongs together: a table's section, or drives that are to become one."""

    @property
    def labels(self) -> NDArray[np.uint8]:
        """Of the stored regions."""

    @property
    def crossings(self) -> NDArray[np.uint8]:
        """Of every label across the mirrors in x and y."""


@dataclass(frozen=True)
class Mixing:
    """Of which stored gains the drives of places are mixed, four corners to a place.

    Attributes
    ----------
    stored
        Position among the stored regions, shape (4, places).
    channels
        The stored channel that each channel takes its gain from, shape (4, places, actuators).
    weights
        Whole numbers of 1/65536, negative where a mirror negates, shape (4, places).
    """

    stored: IntArray
    channels: IntArray
    weights: IntArray

    def of_integers(self, iq: NDArray[np.int16]) -> NDArray[np.int16]:
        """Drives as the device has them, (places, actuators, 2), of a section's integers."""
        gains = iq[self.stored[..., None], self.channels].astype(np.int64)
        total = (gains * self.weights[..., None, None]).sum(axis=0)
        return np.asarray((total >> (2 * FRACTION_BITS)).astype(np.int16))

    def of_drives(self, drives: ComplexArray) -> ComplexArray:
        """The same of unrounded drives (stored regions, actuators), shape (places, actuators)."""
        gains = drives[self.stored[..., None], self.channels]
        return np.asarray((gains * self.weights[..., None]).sum(axis=0) / ONE**2)


def mixing(
    regions: StoredRegions, labelled: Labelled, actuators: int, x_um: IntArray, y_um: IntArray
) -> Mixing:
    """How the drives of places are mixed.

    Parameters
    ----------
    x_um, y_um
        Micrometres from the board's centre, shape (places,). Places off the board get the drive of
        the nearest place on it.
    """
    grid, symmetry = regions.grid, regions.symmetry
    x, y = (
        _between(*along)
        for along in zip(
            grid.offsets(x_um, y_um),
            (grid.width_um, grid.length_um),
            (grid.columns, grid.rows),
            regions.nodes,
            symmetry.has,
            strict=True,
        )
    )
    # Corners in the order 00, 10, 01, 11: bit 0 is x, bit 1 is y.
    corners = [
        regions.cells(*at)
        for at in ((x.low, y.low), (x.high, y.low), (x.low, y.high), (x.high, y.high))
    ]
    labels = np.stack([_labels_of(labelled, at) for at in corners])
    nearest = (x.fraction >= ONE // 2) + 2 * (y.fraction >= ONE // 2)
    label = labels[nearest, np.arange(labels.shape[1])]
    top = ONE * y.fraction
    bottom = ONE * ONE - top
    right = [(row * x.fraction) >> FRACTION_BITS for row in (bottom, top)]
    weights = np.stack((bottom - right[0], right[0], top - right[1], right[1]))
    weights = _within_label(weights, labels == label)
    turned = np.stack((x.is_flipped, y.is_flipped), axis=-1)
    of_place = symmetry.channels(actuators, turned)
    channels = [
        np.take_along_axis(symmetry.channels(actuators, at.flips), of_place, axis=1)
        for at in corners
    ]
    own = signs(labelled.crossings, label, turned)
    turns = [own * signs(labelled.crossings, label, at.flips) for at in corners]
    stored = np.stack([at.stored for at in corners])
    return Mixing(stored, np.stack(channels), weights * np.stack(turns))


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


def _labels_of(labelled: Labelled, cells: Cells) -> IntArray:
    """Labels of cells; none for an image across a cut."""
    label = labelled.labels[cells.stored].astype(np.int64)
    return np.where(is_cut_off(labelled.crossings, label, cells.flips), NO_LABEL, label)


def images(
    symmetry: MirrorSymmetry, labelled: Labelled, cells: Cells, iq: NDArray[np.int16]
) -> NDArray[np.int16]:
    """Drives of cells, (cells, actuators, 2): stored ones with their mirrors applied."""
    channels = symmetry.channels(iq.shape[1], cells.flips)
    label = labelled.labels[cells.stored].astype(np.int64)
    sign = signs(labelled.crossings, label, cells.flips)
    return np.asarray((iq[cells.stored[:, None], channels] * sign[:, None, None]).astype(np.int16))


def _within_label(weights: IntArray, has_label: NDArray[np.bool_]) -> IntArray:
    """Weights (4, places), those of corners of other labels handed to one of the label.

    To the corner next along x, else along y, else across; the nearest one always has it.
    """
    result = np.zeros_like(weights)
    every = np.arange(weights.shape[1])
    for k in range(4):
        others = np.where(has_label[k ^ 1], k ^ 1, np.where(has_label[k ^ 2], k ^ 2, k ^ 3))
        result[np.where(has_label[k], k, others), every] += weights[k]
    return result
