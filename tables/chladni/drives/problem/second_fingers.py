"""Where a second finger could lie: what a drive does under fingertips all over the board.

The mean square of W = Σ gₙGₙ over a disc is the form gᴴ R g with R = mean of G̅ Gᵀ over the disc,
whatever the target. So the forms of a grid of discs are found once per board.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.sim.fields.transfer import TransferFields
from chladni.sim.image import metrics

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Place = tuple[float, float]

RADIUS = metrics.FINGERTIP_RADIUS * (1.0 + 1e-9)
"""With points that lie on the circle, however they are rounded."""
SPACING = 1e-3
"""Between discs, m: a sixth of their radius. A zone's true edge lies up to this far before its
first disc, where fields of the shipped boards change by half a decibel."""
MOST_VALUES = 3 << 19
"""Complex numbers in all forms, 25 MB; boards that would need more get discs further apart."""


@dataclass(frozen=True)
class SecondFingers:
    """Discs of a fingertip's radius all over a board, clipped at its edges.

    Attributes
    ----------
    centres
        Shape (discs, 2), m.
    forms
        complex128, shape (discs, actuators, actuators), Hermitian, m²/N²: gᴴ R g is the mean of
        |W|² over a disc for a drive g in newtons.
    """

    centres: FloatArray
    forms: ComplexArray

    @classmethod
    def of(cls, fields: TransferFields) -> SecondFingers:
        """The forms of a board's fields."""
        count = len(fields.values)
        area = float(np.ptp(fields.x) * np.ptp(fields.y))
        spacing = max(SPACING, float(np.sqrt(area * count**2 / MOST_VALUES)))
        rows, columns = (_spread(axis, spacing) for axis in (fields.x, fields.y))
        half = [int(RADIUS / (axis[1] - axis[0])) for axis in (fields.x, fields.y)]
        centres = [(i, j) for i in rows.tolist() for j in columns.tolist()]
        forms = np.empty((len(centres), count, count), dtype=np.complex128)
        for own, (i, j) in zip(forms, centres, strict=True):
            near_x = slice(max(i - half[0], 0), i + half[0] + 1)
            near_y = slice(max(j - half[1], 0), j + half[1] + 1)
            x, y = fields.x[near_x] - fields.x[i], fields.y[near_y] - fields.y[j]
            inside = np.hypot(x[:, None], y) <= RADIUS
            values = fields.values[:, near_x, near_y][:, inside]
            own[:] = values.conj() @ values.T / values.shape[1]
        places = np.array([(fields.x[i], fields.y[j]) for i, j in centres])
        return cls(places, forms)

    def mean_squares(self, drive: ComplexArray) -> FloatArray:
        """Mean of |W|² over every disc, m², shape (discs,), of a drive (actuators,) in newtons."""
        products = np.outer(drive.conj(), drive).ravel()
        # The real part alone, as one real product: R as pairs (Re, Im) times (Re, −Im).
        pairs = np.stack((products.real, -products.imag), axis=-1).ravel()
        flat = self.forms.reshape(len(self.forms), -1).view(np.float64)
        return np.asarray(flat @ pairs)

    def second_finger_db(self, drive: ComplexArray, place: Place) -> float:
        """RMS in the disc nearest to a place (m) over the loudest disc 12 mm or more away, dB.

        300 where no disc is so far away.
        """
        levels, apart = self.mean_squares(drive), self.distances(place)
        away = levels[apart > metrics.SECOND_FINGER_DISTANCE]
        loudest = float(away.max(initial=0.0))
        own = float(levels[int(np.argmin(apart))])
        return metrics.decibel(own / loudest) if loudest > 0.0 else -metrics.FLOOR_DB

    def loudest(self, drive: ComplexArray, place: Place) -> Place | None:
        """Centre of the loudest disc 12 mm or more away from a place, m; None without one."""
        away = self.distances(place) > metrics.SECOND_FINGER_DISTANCE
        if not away.any():
            return None
        x, y = self.centres[int(np.argmax(np.where(away, self.mean_squares(drive), -1.0)))]
        return float(x), float(y)

    def distances(self, place: Place) -> FloatArray:
        """From a place (m) to every disc's centre, m, shape (discs,)."""
        return np.asarray(np.hypot(*(self.centres - place).T))


def _spread(axis: FloatArray, spacing: float) -> NDArray[np.intp]:
    """Indices of image points about so far apart, both ends among them."""
    count = int(np.ceil((axis[-1] - axis[0]) / spacing)) + 1
    return np.unique(np.rint(np.linspace(0, axis.size - 1, count)).astype(np.intp))
