"""Fewer breakpoints: straight lines that stay as near to a curve as its steps in the bank are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

IntArray = NDArray[np.int64]


def thinned(at: IntArray, values: IntArray, tolerance: int) -> IntArray:
    """Indices of breakpoints that are enough, the first and the last among them.

    Parameters
    ----------
    at, values
        Breakpoints, in order, shape (points,) each.
    tolerance
        That a line may pass a breakpoint by.

    References
    ----------
    Ramer 1972, Douglas and Peucker 1973, with distances along the values only.
    """
    kept = np.zeros(len(at), dtype=bool)
    kept[[0, -1]] = True
    todo = [(0, len(at) - 1)]
    while todo:
        first, last = todo.pop()
        if last - first < 2:
            continue
        span = slice(first + 1, last)
        line = np.interp(at[span], at[[first, last]], values[[first, last]])
        off = np.abs(values[span] - line)
        furthest = int(np.argmax(off))
        if off[furthest] <= tolerance:
            continue
        middle = first + 1 + furthest
        kept[middle] = True
        todo += [(first, middle), (middle, last)]
    return np.flatnonzero(kept)
