"""What a coil whose bridge sleeps induces, on its way to the converter, in SPICE."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from chladni.calibration.device_readings import REFERENCE_SHARE
from chladni.calibration.sensing import CONVERTER_V
from chladni.host.emulation.sensed_plate import amplifier_gain
from spice.ngspice import simulate

pytestmark = pytest.mark.skipif(shutil.which("ngspice") is None, reason="ngspice is not installed")

UNLIKE = 0.05
"""By which capacitors of one kind differ."""


@pytest.mark.parametrize(("hz", "emf"), [(80.0, 0.1e-3), (6000.0, 5e-3)])
def test_the_amplifier_reads_a_coil_at_ground_as_one_at_the_supply(
    hz: float, emf: float, tmp_path: Path
) -> None:
    """In size, as `test_sensing.py` has it of a switch's; and the right way round."""
    found = simulate("sensing_bridge", tmp_path, hz=hz, emf=emf, stop=50e-3)
    gain = 2.0 * complex(found["sine_v"], found["cosine_v"]) / emf
    expected = complex(amplifier_gain(np.array(hz)))
    assert abs(gain) == pytest.approx(abs(expected), rel=0.03)
    assert abs(np.angle(gain / expected)) < 0.15


def test_half_of_a_wave_is_the_reference(tmp_path: Path) -> None:
    """Its fundamental is half of the wave's; what else there is has even multiples alone."""
    level = 0.8
    found = simulate(
        "sensing_bridge", tmp_path, level=level, coil_first=0, unlike=UNLIKE, stop=50e-3
    )
    volts = 2.0 * abs(complex(found["sine_v"], found["cosine_v"]))
    expected = 5.0 * level * REFERENCE_SHARE * abs(complex(amplifier_gain(np.array(160.0))))
    assert volts == pytest.approx(expected, rel=0.01)
    assert found["highest_v"] - found["lowest_v"] < 0.5 * CONVERTER_V


def test_the_reference_is_forgotten_before_the_next_coil(tmp_path: Path) -> None:
    """25 ms of ringing up and 3 ms after it, though the two ends' capacitors differ.

    Of a reference whose middle is not at ground, which 1.3 V swing, the amplifier is at its end.
    """
    begun = 50e-3
    found = simulate(
        "sensing_bridge",
        tmp_path,
        emf=0.0,
        level=0.8,
        coil_first=0,
        switch_at=begun,
        unlike=UNLIKE,
        stop=begun + 28e-3 + 25e-3,
    )
    # phone5's readings at 160 Hz have a median of 0.2 mV, and last 100 ms: a quarter is left.
    seen = 2.0 * abs(complex(found["sine_v"], found["cosine_v"]))
    assert seen / 4.0 < 0.05 * 0.2e-3 * abs(complex(amplifier_gain(np.array(160.0))))
    assert abs(found["late_v"] - 1.3) < 0.1


def test_a_coil_that_its_bridge_drives_hurts_nothing(tmp_path: Path) -> None:
    """5 V at half duty, and its body diodes below ground during dead times."""
    found = simulate("sensing_bridge", tmp_path, driven=1.0, emf=0.0, stop=30e-3)
    assert 0.2e-3 < max(found["input_a"], -found["least_input_a"]) < 0.6e-3
    assert found["most_input_v"] < 5.5
    assert found["least_input_v"] > -0.5
    assert found["highest_v"] < 3.3
    assert found["lowest_v"] > 0.0


def test_the_carrier_that_a_neighbour_couples_in_leaves_room(tmp_path: Path) -> None:
    """40 mV, as beside a switch."""
    found = simulate("sensing_bridge", tmp_path, emf=0.0, coupled_v=40e-3, stop=30e-3)
    assert found["highest_v"] - found["lowest_v"] < 0.25 * CONVERTER_V
    # 0.4 µA leak into 100 kΩ: the coil stays where a multiplexer of 5 V conducts.
    assert found["least_input_v"] > -0.1
    assert found["most_input_v"] < 0.1
