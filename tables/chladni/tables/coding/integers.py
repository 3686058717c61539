"""Pairs of integers of 8, 12 or 16 bits as a table's records have them: offset binary."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.tables.layout import FULL_SCALE

ByteArray = NDArray[np.uint8]
IntArray = NDArray[np.int64]


def as_bytes(pairs: IntArray, bits: int) -> ByteArray:
    """Integers (regions, actuators, 2) in offset binary, shape (regions, bytes).

    Of 12 bits the upper eight of both come first, then both rests in one byte.
    """
    codes = pairs + (1 << (bits - 1))
    parts = [codes] if bits == 8 else [codes & 0xFF, codes >> 8]
    if bits == 12:
        rests = (codes & 15)[..., :1] | (codes & 15)[..., 1:] << 4
        parts = [np.concatenate((codes >> 4, rests), axis=-1)]
    whole = np.stack(parts, axis=-1)
    return np.asarray(whole.reshape(len(pairs), -1).astype(np.uint8))


def as_integers(data: ByteArray, actuators: int, bits: int) -> IntArray:
    """The way back."""
    parts = data.reshape(len(data), actuators, -1).astype(np.int64)
    if bits == 12:
        rests = parts[..., 2:]
        codes = parts[..., :2] << 4 | np.concatenate((rests & 15, rests >> 4), axis=-1)
    elif bits == 16:
        codes = parts[..., ::2] | parts[..., 1::2] << 8
    else:
        codes = parts
    return np.asarray(codes - (1 << (bits - 1)))


def is_loud(iq: NDArray[np.integer]) -> bool:
    """Whether a pair, of 16 bits, is beyond full scale."""
    return bool(np.any((iq.astype(np.int64) ** 2).sum(axis=-1) > FULL_SCALE**2))
