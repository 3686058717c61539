"""Mirror symmetry: which actuator stands in for which, and what becomes of a drive's sign.

Where a board has a mirror, the drive of a region's image is the region's own with the actuators
exchanged. Optima come in branches that may not go on across the mirror, or go on with the other
sign, as the drive of an odd field does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Order = tuple[int, ...]
IndexArray = NDArray[np.intp]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

CUT, JOINED, NEGATED = 0, 1, 2
"""What becomes of a label across a mirror: no interpolation; interpolation; the same with the image
turned by half a wave."""


@dataclass(frozen=True)
class MirrorSymmetry:
    """The order of the actuators that each mirror stands for, in x and in y, or None."""

    x: Order | None = None
    y: Order | None = None

    @property
    def has(self) -> tuple[bool, bool]:
        """Whether there is a mirror in x and in y."""
        return self.x is not None, self.y is not None

    @property
    def flags(self) -> int:
        """Bit 0 for x, bit 1 for y."""
        return int(self.has[0]) | int(self.has[1]) << 1

    def nibbles(self, axis: int) -> int:
        """The order of one mirror, four bits an actuator; 0 without that mirror."""
        order = (self.x, self.y)[axis]
        return sum(image << (4 * k) for k, image in enumerate(order)) if order else 0

    def channels(self, actuators: int, flips: BoolArray) -> IndexArray:
        """The stored channel that each channel plays: flips (…, 2) give shape (…, actuators)."""
        orders = np.empty((2, 2, actuators), dtype=np.intp)
        for flip_x in (0, 1):
            for flip_y in (0, 1):
                order = np.arange(actuators)
                if flip_x and self.x is not None:
                    order = order[list(self.x)]
                if flip_y and self.y is not None:
                    order = order[list(self.y)]
                orders[flip_x, flip_y] = order
        return np.asarray(orders[flips[..., 0] * 1, flips[..., 1] * 1])


def stored_cells(cells: int, is_mirrored: bool) -> int:
    """Cells along one direction that are stored."""
    return (cells + 1) // 2 if is_mirrored else cells


def order_of(nibbles: int, actuators: int) -> Order:
    """The order in four bits an actuator.

    Raises
    ------
    ValueError
        It is none of the actuators, or does not undo itself.
    """
    order = tuple((nibbles >> (4 * k)) & 15 for k in range(actuators))
    if nibbles >> (4 * actuators) or sorted(order) != list(range(actuators)):
        raise ValueError(hex(nibbles))
    if any(order[order[k]] != k for k in range(actuators)):
        raise ValueError(hex(nibbles))
    return order


def is_cut_off(crossings: NDArray[np.uint8], label: IntArray, flips: BoolArray) -> BoolArray:
    """Whether the image of a label lies across a cut."""
    return np.asarray(np.any(flips & (crossings[label] == CUT), axis=-1))


def signs(crossings: NDArray[np.uint8], label: IntArray, flips: BoolArray) -> IntArray:
    """−1 where the image of a label's drive is its negative."""
    odd = np.logical_xor.reduce((crossings[label] == NEGATED) & flips, axis=-1)
    return np.where(odd, -1, 1)


def crossing_codes(crossings: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A byte a label: bit 0 (1) where it is cut at the mirror in x (y), bit 2 (3) where negated."""
    cut, negated = crossings == CUT, crossings == NEGATED
    return np.packbits(np.hstack((cut, negated)), axis=1, bitorder="little").ravel()


def crossings_of(codes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Crossings of their bytes; `ValueError` if a label is both at once, or something else."""
    bits = np.unpackbits(codes[:, None], axis=1, bitorder="little").astype(bool)
    cut, negated = bits[:, :2], bits[:, 2:4]
    if np.any(cut & negated) or np.any(bits[:, 4:]):
        raise ValueError("crossings")
    return np.where(cut, CUT, np.where(negated, NEGATED, JOINED)).astype(np.uint8)


NO_MIRRORS = MirrorSymmetry()
"""Every region stored."""
