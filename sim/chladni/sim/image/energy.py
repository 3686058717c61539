"""Energy images: the RMS of a vibration at every point, and how it is normalised to be compared."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def compose(transfer: ComplexArray, drive: ComplexArray) -> ComplexArray:
    """W = Σ cᵢGᵢ of fields (actuators, nx, ny) and a drive (actuators,); shape (nx, ny).

    References
    ----------
    Eq. (3) of the paper: its 360 gains per actuator are one complex number each.
    """
    return np.asarray(np.tensordot(drive, transfer, axes=1))


def energy_image(displacement: ComplexArray) -> FloatArray:
    """RMS over a period, |W|/√2, of a complex displacement of any shape (eq. (4) of the paper)."""
    return np.asarray(np.abs(displacement) / np.sqrt(2.0))


def normalised(image: FloatArray) -> FloatArray:
    """An image less its minimum, over its range; a constant image gives zeros."""
    low, high = float(image.min()), float(image.max())
    # A range that is all rounding carries no picture.
    if high - low <= 1e-12 * max(abs(high), abs(low)):
        return np.zeros_like(image)
    return np.asarray((image - low) / (high - low))
