"""The drive search's own view of a board: orthonormal fields on coarse and fine images.

A drive c makes W = Σ cᵢGᵢ. With the thin factorisation G = U Σ Vᴴ of the fields (points ×
actuators) the search moves z in W = √N U z instead: every direction moves the plate alike, so the
climb needs no scaling, and actuators that nearly coincide cannot ask for gains without bound.
Directions that the actuators drive `WEAKEST` less than the strongest are left out: their share of
a drive would be all gain and no motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem._kernel import Fields, Objective

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]

LEVELS = (8, 4, 2, 1)
"""Each level keeps every k-th image point; the last is the image that is scored."""
WINDOW = 7
WEAKEST = 1e-3
"""60 dB. Sixteen-bit drives through a 12-bit PWM leave about that much for the weakest actuator."""
SPARSE = 8
NO_FORM = np.zeros((0, 0))


@dataclass(frozen=True)
class Level:
    """The fields on every `step`-th point of the image."""

    step: int
    index_x: IntArray
    index_y: IntArray
    fields: Fields

    def sample(self, image: FloatArray) -> FloatArray:
        """An image on this level's points."""
        return np.ascontiguousarray(image[np.ix_(self.index_x, self.index_y)], dtype=np.float64)


class FieldSpace:
    """Orthonormal fields of a board and the way between them and drives.

    Parameters
    ----------
    transfer
        Fields per actuator, complex, shape (actuators, nx, ny), any scale.
    """

    def __init__(self, transfer: ComplexArray) -> None:
        count, nx, ny = transfer.shape
        flat = transfer.reshape(count, -1)
        largest = float(np.abs(flat).max())
        self.scale = largest if largest > 0.0 else 1.0
        left, singular, planes = np.linalg.svd(flat / self.scale, full_matrices=False)
        self.singular = singular
        kept = singular > WEAKEST * singular[0]
        if not kept.any():
            kept[0] = True  # fields of zeros: one direction that does nothing
        strength = np.where(singular > 0.0, singular, 1.0)[kept]
        # W = c·G = z·(√N Vᴴ), so c = z √N Σ⁻¹ Uᴴ
        root = np.sqrt(nx * ny)
        self._to_drive = (root / strength)[:, None] * left[:, kept].conj().T
        self._from_drive = left[:, kept] * strength / root
        self.values = np.asarray((root * planes[kept]).reshape(-1, nx, ny))
        flat = self.values.reshape(len(self.values), -1)
        self._gram = flat.conj() @ flat.T
        self.levels = [
            self._level(step) for step in LEVELS if step == 1 or min(nx, ny) // step >= 2 * WINDOW
        ]

    @property
    def rank(self) -> int:
        """Directions the search moves in."""
        return len(self._to_drive)

    @property
    def condition(self) -> float:
        """Largest over smallest singular value of all fields; infinite if they are dependent."""
        least = self.singular[-1]
        return float(self.singular[0] / least) if least > 0.0 else float("inf")

    def drive(self, z: ComplexArray) -> ComplexArray:
        """The drive (actuators,) of search coordinates (rank,), of largest gain 1."""
        drive = z @ self._to_drive
        largest = np.abs(drive).max()
        return np.asarray(drive / largest if largest > 0.0 else drive)

    def coordinates(self, drive: ComplexArray) -> ComplexArray:
        """Search coordinates of unit length of a drive, without what it has in weak directions."""
        z = drive @ self._from_drive
        length = np.linalg.norm(z)
        return np.asarray(z / length if length > 0.0 else z)

    def value(self, objective: Objective, drive: ComplexArray) -> float:
        """An objective of this space at a drive."""
        return objective.value(as_reals(self.coordinates(drive)))

    def nearest_field(self, wanted: ComplexArray) -> ComplexArray:
        """Coordinates of the field nearest to a given one, by every `SPARSE`-th point each way."""
        values = self.values[:, ::SPARSE, ::SPARSE].reshape(self.rank, -1)
        return np.asarray(np.linalg.lstsq(values.T, wanted[::SPARSE, ::SPARSE].ravel())[0])

    def best_contrast(self, disc: NDArray[np.bool_]) -> ComplexArray:
        """Coordinates of highest contrast: as the board's mean is even, those of most energy."""
        values = self.values[:, disc]
        return np.asarray(np.linalg.eigh(values.conj() @ values.T)[1][:, -1])

    def nearest_level(self, step: int) -> Level:
        """The level of every `step`-th image point, or the nearest there is."""
        return min(self.levels, key=lambda level: abs(level.step - step))

    def objective(
        self,
        level: Level,
        image: FloatArray,
        *,
        ssim: float = 1.0,
        contrast: float = 0.0,
        disc: NDArray[np.bool_] | None = None,
    ) -> Objective:
        """Ssim · SSIM + contrast · ln(contrast) on one level, as the compiled kernel has it.

        Parameters
        ----------
        image
            Normalised target image at full size.
        disc
            Image points of the target's fingertip, for the contrast.
        """
        inside, outside = self._forms(disc) if disc is not None and contrast else (NO_FORM, NO_FORM)
        return Objective(level.fields, level.sample(image), ssim, contrast, inside, outside)

    def objective_of(self, level: Level, sample: FloatArray) -> Objective:
        """SSIM on one level against an image of that level's own points."""
        return Objective(level.fields, np.ascontiguousarray(sample), 1.0, 0.0, NO_FORM, NO_FORM)

    def _forms(self, disc: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """Mean |W|² in the disc and on the rest as real forms of (Re z, Im z)."""
        values, points = self.values[:, disc], disc.size
        inside = values.conj() @ values.T
        return (
            _real_form(inside / max(len(values.T), 1)),
            _real_form((self._gram - inside) / max(points - len(values.T), 1)),
        )

    def _level(self, step: int) -> Level:
        index_x, index_y = (every(step, size) for size in self.values.shape[1:])
        values = self.values[:, index_x][:, :, index_y]
        planes = np.stack((values.real, values.imag), axis=1).astype(np.float32)
        return Level(step, index_x, index_y, Fields(np.ascontiguousarray(planes)))


def _real_form(gram: ComplexArray) -> FloatArray:
    """z̄ᵀ gram z, gram Hermitian, as a form of (Re z, Im z)."""
    return np.block([[gram.real, -gram.imag], [gram.imag, gram.real]])


def in_phase(numbers: ComplexArray) -> ComplexArray:
    """Complex numbers turned by one common phase so that Σ Im² is least."""
    return np.asarray(numbers * turn_in_phase(numbers))


def turn_in_phase(numbers: ComplexArray) -> complex:
    """The phase factor that does so."""
    return complex(np.exp(-0.5j * np.angle(np.sum(numbers * numbers))))


def as_reals(z: ComplexArray) -> FloatArray:
    """Complex coordinates as the kernel takes them: real parts, then imaginary ones."""
    return np.concatenate((z.real, z.imag))


def as_complex(reals: FloatArray) -> ComplexArray:
    """The way back."""
    half = reals.size // 2
    return np.asarray(reals[:half] + 1j * reals[half:])


def every(step: int, size: int) -> IntArray:
    """Every `step`-th of `size` indices, centred, so that mirror images stay mirror images."""
    return np.arange((size - 1) % step // 2, size, step)
