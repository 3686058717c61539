"""Figures 2B and 2C: one actuator's resonance, and what four waves become over the sweep."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from chladni.host.figures.fields import save
from chladni.host.figures.sweeps import sweep_figure
from chladni.sim.coil.actuator import wave_response
from chladni.sim.coil.waveforms import WAVEFORMS
from paper import boards
from paper.numbers import Numbers, fixed

FREQUENCIES_HZ = np.linspace(100.0, 400.0, 601)
"""The paper's range, half a hertz apart."""


def numbers() -> Numbers:
    """Peaks, ratios, shapes and width of the resonance."""
    coil = boards.computed().coil
    assert coil is not None
    assert coil.latch is not None
    curves = {wave: wave_response(coil, wave, FREQUENCIES_HZ) for wave in WAVEFORMS}
    sine = curves["sine"].fundamental
    loud = FREQUENCIES_HZ[sine >= sine.max() / np.sqrt(2.0)]
    found = {
        "own_hz": fixed(coil.latch.resonance_hz),
        "quality": fixed(coil.latch.mechanical_q),
        "width_hz": fixed(loud[-1] - loud[0]),
    }
    for wave, curve in curves.items():
        peak = int(curve.fundamental.argmax())
        found |= {
            f"{wave}_hz": fixed(FREQUENCIES_HZ[peak], 1),
            f"{wave}_ratio": fixed(curve.fundamental.max() / sine.max(), 2),
            f"{wave}_harmonics": fixed(100.0 * curve.distortion[peak], 1),
            f"{wave}_shape": fixed(curve.correlation[-1], 2),
        }
    return found


def draw(folder: Path) -> None:
    """Both figures in one."""
    coil = boards.computed().coil
    assert coil is not None
    curves = {wave: wave_response(coil, wave, FREQUENCIES_HZ) for wave in WAVEFORMS}
    save(sweep_figure(coil, FREQUENCIES_HZ, curves), folder / "paper-2.png")
