"""What a coil does over frequency: on the plate, and on a latch of its own."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from chladni.host.figures.fields import COLOURS, INK
from chladni.sim.board.electronics import Coil
from chladni.sim.coil.actuator import WaveResponse, motion
from chladni.sim.coil.waveforms import WAVEFORMS, Waveform, harmonics, synthesise
from chladni.sim.fields.coil_on_plate import PlateCurve

FloatArray = NDArray[np.float64]


def sweep_figure(
    coil: Coil,
    frequencies_hz: FloatArray,
    curves: Mapping[Waveform, WaveResponse],
    on_plate: PlateCurve | None = None,
    *,
    title: str = "",
) -> Figure:
    """A coil's acceleration over frequency: on the plate, and on its latch under four waves.

    Parameters
    ----------
    curves
        Of the latch, at `frequencies_hz`; empty where there is none. With their shapes at four
        frequencies they are the paper's figure 2.
    on_plate
        Of the plate under a sine; left out if None.
    title
        Above all; the paper's has none.
    """
    if not curves:
        figure = Figure(figsize=(7.0, 4.0), layout="constrained")
        if on_plate is not None:
            _draw_plate(figure.subplots(), on_plate)
        figure.suptitle(title, color=INK, fontsize=11)
        return figure
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    figure.suptitle(title, color=INK, fontsize=11)
    top, bottom = np.asarray(figure.subfigures(2, 1, height_ratios=[1.1, 1.4])).tolist()
    if on_plate is None:
        latch = top.subplots()
    else:
        latch, plate = np.asarray(top.subplots(1, 2)).tolist()
        _draw_plate(plate, on_plate)
        latch.set_title("Coil on its latch, without the plate", fontsize=10, color=INK)
    _draw_latch(latch, coil, frequencies_hz, curves)
    _draw_shapes(bottom, coil, frequencies_hz)
    return figure


def _draw_plate(axes: Axes, curve: PlateCurve) -> None:
    axes.plot(curve.frequencies_hz, curve.acceleration, color=COLOURS[0])
    axes.set_xlabel("frequency / Hz")
    axes.set_ylabel("acceleration under the coil / m/s²")
    axes.set_title("Plate under the coil, by a sine", fontsize=10, color=INK)


def _draw_latch(
    axes: Axes, coil: Coil, frequencies_hz: FloatArray, curves: Mapping[Waveform, WaveResponse]
) -> None:
    for wave, colour in zip(WAVEFORMS, COLOURS, strict=False):
        axes.plot(frequencies_hz, curves[wave].fundamental, color=colour, label=wave)
    if coil.latch is not None:
        axes.axvline(coil.latch.resonance_hz, color="#999999", linewidth=0.8, linestyle="--")
    axes.set_xlabel("frequency / Hz")
    axes.set_ylabel("fundamental acceleration / m/s²")
    axes.legend(frameon=False, fontsize=9)


def _draw_shapes(figure: SubFigure, coil: Coil, frequencies_hz: FloatArray) -> None:
    shown = np.linspace(frequencies_hz[0], frequencies_hz[-1], 4)
    if coil.latch is not None:
        own = coil.latch.resonance_hz
        shown[int(np.argmin(np.abs(shown - own)))] = own
    phase = np.arange(512) / 512 * 2.0
    panels = figure.subplots(len(WAVEFORMS), shown.size, sharex=True)
    for row, (wave, colour) in enumerate(zip(WAVEFORMS, COLOURS, strict=False)):
        for column, frequency in enumerate(shown):
            panel = panels[row, column]
            answer = np.tile(motion(coil, wave, float(frequency), 256), 2)
            drive = np.tile(synthesise(harmonics(wave, 99), 256), 2)
            panel.plot(phase, drive / np.abs(drive).max(), color="#bbbbbb", linewidth=0.8)
            panel.plot(phase, answer / np.abs(answer).max(), color=colour, linewidth=1.1)
            panel.set_yticks([])
            panel.tick_params(labelsize=7)
            if row == 0:
                panel.set_title(f"{frequency:.0f} Hz", fontsize=9, color=INK)
            if column == 0:
                panel.set_ylabel(wave, fontsize=8)
    figure.supxlabel("periods; grey: drive, colour: acceleration, each scaled to 1", fontsize=8)
