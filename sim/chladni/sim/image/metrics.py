"""How good a focus is: SSIM as the paper computed it, and numbers for what SSIM leaves out.

All take the complex displacement on the image points (definitions in docs/metrics.md). Means over
the board weigh every image point alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count

import numpy as np
from numpy.typing import NDArray

from chladni.sim.board import fingers
from chladni.sim.image.energy import energy_image, normalised

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Place = tuple[float, float]

FINGERTIP_RADIUS = fingers.FINGERTIP_RADIUS
"""Of the disc a fingertip covers, m."""
SECOND_FINGER_DISTANCE = 12e-3
"""A disc this far from the target, m, is another finger's: twice the fingertip radius."""
SPOT_SHARE = 0.5
"""−3 dB of |W|²."""
FLOOR_DB = -300.0
"""Reported where a ratio is 0; keeps every number finite."""


def decibel(ratio: float) -> float:
    """10 log₁₀ of a power ratio, between −300 and 300 dB."""
    if ratio <= 10.0 ** (FLOOR_DB / 10.0):
        return FLOOR_DB
    return float(min(10.0 * np.log10(ratio), -FLOOR_DB))


def ssim(image: FloatArray, target: FloatArray) -> float:
    """Structural similarity of two energy images, each normalised first.

    `skimage.metrics.structural_similarity` with its defaults (7 × 7 uniform window) and
    `data_range=1`, as the paper's authors ran it.
    """
    first, second = normalised(image), normalised(target)
    # Only one SSIM of many is scikit-image's; drives have a compiled one.
    from skimage.metrics import structural_similarity  # noqa: PLC0415

    return float(structural_similarity(first, second, data_range=1.0))  # type: ignore[no-untyped-call]


def disc_mask(x: FloatArray, y: FloatArray, centre: Place, radius: float) -> NDArray[np.bool_]:
    """Image points within `radius` (m) of a place, shape (nx, ny); never empty."""
    distance = np.hypot(x[:, None] - centre[0], y - centre[1])
    mask = distance <= max(radius, float(distance.min()))
    return np.asarray(mask)


def contrast_db(w: ComplexArray, disc: NDArray[np.bool_]) -> float:
    """Mean |W|² in the disc over the mean on the rest of the board, dB."""
    power = np.abs(w) ** 2
    inside, outside = float(power[disc].mean()), float(power[~disc].mean())
    if inside == 0.0:
        return FLOOR_DB
    return decibel(inside / outside) if outside > 0.0 else -FLOOR_DB


def best_contrast(transfer: ComplexArray, disc: NDArray[np.bool_]) -> tuple[float, ComplexArray]:
    """The largest contrast any drive can reach, dB, and a drive that reaches it.

    It is the largest eigenvalue of the Hermitian pencil (GᴴG over the disc, GᴴG over the rest),
    found from a QR factorisation of the fields, which squares no condition number.

    Parameters
    ----------
    transfer
        Shape (actuators, nx, ny).
    disc
        Shape (nx, ny).
    """
    inside, outside = transfer[:, disc].T, transfer[:, ~disc].T
    scale = np.linalg.norm(outside, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    left, singular, right = np.linalg.svd(outside / scale, full_matrices=False)
    del left
    keep = singular > 1e-12 * singular[0]
    whiten = right[keep].conj().T / singular[keep] / scale[:, None]
    _, gains, turn = np.linalg.svd(inside @ whiten, full_matrices=False)
    ratio = gains[0] ** 2 * outside.shape[0] / inside.shape[0]
    return decibel(float(ratio)), np.asarray(whiten @ turn[0].conj())


def focal_error(w: ComplexArray, x: FloatArray, y: FloatArray, target: Place) -> float:
    """Distance from the target to the image's maximum, m."""
    i, j = np.unravel_index(int(np.argmax(np.abs(w))), w.shape)
    return float(np.hypot(x[i] - target[0], y[j] - target[1]))


def centroid_error(w: ComplexArray, x: FloatArray, y: FloatArray, target: Place) -> float:
    """Distance from the target to the centroid of |W|² where it is above half its maximum, m."""
    power = np.abs(w) ** 2
    if power.max() <= 0.0:
        return float(np.hypot(*target))
    weight = np.where(power >= SPOT_SHARE * power.max(), power / power.max(), 0.0)
    total = weight.sum()
    centre_x, centre_y = (weight.sum(axis=1) @ x) / total, (weight.sum(axis=0) @ y) / total
    return float(np.hypot(centre_x - target[0], centre_y - target[1]))


def spot_area(w: ComplexArray, x: FloatArray, y: FloatArray) -> float:
    """Area where |W|² is above half its maximum, m²."""
    power = np.abs(w) ** 2
    cell = float((x[1] - x[0]) * (y[1] - y[0]))
    return float(np.count_nonzero(power >= SPOT_SHARE * power.max()) * cell)


class FingertipDiscs:
    """Discs of a fingertip's radius at every image point, clipped to the board."""

    def __init__(self, x: FloatArray, y: FloatArray) -> None:
        self._x, self._y = x, y
        # The slack keeps points that lie on the circle, however they are rounded.
        radius = FINGERTIP_RADIUS * (1.0 + 1e-9)
        offsets = []
        for step in (float(x[1] - x[0]), float(y[1] - y[0])):
            half = int(radius / step)
            offsets.append(np.arange(-half, half + 1) * step)
        disc = (np.hypot(offsets[0][:, None], offsets[1]) <= radius).astype(np.float64)
        self._half = (disc.shape[0] // 2, disc.shape[1] // 2)
        # Room for half a disc beyond one edge: what comes round from the other falls outside.
        self._shape = [
            _fast_length(max(points + half, 2 * half + 1))
            for points, half in zip((x.size, y.size), self._half, strict=True)
        ]
        self._disc = np.fft.rfft2(disc, self._shape)
        # Each sum is divided by its own number of points.
        self._count = self._sums(np.ones((x.size, y.size)))

    def second_finger_db(
        self, w: ComplexArray, target: Place, distances: Sequence[float]
    ) -> list[float]:
        """RMS in the target's disc over the loudest equal disc at each distance (m) or more, dB.

        Where there is no disc so far away it is 300.
        """
        power = np.abs(w) ** 2
        if power.max() <= 0.0:
            return [0.0] * len(distances)
        power = power / power.max()
        mean = self.means(power)
        apart = np.hypot(self._x[:, None] - target[0], self._y - target[1])
        own = float(power[disc_mask(self._x, self._y, target, FINGERTIP_RADIUS)].mean())
        loudest = [float(mean[apart > distance].max(initial=0.0)) for distance in distances]
        return [decibel(own / one) if one > 0.0 else -FLOOR_DB for one in loudest]

    def means(self, power: FloatArray) -> FloatArray:
        """The mean over every disc of something on the image points, shape (nx, ny)."""
        return np.asarray(np.maximum(self._sums(power), 0.0) / self._count)

    def _sums(self, values: FloatArray) -> FloatArray:
        """The sum over every disc, as a product of spectra.

        `scipy.signal.fftconvolve` would do, but takes a second to load with all of scipy.stats.
        """
        product = np.fft.rfft2(values, self._shape) * self._disc
        first, second = self._half
        whole = np.fft.irfft2(product, self._shape)
        return np.asarray(whole[first:, second:][: self._x.size, : self._y.size])


def _fast_length(least: int) -> int:
    """The first length from `least` on with no prime factor above 5: its transform is fast."""
    return next(length for length in count(least) if 30**20 % length == 0)


def second_finger_db(w: ComplexArray, x: FloatArray, y: FloatArray, target: Place) -> float:
    """RMS in the target's disc over that of the loudest equal disc 12 mm or more away, dB."""
    return FingertipDiscs(x, y).second_finger_db(w, target, [SECOND_FINGER_DISTANCE])[0]


def louder_fraction(w: ComplexArray, disc: NDArray[np.bool_]) -> float:
    """Fraction of the board that moves more than the RMS of the target's disc."""
    power = np.abs(w) ** 2
    return float(np.mean(power > power[disc].mean()))


def image_of(w: ComplexArray) -> FloatArray:
    """The normalised energy image of a displacement."""
    return normalised(energy_image(w))
