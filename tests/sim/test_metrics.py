"""Energy images and the scorecard's numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from skimage.metrics import structural_similarity

from chladni.sim.board.board import Board
from chladni.sim.fields.transfer import transfer_fields
from chladni.sim.image import metrics
from chladni.sim.image.energy import compose, energy_image, normalised

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

unit = st.floats(-1.0, 1.0, allow_nan=False)
drives = st.lists(st.tuples(unit, unit), min_size=5, max_size=5)


def test_1800_gains_are_five_phasors(prototype: Board) -> None:
    """The paper's search space: gains −10…10 on 360 phases of 5 actuators, steady state.

    In time, each phase is a rotating field; the RMS of the sum over a period must be the energy
    image of the five phasors. 32 instants integrate a squared sine exactly.
    """
    rng = np.random.default_rng(7)
    fields = transfer_fields_cached(prototype)[:, ::6, ::6]
    gains = rng.integers(-10, 11, size=(5, 360))
    phases = np.radians(np.arange(360))
    times = 2.0 * np.pi * np.arange(32) / 32
    squares = np.zeros(fields.shape[1:])
    for t in times:
        motion = sum(
            gains[i, j] * np.real(fields[i] * np.exp(1j * (t + phases[j])))
            for i in range(5)
            for j in range(0, 360)
            if gains[i, j]
        )
        squares += np.square(motion)
    from_series = np.sqrt(squares / 32)
    phasors = np.asarray(gains @ np.exp(1j * phases), dtype=np.complex128)
    assert from_series == pytest.approx(
        energy_image(compose(fields, phasors)), rel=1e-9, abs=1e-12 * from_series.max()
    )


@settings(max_examples=200, deadline=None)
@given(pairs=drives, where=st.tuples(st.floats(-35.0, 35.0), st.floats(-73.0, 73.0)))
def test_contrast_never_exceeds_its_limit(
    prototype: Board, pairs: list[tuple[float, float]], where: tuple[float, float]
) -> None:
    drive = np.array([complex(*pair) for pair in pairs])
    if np.abs(drive).max() < 1e-3:
        return
    fields = transfer_fields_cached(prototype)
    disc = metrics.disc_mask(prototype.x, prototype.y, (where[0] * 1e-3, where[1] * 1e-3), 6e-3)
    limit, best = metrics.best_contrast(fields, disc)
    assert metrics.contrast_db(compose(fields, drive), disc) <= limit + 1e-9
    assert metrics.contrast_db(compose(fields, best), disc) == pytest.approx(limit, abs=1e-6)


_CACHE: dict[str, ComplexArray] = {}


def transfer_fields_cached(board: Board) -> ComplexArray:
    if board.name not in _CACHE:
        _CACHE[board.name] = transfer_fields(board).values
    return _CACHE[board.name]


def test_focusing_gain_averages_the_number_of_actuators(prototype: Board) -> None:
    """physics.md: A·Σ|ψᵢ(x)|² averages N over the board, whatever the plate (here N = 5)."""
    fields = transfer_fields_cached(prototype).reshape(5, -1)
    basis = np.linalg.qr(fields.T)[0]  # orthonormal with equal weights at every point
    gain = basis.shape[0] * np.sum(np.abs(basis) ** 2, axis=1)
    assert gain.mean() == pytest.approx(5.0, rel=1e-12)


def test_ssim_is_that_of_skimage_on_normalised_images() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.random((40, 60)), rng.random((40, 60)) + 5.0
    expected = structural_similarity(  # type: ignore[no-untyped-call]
        (a - a.min()) / np.ptp(a), (b - b.min()) / np.ptp(b), data_range=1.0
    )
    assert metrics.ssim(a, b) == pytest.approx(expected, abs=1e-15)
    assert metrics.ssim(a, 3.0 * a + 1.0) == pytest.approx(1.0, abs=1e-12)


@given(value=st.floats(0.0, 1e9))
def test_a_constant_image_normalises_to_zeros(value: float) -> None:
    assert not normalised(np.full((9, 9), value)).any()


def gaussian(
    centre: tuple[float, float], width: float
) -> tuple[FloatArray, FloatArray, ComplexArray]:
    x, y = np.linspace(-0.03, 0.03, 121), np.linspace(-0.06, 0.06, 241)
    squared = (x[:, None] - centre[0]) ** 2 + (y - centre[1]) ** 2
    return x, y, np.exp(-squared / (2.0 * width**2)).astype(np.complex128)


def test_a_gaussian_spot_has_its_closed_form_numbers() -> None:
    """|W|² = exp(−r²/s²): half maximum at r² = s² ln 2, so the spot is πs² ln 2."""
    x, y, w = gaussian((0.01, -0.02), 4e-3)
    assert metrics.spot_area(w, x, y) == pytest.approx(np.pi * 16e-6 * np.log(2.0), rel=0.02)
    assert metrics.focal_error(w, x, y, (0.01, -0.02)) == pytest.approx(0.0, abs=1e-9)
    assert metrics.focal_error(w, x, y, (0.01, 0.01)) == pytest.approx(0.03, abs=1e-9)
    assert metrics.centroid_error(w, x, y, (0.01, 0.01)) == pytest.approx(0.03, abs=1e-4)


def test_second_finger_is_the_ratio_of_two_equal_spots() -> None:
    x, y, near = gaussian((0.0, -0.03), 3e-3)
    far = gaussian((0.0, 0.03), 3e-3)[2]
    both = near + np.complex128(0.5) * far
    ratio = metrics.second_finger_db(both, x, y, (0.0, -0.03))
    assert ratio == pytest.approx(20.0 * np.log10(2.0), abs=0.05)
    back = metrics.second_finger_db(both, x, y, (0.0, 0.03))
    assert back == pytest.approx(-20.0 * np.log10(2.0), abs=0.05)


def test_silence_gives_finite_numbers() -> None:
    x, y, w = gaussian((0.0, 0.0), 3e-3)
    silent = np.zeros_like(w)
    disc = metrics.disc_mask(x, y, (0.0, 0.0), 6e-3)
    numbers = [
        metrics.contrast_db(silent, disc),
        metrics.second_finger_db(silent, x, y, (0.0, 0.0)),
        metrics.focal_error(silent, x, y, (0.0, 0.0)),
        metrics.centroid_error(silent, x, y, (0.0, 0.0)),
        metrics.spot_area(silent, x, y),
        metrics.louder_fraction(silent, disc),
        metrics.ssim(np.abs(silent), np.abs(w)),
    ]
    assert np.all(np.isfinite(numbers))
