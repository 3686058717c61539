"""Between regions: the firmware's lookup against the reference, and the reference against sense."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.tables._firmware import FirmwareTable
from chladni.tables.format import pack
from chladni.tables.layout import BITS
from chladni.tables.lookup import mixing
from chladni.tables.mirror_symmetry import MirrorSymmetry
from chladni.tables.table import Table
from made_up import make_table, random_table, reversal

POINTS = 1000
TABLES = 100
"""10⁵ places in all."""


@settings(max_examples=TABLES, deadline=None)
@given(
    columns=st.integers(1, 30),
    rows=st.integers(1, 30),
    actuators=st.integers(1, 16),
    seed=st.integers(0, 10_000),
    labels=st.integers(1, 6),
    x=st.booleans(),
    y=st.booleans(),
    width=st.integers(1000, 500_000),
    length=st.integers(1000, 500_000),
    bits=st.sampled_from(BITS),
)
def test_firmware_and_reference_give_the_same_integers_everywhere(
    columns: int,
    rows: int,
    actuators: int,
    seed: int,
    labels: int,
    x: bool,
    y: bool,
    width: int,
    length: int,
    bits: int,
) -> None:
    """Places on the board, off it, and at the ends of 32 bits."""
    order = reversal(actuators)
    symmetry = MirrorSymmetry(order if x else None, order if y else None)
    table = random_table(
        columns,
        rows,
        actuators,
        seed,
        labels=labels,
        symmetry=symmetry,
        bits=bits,
        span_um=(width, length),
    )
    firmware = FirmwareTable(pack(table), actuators)
    section = table.section()
    rng = np.random.default_rng(seed)
    x_um, y_um = (rng.integers(-span, span + 1, POINTS) for span in (width, length))
    x_um[:2], y_um[1:3] = (-(2**31), 2**31 - 1), (2**31 - 1, -(2**31))
    played = firmware.lookup(x_um.astype(np.int32), y_um.astype(np.int32))
    assert np.array_equal(played, table.lookup(section, x_um, y_um))


def test_unrounded_drives_are_mixed_as_integers_are() -> None:
    """The reference of what is lost between regions: the same but for rounding down."""
    order = reversal(4)
    table = random_table(6, 9, 4, 5, labels=3, symmetry=MirrorSymmetry(order, order))
    section = table.section()
    rng = np.random.default_rng(1)
    x_um, y_um = rng.integers(-36000, 36001, 3000), rng.integers(-73500, 73501, 3000)
    mixed = mixing(table.regions, section, 4, x_um, y_um)
    exact = mixed.of_drives(section.iq[..., 0] + 1j * section.iq[..., 1])
    got = table.lookup(section, x_um, y_um).astype(np.float64)
    error = np.stack((exact.real, exact.imag), axis=-1) - got
    assert error.min() >= -1e-6
    assert error.max() < 1.0


def at(table: Table, x_um: float, y_um: float) -> np.ndarray:
    return table.drive_at(table.section(), round(x_um), round(y_um))


def test_within_a_branch_drives_are_bilinear() -> None:
    """Against NumPy's own interpolation along one row: a place is known to 1/256 cell."""
    drives = np.array([[10.0 + 0j], [2.0 - 4.0j], [-6.0j], [5.0 + 5.0j]])
    table = make_table(drives, 4, 1)
    step = 71500 / 4
    centres = (np.arange(4) - 1.5) * step
    for x in np.linspace(-35750, 35750, 301):
        exact = np.interp(x, centres, drives[:, 0].real) + 1j * np.interp(
            x, centres, drives[:, 0].imag
        )
        # Slopes reach 8 + 8i per cell; a place is off by 1/256 cell and 1/4294 of the board.
        assert abs(at(table, x, 0.0)[0] - exact) < 12.0 * (1 / 256 + 4 / 4294)


def test_interpolation_is_of_complex_drives_never_of_angles() -> None:
    """Phases of +179° and −179° meet at 180°, not at 0°."""
    drives = 9.0 * np.exp(1j * np.radians([[179.0], [-179.0]]))
    middle = at(make_table(drives, 2, 1), 0.0, 0.0)[0]
    assert middle == pytest.approx(-9.0, abs=0.01)


def test_across_a_cut_the_nearer_region_plays() -> None:
    drives = np.array([[10.0], [-10.0]])
    cut = make_table(drives, 2, 1, labels=np.array([0, 1], np.uint8), crossings=[(0, 0)] * 2)
    for x in (-35000, -17875, -9000, -300):
        assert at(cut, x, 0)[0] == pytest.approx(10.0, abs=2e-3)
        assert at(cut, -x, 0)[0] == pytest.approx(-10.0, abs=2e-3)


@pytest.mark.parametrize("stranger", range(4))
def test_three_of_a_branch_leave_out_the_fourth(stranger: int) -> None:
    """The corner next to it along x stands for it, so drives stay continuous."""
    labels = np.zeros(4, np.uint8)
    labels[stranger] = 1
    values = np.array([1.0, 4.0, 6.0, 9.0])
    values[stranger] = -10.0
    table = make_table(values[:, None], 2, 2, labels=labels, crossings=[(0, 0)] * 2)
    half = np.array([71500, 146700]) / 4
    corners = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]]) * half
    for u, v in ((0.2, 0.3), (0.4, 0.1), (0.45, 0.45)):
        place = corners[3 - stranger] + np.array([u, v]) * 2 * half * -np.sign(
            corners[3 - stranger]
        )
        # Weights as seen from the corner opposite the stranger.
        weights = np.zeros(4)
        near = 3 - stranger
        weights[[near, near ^ 1, near ^ 2, stranger]] = (
            (1 - u) * (1 - v),
            u * (1 - v),
            (1 - u) * v,
            u * v,
        )
        weights[stranger ^ 1] += weights[stranger]
        weights[stranger] = 0.0
        assert at(table, *place)[0] == pytest.approx(weights @ values, abs=0.06)


@pytest.mark.parametrize(("crossing", "middle"), [(0, 8.0), (1, 6.0), (2, 2.0)])
def test_a_mirror_is_crossed_as_its_label_says(crossing: int, middle: float) -> None:
    """Two coils that change places: cut, joined with the image, or joined with its negative."""
    table = make_table(
        np.array([[8.0, 4.0]]), 2, 1, symmetry=MirrorSymmetry((1, 0)), crossings=[(crossing, 0)]
    )
    sign = -1.0 if crossing == 2 else 1.0
    assert at(table, -17875, 0)[0] == pytest.approx(8.0, abs=0.02)
    assert at(table, 17875, 0) == pytest.approx(sign * np.array([4.0, 8.0]), abs=0.05)
    assert at(table, -100, 0)[0] == pytest.approx(middle, abs=0.05)


def test_off_the_board_the_nearest_place_plays() -> None:
    table = random_table(5, 7, 3, 2)
    section = table.section()
    far = table.lookup(section, np.array([-(2**31), 2**31 - 1]), np.array([0, 0]))
    edge = table.lookup(section, np.array([-35750, 35750]), np.array([0, 0]))
    assert np.array_equal(far, edge)
    corner = table.lookup(section, np.array([10**6]), np.array([-(10**6)]))
    assert np.array_equal(corner[0], section.iq[4])


def test_no_mix_of_drives_is_louder_than_full_scale() -> None:
    """Weights are a mean, so a mix exceeds what it is mixed from by rounding at most."""
    table = random_table(9, 9, 5, 3, labels=2)
    section = replace(table.section(), iq=np.where(table.section().iq > 0, 23160, -23160))
    section = replace(section, iq=section.iq.astype(np.int16))
    rng = np.random.default_rng(0)
    x_um, y_um = rng.integers(-36000, 36001, 5000), rng.integers(-73000, 73001, 5000)
    values = table.lookup(section, x_um, y_um).astype(np.int64)
    assert np.sqrt((values**2).sum(axis=-1).max()) <= 23160 * np.sqrt(2.0) + 1.0
