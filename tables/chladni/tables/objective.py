"""SSIM of a driven board against a target image, with its gradient in the complex drive.

The value is that of `skimage.metrics.structural_similarity` on min–max normalised images; the
gradient is exact wherever the image's extreme points are unique (elsewhere the value has a kink).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

WINDOW = 7
SAMPLES = WINDOW * WINDOW
C1, C2 = 0.01**2, 0.03**2
"""K₁ = 0.01 and K₂ = 0.03 of Wang et al. 2004, for a data range of 1."""


class SsimObjective:
    """SSIM over drives of a board, for one target image.

    Parameters
    ----------
    transfer
        Fields per actuator, shape (actuators, nx, ny), scaled to about 1.
    target
        Normalised target image, shape (nx, ny).
    """

    def __init__(self, transfer: ComplexArray, target: FloatArray) -> None:
        if min(target.shape) < WINDOW:
            raise ValueError(f"an image of {target.shape} holds no {WINDOW} × {WINDOW} window")
        self.evaluations = 0
        self._shape = target.shape
        self._fields = np.ascontiguousarray(transfer.reshape(transfer.shape[0], -1))
        self._target = target
        self._mean_y = _window_mean(target)
        self._var_y = _SAMPLE * (_window_mean(target**2) - self._mean_y**2)

    def value_and_gradient(self, drive: ComplexArray) -> tuple[float, ComplexArray]:
        """SSIM and ∂SSIM/∂Re(c) + i ∂SSIM/∂Im(c), shape (actuators,)."""
        self.evaluations += 1
        w = drive @ self._fields
        # Fields are scaled to about 1, so the plain root is safe; abs() costs thrice as much.
        magnitude = np.sqrt(w.real**2 + w.imag**2)
        low, high = int(magnitude.argmin()), int(magnitude.argmax())
        span = magnitude[high] - magnitude[low]
        if not span > 1e-12 * magnitude[high]:
            value, _ = self._ssim(np.zeros(self._shape))
            return value, np.zeros_like(drive)
        image = (magnitude - magnitude[low]) / span
        value, by_image = self._ssim(image.reshape(self._shape))
        flat = by_image.ravel()
        by_magnitude = flat / span
        # n = (E − min)/(max − min) also moves with its extreme points.
        by_magnitude[low] += flat @ (image - 1.0) / span
        by_magnitude[high] -= flat @ image / span
        # d|W| = Re(W̄ dW)/|W|; where W is 0 no direction is defined, and 0 is a subgradient.
        by_magnitude /= np.where(magnitude > 0.0, magnitude, 1.0)
        gradient = (self._fields @ (by_magnitude * w.conj())).conj()
        return value, np.asarray(gradient)

    def value(self, drive: ComplexArray) -> float:
        """SSIM alone."""
        return self.value_and_gradient(drive)[0]

    def _ssim(self, image: FloatArray) -> tuple[float, FloatArray]:
        """Mean SSIM and its gradient by the image, both on the windows that fit whole."""
        mean_x, mean_y = _window_mean(image), self._mean_y
        var_x = _SAMPLE * (_window_mean(image * image) - mean_x * mean_x)
        cov = _SAMPLE * (_window_mean(image * self._target) - mean_x * mean_y)
        a1, a2 = 2.0 * mean_x * mean_y + C1, 2.0 * cov + C2
        b1, b2 = mean_x**2 + mean_y**2 + C1, var_x + self._var_y + C2
        below = 1.0 / (b1 * b2)
        s = a1 * a2 * below
        by_var = -s / b2
        by_cov = 2.0 * a1 * below
        by_mean = (
            2.0 * mean_y * a2 * below
            - 2.0 * mean_x * s / b1
            - _SAMPLE * (by_cov * mean_y + 2.0 * by_var * mean_x)
        )
        gradient = (
            _spread(by_mean)
            + (2.0 * _SAMPLE) * image * _spread(by_var)
            + _SAMPLE * self._target * _spread(by_cov)
        )
        return float(s.mean()), gradient / s.size


_SAMPLE = SAMPLES / (SAMPLES - 1.0)
"""skimage takes the sample variance by default."""


def _window_mean(image: FloatArray) -> FloatArray:
    """Means over all 7 × 7 windows that fit, shape (nx − 6, ny − 6)."""
    return _box(_box(image, 0), 1) / SAMPLES


def _spread(values: FloatArray) -> FloatArray:
    """Adjoint of `_window_mean`: each window's value handed back to its points."""
    padded = np.pad(values, WINDOW - 1)
    return _box(_box(padded, 0), 1) / SAMPLES


def _box(image: FloatArray, axis: int) -> FloatArray:
    """Sums of 7 neighbours along an axis, where they fit; pairwise, so nothing accumulates."""
    view = np.moveaxis(image, axis, 0)
    two = view[:-1] + view[1:]
    four = two[:-2] + two[2:]
    seven = four[:-3] + two[4:-1] + view[6:]
    return np.moveaxis(seven, 0, axis)
