"""Fields on a grid that is its own mirror image: worked out on a part, put together by parity."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.plate.mirrors import Mirrors, Orbits

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

Oddness = tuple[bool, bool]
"""Whether a function is odd in x and in y; (False, False) where there is no mirror."""
Place = tuple[slice, slice]


class MirroredGrid:
    """The grid x × y (m) and its fundamental part: all of it, a half or a quarter.

    Attributes
    ----------
    mirrors
        Those to fold by; plate and grid both have them (`Mirrors.shared_with`).
    part_x, part_y
        The lines of the fundamental part; an odd count has its middle line in it.
    """

    def __init__(self, x: FloatArray, y: FloatArray, mirrors: Mirrors) -> None:
        self.x, self.y = x, y
        self.mirrors = mirrors
        self.part_x = x[x.size // 2 :] if self.mirrors.x else x
        self.part_y = y[y.size // 2 :] if self.mirrors.y else y

    @property
    def part_shape(self) -> tuple[int, int]:
        """Points of the fundamental part."""
        return self.part_x.size, self.part_y.size

    def join(self, shares: Mapping[Oddness, FloatArray]) -> FloatArray:
        """The real fields whose shares of each parity are known on the fundamental part.

        Parameters
        ----------
        shares
            Shape (fields, *part_shape) each.

        Returns
        -------
        FloatArray
            Shape (fields, nx, ny).
        """
        count = next(iter(shares.values())).shape[0]
        total = np.empty((count, self.x.size, self.y.size))
        for (rows, columns), image in self._images(shares):
            total[:, rows, columns] = image
        return total

    def unfold(
        self, shares: Iterable[Mapping[Oddness, FloatArray]], orbits: Orbits
    ) -> ComplexArray:
        """The complex fields of every load from the shares of the distinct ones.

        Parameters
        ----------
        shares
            Of one distinct load after the other, shape (parts, *part_shape) each; parts are real
            and, unless it is zero, imaginary.

        Returns
        -------
        ComplexArray
            Shape (loads, nx, ny).
        """
        # Load by load and image by image through one small array: large ones between would cost
        # more to get from the system than to fill.
        values = np.empty((len(orbits.images), self.x.size, self.y.size), dtype=np.complex128)
        for k, own in enumerate(shares):
            turned = [
                field[:: int(sx), :: int(sy)]
                for field, (which, (sx, sy)) in zip(values, orbits.images, strict=True)
                if which == k
            ]
            for (rows, columns), image in self._images(own):
                block = _together(image)
                for field in turned:
                    field[rows, columns] = block
        return values

    def _images(self, shares: Mapping[Oddness, FloatArray]) -> Iterator[tuple[Place, FloatArray]]:
        """Where each image of the fundamental part belongs, and the fields there."""
        for flip_x in (False, True) if self.mirrors.x else (False,):
            rows, own_rows = _half(self.x.size, self.part_x.size, flip=flip_x)
            # First over the parities in x, then over those in y: half the sums of all four.
            in_x: dict[bool, FloatArray] = {}
            for (odd_x, odd_y), share in shares.items():
                before = in_x.get(odd_y)
                in_x[odd_y] = _added(before, share[..., own_rows, :], turned=flip_x and odd_x)
            for flip_y in (False, True) if self.mirrors.y else (False,):
                columns, own_columns = _half(self.y.size, self.part_y.size, flip=flip_y)
                total: FloatArray | None = None
                for odd_y, share in in_x.items():
                    total = _added(total, share[..., own_columns], turned=flip_y and odd_y)
                assert total is not None
                yield (rows, columns), total


def _half(whole: int, part: int, *, flip: bool) -> tuple[slice, slice]:
    """Along one line: the places an image fills, in the order of the part's points it takes."""
    other = whole - part
    if not flip:
        return slice(other, None), slice(None)
    # The image runs backwards from just below the part, and leaves out a middle line.
    return slice(other - 1, None, -1) if other else slice(0, 0), slice(part - other, None)


def _added(total: FloatArray | None, share: FloatArray, *, turned: bool) -> FloatArray:
    if total is None:
        return -share if turned else share
    return total - share if turned else total + share


def _together(parts: FloatArray) -> NDArray[Any]:
    """One field from its real and, if there is any, imaginary part."""
    if len(parts) == 1:
        return np.asarray(parts[0])
    whole = np.empty(parts.shape[1:], dtype=np.complex128)
    whole.real, whole.imag = parts
    return whole
