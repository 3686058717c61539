"""A signal that comes in rows: at another rate, low-passed, and the same however it is cut."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.live import signal_samples
from chladni.effects.low_pass import low_passed


@settings(max_examples=30, deadline=None)
@given(
    cuts=st.lists(st.integers(0, 1999), max_size=12),
    rate_hz=st.sampled_from([1000.0, 2441.40625, 4000.0, 8000.0, 44_100.0]),
)
def test_it_does_not_matter_where_rows_end(cuts: list[int], rate_hz: float) -> None:
    signal = np.random.default_rng(3).uniform(-0.9, 0.9, 2000)
    whole = np.concatenate(list(signal_samples([signal], rate_hz, SIGNAL_HZ)))
    rows = np.split(signal, sorted(cuts))
    found = np.concatenate(list(signal_samples(rows, rate_hz, SIGNAL_HZ)))
    assert abs(len(whole) - 1999 * SIGNAL_HZ / rate_hz) <= 1.0
    np.testing.assert_allclose(found[: len(whole)], whole[: len(found)], atol=1e-9)
    assert abs(len(found) - len(whole)) <= 1


@pytest.mark.parametrize(("rate_hz", "most"), [(2000.0, 0.08), (4000.0, 0.02), (8000.0, 0.006)])
def test_it_is_the_low_passed_signal_at_the_devices_rate(rate_hz: float, most: float) -> None:
    """A tone of 180 Hz, by straight lines and a low-pass whose delay depends on the rate a little.

    Both err with the square of the step.
    """
    times = np.arange(int(rate_hz)) / rate_hz
    found = np.concatenate(
        list(signal_samples([np.sin(2.0 * np.pi * 180.0 * times)], rate_hz, SIGNAL_HZ))
    )
    fine = np.arange(96_000) / 96_000.0
    wanted = low_passed(np.sin(2.0 * np.pi * 180.0 * fine), 96_000.0)
    own = np.interp(np.arange(len(found)) / SIGNAL_HZ, fine, wanted)
    np.testing.assert_allclose(found[:2300], own[:2300], atol=most)
