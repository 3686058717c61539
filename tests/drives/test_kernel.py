"""The compiled objective against scikit-image, its gradient against differences, and the climb."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from skimage.metrics import structural_similarity

from chladni.drives.problem import _kernel
from chladni.drives.problem.field_space import NO_FORM, FieldSpace, as_complex, as_reals
from chladni.sim.image import metrics
from chladni.sim.image.energy import normalised

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]

# Fields are held in single precision, 6e-8 of their largest value; x, and so SSIM, follow.
SINGLE = 1e-6


def smooth_fields(count: int, shape: tuple[int, int], seed: int = 11) -> ComplexArray:
    """Random fields of a few waves: smooth like a plate's, without symmetry or equal extremes."""
    rng = np.random.default_rng(seed)
    x, y = np.linspace(-1, 1, shape[0])[:, None], np.linspace(-1, 1, shape[1])
    fields = np.zeros((count, *shape), dtype=complex)
    for k in range(count):
        for _ in range(4):
            a, b, c, d = rng.normal(size=4)
            fields[k] += (c + 1j * d) * np.exp(1j * (2.0 * a * x + 2.0 * b * y))
    return np.asarray(fields / np.abs(fields).max())


def kernel(
    fields: ComplexArray,
    target: FloatArray,
    ssim: float = 1.0,
    contrast: float = 0.0,
    forms: tuple[FloatArray, FloatArray] = (NO_FORM, NO_FORM),
) -> _kernel.Objective:
    planes = np.stack((fields.real, fields.imag), axis=1).astype(np.float32)
    return _kernel.Objective(_kernel.Fields(planes), target, ssim, contrast, *forms)


def random_drive(count: int, seed: int = 3) -> ComplexArray:
    rng = np.random.default_rng(seed)
    return np.asarray(rng.normal(size=count) + 1j * rng.normal(size=count))


@pytest.mark.parametrize("shape", [(7, 7), (7, 40), (23, 46), (31, 64), (179, 367)])
def test_value_is_that_of_scikit_image(shape: tuple[int, int]) -> None:
    fields = smooth_fields(5, shape)
    target = normalised(np.abs(smooth_fields(1, shape, 5)[0]))
    objective = kernel(fields, target)
    for seed in range(5):
        drive = random_drive(5, seed)
        image = normalised(np.abs(np.tensordot(drive, fields, axes=1)))
        expected = structural_similarity(image, target, data_range=1.0)  # type: ignore[no-untyped-call]
        gradient = np.zeros(10)
        assert objective.value(as_reals(drive)) == pytest.approx(expected, abs=SINGLE)
        assert objective.evaluate(as_reals(drive), gradient) == pytest.approx(expected, abs=SINGLE)
    assert objective.evaluations == 10


def reference(fields: ComplexArray, target: FloatArray, drive: ComplexArray) -> float:
    image = normalised(np.abs(np.tensordot(drive, fields, axes=1)))
    return float(structural_similarity(image, target, data_range=1.0))  # type: ignore[no-untyped-call]


@pytest.mark.parametrize("shape", [(7, 9), (25, 40)])
def test_gradient_matches_central_differences(shape: tuple[int, int]) -> None:
    """Through normalisation, RMS and SSIM, against differences of scikit-image in double precision.

    Step 1e-6 leaves 1e-12 of truncation and 1e-10 of rounding; the kernel's single precision is
    what the tolerance is for. Random smooth images have single extremes, so no kink is near.
    """
    fields = smooth_fields(4, shape)
    target = normalised(np.abs(smooth_fields(1, shape, 5)[0]))
    drive, gradient, step = random_drive(4), np.zeros(8), 1e-6
    kernel(fields, target).evaluate(as_reals(drive), gradient)
    for k in range(8):
        moved = np.zeros(8)
        moved[k] = step
        ahead, behind = (reference(fields, target, drive + s * as_complex(moved)) for s in (1, -1))
        slope = (ahead - behind) / (2 * step)
        assert slope == pytest.approx(gradient[k], abs=3e-6 * max(1.0, np.abs(gradient).max()))


def test_contrast_and_its_gradient() -> None:
    """ln(contrast) is that of the metrics, whatever SSIM adds; its slope matches differences."""
    fields = smooth_fields(3, (20, 30))
    x, y = np.arange(20.0), np.arange(30.0)
    disc = metrics.disc_mask(x, y, (6.0, 21.0), 4.0)
    space = FieldSpace(fields)
    level = space.levels[-1]
    target = normalised(np.abs(fields[0]))
    objective = space.objective(level, target, ssim=0.0, contrast=1.0, disc=disc)
    z = random_drive(3)
    field = np.tensordot(z, space.values, axes=1)
    value = objective.value(as_reals(z))
    assert 10.0 / np.log(10.0) * value == pytest.approx(metrics.contrast_db(field, disc), abs=1e-9)
    gradient = np.zeros(6)
    objective.evaluate(as_reals(z), gradient)
    for k in range(6):
        moved = np.zeros(6)
        moved[k] = 1e-6
        slope = (objective.value(as_reals(z) + moved) - objective.value(as_reals(z) - moved)) / 2e-6
        assert slope == pytest.approx(gradient[k], rel=1e-6, abs=1e-8)


def test_common_phase_and_scale_change_nothing() -> None:
    fields = smooth_fields(3, (20, 30))
    objective = kernel(fields, normalised(np.abs(smooth_fields(1, (20, 30), 5)[0])))
    drive, gradient = random_drive(3), np.zeros(6)
    value = objective.evaluate(as_reals(drive), gradient)
    assert objective.value(as_reals(0.37 * np.exp(2.1j) * drive)) == pytest.approx(
        value, abs=SINGLE
    )
    # So the gradient has no part along either.
    along = np.vdot(as_complex(gradient), drive)
    assert abs(along) < 1e-5 * np.linalg.norm(gradient) * np.linalg.norm(drive)


@pytest.mark.parametrize("bad", [0.0, float("nan"), float("inf"), 1e30, 1e-30])
def test_silence_and_numbers_beyond_the_range_are_finite(bad: float) -> None:
    """NaN never leaves: such a drive counts as a constant image, and its gradient as none."""
    objective = kernel(smooth_fields(3, (20, 30)), np.zeros((20, 30)))
    gradient = np.full(6, 7.0)
    assert np.isfinite(objective.evaluate(np.full(6, bad), gradient))
    assert np.all(np.isfinite(gradient))


def test_a_constant_image_has_no_slope() -> None:
    flat = kernel(np.ones((2, 9, 9), dtype=complex), np.zeros((9, 9)))
    gradient = np.full(4, 7.0)
    assert flat.evaluate(as_reals(np.array([1.0, 1.0j])), gradient) == pytest.approx(1.0)
    assert not gradient.any()


def test_a_climb_ends_where_the_gradient_does() -> None:
    fields = smooth_fields(4, (40, 60))
    target = normalised(np.abs(smooth_fields(1, (40, 60), 5)[0]))
    objective = kernel(fields, target)
    start = as_reals(random_drive(4))
    drive, curvature = start.copy(), np.zeros((8, 8))
    value = objective.climb(drive, curvature, 200, 1e-10)
    assert value == pytest.approx(objective.value(drive), abs=1e-12)
    assert value > objective.value(start) + 0.01
    rng = np.random.default_rng(0)
    for _ in range(50):  # nothing nearby is higher, up to what tolerance and rounding leave
        assert objective.value(drive + 1e-3 * rng.normal(size=8)) < value + SINGLE
    # The curvature it hands on is that of the hill: a second climb from there has nothing to do.
    before = objective.evaluations
    objective.climb(drive, curvature, 200, 1e-7)
    assert objective.evaluations - before <= 30
    assert np.allclose(curvature, curvature.T, rtol=1e-6, atol=1e-9 * np.abs(curvature).max())


def test_a_climb_never_ends_below_its_start() -> None:
    for seed in range(20):
        fields = smooth_fields(3, (15, 22), seed)
        objective = kernel(fields, normalised(np.abs(smooth_fields(1, (15, 22), seed + 100)[0])))
        drive = as_reals(random_drive(3, seed))
        first = objective.value(drive)
        assert objective.climb(drive, np.zeros((6, 6)), 5, 1e-9) >= first


@pytest.mark.parametrize(
    ("planes", "target", "message"),
    [
        ((1, 2, 6, 9), (6, 9), "7 x 7"),
        ((1, 3, 8, 9), (8, 9), "actuators, 2"),
        ((1, 2, 8, 9), (9, 8), "shape of the fields"),
    ],
)
def test_shapes_are_checked(planes: tuple[int, ...], target: tuple[int, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _kernel.Objective(
            _kernel.Fields(np.ones(planes, dtype=np.float32)),
            np.zeros(target),
            1.0,
            0.0,
            NO_FORM,
            NO_FORM,
        )
    good = kernel(smooth_fields(2, (9, 9)), np.zeros((9, 9)))
    with pytest.raises(ValueError, match="2 \\* actuators"):
        good.value(np.zeros(5))


def test_search_coordinates_make_the_same_field_as_the_drive() -> None:
    fields = 1e-5 * smooth_fields(5, (20, 30))
    space = FieldSpace(fields)
    assert space.rank == 5
    drive = random_drive(5)
    z = space.coordinates(drive)
    image = normalised(np.abs(np.tensordot(drive, fields, axes=1)))
    assert normalised(np.abs(np.tensordot(z, space.values, axes=1))) == pytest.approx(
        image, abs=1e-9
    )
    back = space.drive(z)
    assert back / back[0] == pytest.approx(drive / drive[0], rel=1e-9)
    # Orthonormal: every direction moves the board alike.
    flat = space.values.reshape(5, -1)
    assert flat.conj() @ flat.T / flat.shape[1] == pytest.approx(np.eye(5), abs=1e-12)
