"""What a coil induces, on its way to the converter: the circuit of docs/hardware.md in SPICE."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from chladni.calibration.sensing import CONVERTER_STEPS, CONVERTER_V
from chladni.host.emulation.sensed_plate import amplifier_gain
from spice.ngspice import simulate

pytestmark = pytest.mark.skipif(shutil.which("ngspice") is None, reason="ngspice is not installed")

STEP_V = CONVERTER_V / CONVERTER_STEPS


@pytest.mark.parametrize(("hz", "emf"), [(80.0, 1e-3), (6000.0, 5e-3)])
def test_the_emulated_amplifier_is_that_of_the_circuit(
    hz: float, emf: float, tmp_path: Path
) -> None:
    """In size; and in phase but for a delay, which the reference takes as well."""
    found = simulate("sensing", tmp_path, hz=hz, emf=emf, stop=50e-3)
    # A sine through a gain g∠φ is |g| sin(ωt + φ).
    gain = 2.0 * complex(found["sine_v"], found["cosine_v"]) / emf
    expected = complex(amplifier_gain(np.array(hz)))
    assert abs(gain) == pytest.approx(abs(expected), rel=0.03)
    # By 10 Hz below, and by the converter's own capacitor above.
    early, late = np.angle(1.0 + 10.6j / hz), 2.0 * np.pi * hz * 1.5e-6
    assert np.angle(gain / expected) == pytest.approx(early - late, abs=0.03)


@pytest.mark.parametrize("hz", [160.0, 6000.0])
def test_the_reference_goes_the_same_way_as_a_coil(hz: float, tmp_path: Path) -> None:
    """Its 100 Ω in place of a coil: apart by less than the 1 % of its resistors."""
    coil, reference = (
        simulate("sensing", tmp_path, hz=hz, emf=2e-3, stop=50e-3, **source)
        for source in ({}, {"source_ohm": 100.0, "source_h": 1e-9})
    )
    gains = [complex(own["sine_v"], own["cosine_v"]) for own in (coil, reference)]
    assert abs(gains[1] / gains[0] - 1.0) < 6e-3


def test_another_coil_s_direct_voltage_is_forgotten_in_time(tmp_path: Path) -> None:
    """1.25 mV, by which a playing coil's reference hangs lower, 3 ms before the reading begins.

    Of what is left the lock-in sees its slope; 25 ms of it are worth 0.4 steps at 80 Hz.
    """
    stop = 60e-3
    found = simulate("sensing", tmp_path, emf=0.0, step_v=1.25e-3, step_at=stop - 28e-3, stop=stop)
    drift = abs(found["late_v"] - found["early_v"])
    assert 0.02 < drift < 0.15
    # A decay over two periods of a sine: τ = 16 ms, and 1/(1 + (ωτ)²) of 2τ/T.
    tau, omega = 16e-3, 2.0 * np.pi * 80.0
    seen = 2.0 * tau / 25e-3 * drift * omega * tau / (1.0 + (omega * tau) ** 2)
    assert seen < 20.0 * STEP_V


def test_a_driven_coil_hurts_nothing(tmp_path: Path) -> None:
    """Its drain swings from ground to a diode above the supply, 78,125 times a second."""
    found = simulate("sensing", tmp_path, driven=1.0, stop=30e-3)
    assert max(found["input_a"], -found["least_input_a"]) < 0.6e-3
    assert found["most_input_v"] < 5.5
    assert found["highest_v"] < 3.3
    assert found["lowest_v"] > 0.0


def test_the_carrier_that_a_neighbour_couples_in_leaves_room(tmp_path: Path) -> None:
    """40 mV: 5 V by the share of their flux that coils at 10 mm have in common, 1 %."""
    found = simulate("sensing", tmp_path, emf=0.0, coupled_v=40e-3, stop=30e-3)
    ripple = found["highest_v"] - found["lowest_v"]
    assert ripple < 0.25 * CONVERTER_V
    # Of pulses of half a period, 2/π on either side of the middle; others pass a twentieth of it.
    passed = abs(complex(amplifier_gain(np.array(80e6 / 1024.0))))
    assert ripple == pytest.approx(2.0 * 40e-3 * 2.0 / np.pi * passed, rel=0.15)
