"""How drives become few bits: codes of chosen width, and mirror images left out.

In-phase and quadrature parts are quantised apart, because below the first mode a drive can be
turned so that its quadrature part is small and counts only squared: it needs fewer bits. The device
decodes with integers, by the same formula as here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.tables.regions import RegionGrid

ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]
Order = tuple[int, ...]

FULL_SCALE = 32767
"""The integer that stands for the largest gain."""
MIN_BITS, MAX_BITS = 2, 16


@dataclass(frozen=True)
class Packing:
    """Widths and scales of the codes, in-phase then quadrature.

    A code runs from −n to n with n = 2^(bits − 1) − 1 and stands for the value code · scale / n,
    rounded to a whole number, halves away from zero.
    """

    bits: tuple[int, int] = (16, 16)
    scales: tuple[int, int] = (FULL_SCALE, FULL_SCALE)

    @property
    def largest(self) -> IntArray:
        """The largest codes, shape (2,)."""
        return np.array([(1 << (bits - 1)) - 1 for bits in self.bits])

    def values(self, codes: IntArray) -> NDArray[np.int16]:
        """What codes (…, 2) stand for, exactly as the device computes it."""
        n = self.largest
        size = (np.abs(codes) * np.array(self.scales) + n // 2) // n
        return np.asarray((np.sign(codes) * size).astype(np.int16))

    def codes(self, values: NDArray[np.int16] | NDArray[np.float64]) -> IntArray:
        """The nearest codes of values (…, 2) in units of 1/32767."""
        n = self.largest
        nearest = np.rint(np.asarray(values, dtype=np.float64) * n / np.array(self.scales))
        return np.asarray(np.clip(nearest, -n, n).astype(np.int64))

    def size(self, pairs: int) -> int:
        """Bytes of so many pairs."""
        return (pairs * sum(self.bits) + 7) // 8

    def to_bytes(self, codes: IntArray) -> bytes:
        """Codes (…, 2) as a stream of bits, the least significant first."""
        fields = []
        for part, bits in enumerate(self.bits):
            unsigned = codes[..., part].ravel() & ((1 << bits) - 1)
            fields.append((unsigned[:, None] >> np.arange(bits)) & 1)
        stream = np.concatenate(fields, axis=1).astype(np.uint8).ravel()
        return np.packbits(stream, bitorder="little").tobytes()

    def from_bytes(self, data: bytes, pairs: int) -> IntArray:
        """The way back; shape (pairs, 2).

        Raises
        ------
        ValueError
            A code below −n, or padding that is not zero.
        """
        stream = np.unpackbits(np.frombuffer(data, np.uint8), bitorder="little")
        used = pairs * sum(self.bits)
        if stream[used:].any():
            raise ValueError("zeros after the last code")
        rows = stream[:used].reshape(pairs, sum(self.bits)).astype(np.int64)
        parts, start = [], 0
        for bits, largest in zip(self.bits, self.largest, strict=True):
            unsigned = rows[:, start : start + bits] @ (1 << np.arange(bits))
            signed = np.where(unsigned > largest, unsigned - (1 << bits), unsigned)
            if np.any(signed < -largest):
                raise ValueError(f"codes from {-largest} to {largest}")
            parts.append(signed)
            start += bits
        return np.stack(parts, axis=1)


PLAIN = Packing()
"""Sixteen bits each: what a table in memory holds, stored as it is."""


@dataclass(frozen=True)
class Folding:
    """Mirrors whose images are not stored: the order of the actuators each stands for, or None."""

    x: Order | None = None
    y: Order | None = None

    @property
    def flags(self) -> int:
        """Bit 0 for x, bit 1 for y."""
        return int(self.x is not None) | int(self.y is not None) << 1

    def nibbles(self, axis: int) -> int:
        """The order of one mirror, four bits an actuator; 0 without that mirror."""
        order = (self.x, self.y)[axis]
        return sum(image << (4 * k) for k, image in enumerate(order)) if order else 0

    def sources(self, grid: RegionGrid, actuators: int) -> list[tuple[int, Order]]:
        """For every region, the stored region it takes its drive from, and the actuators' order."""
        result: list[tuple[int, Order]] = []
        for region in range(grid.count):
            column, row = region % grid.columns, region // grid.columns
            flip_x = self.x is not None and 2 * column >= grid.columns
            flip_y = self.y is not None and 2 * row >= grid.rows
            order = np.arange(actuators)
            if flip_x:
                order = order[list(self.x or ())]
            if flip_y:
                order = order[list(self.y or ())]
            result.append((grid.mirrored(region, x=flip_x, y=flip_y), tuple(order.tolist())))
        return result

    def stored(self, grid: RegionGrid) -> NDArray[np.intp]:
        """Numbers of the stored regions, ascending: the cells at small x and small y."""
        columns = (grid.columns + 1) // 2 if self.x is not None else grid.columns
        rows = (grid.rows + 1) // 2 if self.y is not None else grid.rows
        numbers = np.arange(rows)[:, None] * grid.columns + np.arange(columns)
        return numbers.ravel()

    def unfold(self, grid: RegionGrid, values: NDArray[np.int16]) -> NDArray[np.int16]:
        """Values of all regions from those of the stored ones, (stored, actuators, 2)."""
        place = {region: k for k, region in enumerate(self.stored(grid).tolist())}
        rows = [values[place[source]][list(order)]
                for source, order in self.sources(grid, values.shape[1])]  # fmt: skip
        return np.stack(rows)


UNFOLDED = Folding()
"""Every region stored."""
