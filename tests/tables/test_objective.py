"""The SSIM objective against scikit-image, and its gradient against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from skimage.metrics import structural_similarity

from chladni.sim.energy import normalised
from chladni.tables.objective import SsimObjective

RNG = np.random.default_rng(11)


def smooth_fields(count: int, shape: tuple[int, int]) -> np.ndarray:
    """Random fields of a few waves: smooth like a plate's, without symmetry or equal extremes."""
    x, y = np.linspace(-1, 1, shape[0])[:, None], np.linspace(-1, 1, shape[1])
    fields = np.zeros((count, *shape), dtype=complex)
    for k in range(count):
        for _ in range(4):
            a, b, c, d = RNG.normal(size=4)
            fields[k] += (c + 1j * d) * np.exp(1j * (2.0 * a * x + 2.0 * b * y))
    return np.asarray(fields / np.abs(fields).max())


@pytest.mark.parametrize("shape", [(7, 7), (23, 46), (31, 64)])
def test_value_is_that_of_scikit_image(shape: tuple[int, int]) -> None:
    fields = smooth_fields(5, shape)
    target = normalised(np.abs(smooth_fields(1, shape)[0]))
    objective = SsimObjective(fields, target)
    for _ in range(5):
        drive = RNG.normal(size=5) + 1j * RNG.normal(size=5)
        image = normalised(np.abs(np.tensordot(drive, fields, axes=1)))
        expected = structural_similarity(image, target, data_range=1.0)  # type: ignore[no-untyped-call]
        assert objective.value(drive) == pytest.approx(expected, abs=1e-12)
    assert objective.evaluations == 5


def test_gradient_matches_central_differences() -> None:
    """Step 1e-6 leaves truncation 1e-12 and rounding 1e-10 of a gradient of order 1."""
    fields = smooth_fields(4, (25, 40))
    objective = SsimObjective(fields, normalised(np.abs(smooth_fields(1, (25, 40))[0])))
    drive = RNG.normal(size=4) + 1j * RNG.normal(size=4)
    _, gradient = objective.value_and_gradient(drive)
    step = 1e-6
    for k in range(4):
        for direction, component in ((1.0, gradient[k].real), (1j, gradient[k].imag)):
            moved = np.zeros(4, dtype=complex)
            moved[k] = step * direction
            slope = (objective.value(drive + moved) - objective.value(drive - moved)) / (2 * step)
            assert slope == pytest.approx(component, abs=1e-8 * max(1.0, np.abs(gradient).max()))


def test_common_phase_and_scale_change_nothing() -> None:
    fields = smooth_fields(3, (20, 30))
    objective = SsimObjective(fields, normalised(np.abs(smooth_fields(1, (20, 30))[0])))
    drive = RNG.normal(size=3) + 1j * RNG.normal(size=3)
    value, gradient = objective.value_and_gradient(drive)
    turned = 0.37 * np.exp(2.1j)
    assert objective.value(turned * drive) == pytest.approx(value, abs=1e-12)
    # So the gradient has no part along either.
    along = np.vdot(gradient, drive)
    assert abs(along) < 1e-12 * np.linalg.norm(gradient) * np.linalg.norm(drive)


def test_silence_and_constant_images_are_finite() -> None:
    fields = smooth_fields(3, (20, 30))
    objective = SsimObjective(fields, np.zeros((20, 30)))
    for drive in (np.zeros(3, dtype=complex), np.ones(3, dtype=complex)):
        value, gradient = objective.value_and_gradient(drive)
        assert np.isfinite(value)
        assert np.all(np.isfinite(gradient))
    flat = SsimObjective(np.ones((2, 9, 9), dtype=complex), np.zeros((9, 9)))
    value, gradient = flat.value_and_gradient(np.array([1.0, 1.0j]))
    assert value == pytest.approx(1.0)
    assert not gradient.any()


def test_an_image_smaller_than_a_window_is_refused() -> None:
    with pytest.raises(ValueError, match="7 × 7"):
        SsimObjective(np.ones((1, 6, 9), dtype=complex), np.zeros((6, 9)))
