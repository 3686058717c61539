"""What a PWM duty stream really says: amplitude, phase and purity of its sine.

A duty holds for one carrier period, so the wave on the pin is a staircase that lags by half a
synthesis sample. Amplitudes are corrected for the staircase (sinc) and phases for the lag.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.host.emulation._emulator import full_span_steps, half_span_steps, lost_steps
from chladni.host.emulation.emulator import Recording
from chladni.host.protocol.board_config import coil_gains
from chladni.sim.board.board import Board
from chladni.sim.coil.circuit import CoilCircuit, circuit_of
from chladni.tables.table import Section

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SAMPLE_PERIODS = 4
"""Carrier periods per synthesis sample."""
PURITY_PERIODS = 1 << 19
"""Carrier periods an SFDR is measured over; shorter captures give none."""
BAND_HZ = (20.0, 1000.0)
FUNDAMENTAL_BINS = 8
BLACKMAN_HARRIS_4 = (0.35875, 0.48829, 0.14128, 0.01168)
"""Side lobes 92 dB down (Harris 1978)."""
BLACKMAN_HARRIS_7 = (
    0.27105140069342,
    0.43329793923448,
    0.21812299954311,
    0.06592544638803,
    0.01081174209837,
    0.00077658482522,
    0.00001388721735,
)
"""Seven-term Blackman–Harris: side lobes 180 dB down (Albrecht 2001)."""


@dataclass(frozen=True)
class Play:
    """The stretch of a recording in which one drive plays steadily, in carrier periods."""

    start: int
    stop: int


def phasors(
    recording: Recording,
    play: Play,
    frequency_hz: float,
    circuit: CoilCircuit | None = None,
) -> ComplexArray:
    """Complex amplitude of every channel's sine, duty as a share of 1, shape (channels,).

    With a circuit it is that of the current in place of the duty, by what a duty more drives while
    the current flows; the pins then say what a flyback diode leaves of their sine, or a bridge.

    Phase 0 is a cosine at the first sample of the recording. The least squares of
    c + a cos ωt + b sin ωt, weighted by a Blackman–Harris window: any stretch will do, of no whole
    number of waves and of less than one. Of half a wave at 160 Hz it is right within 0.03 %.
    """
    index = np.arange(play.start, play.stop)
    # Without the two outermost points, which weigh nothing.
    weight = np.sqrt(_window(BLACKMAN_HARRIS_4, len(index) + 1)[1:])[:, None]
    turns = 2.0 * np.pi * frequency_hz * index / recording.carrier_hz
    terms = np.stack([np.ones_like(turns), np.cos(turns), np.sin(turns)], axis=1)
    duty = recording.duty_steps[play.start : play.stop] / float(1 << recording.pwm_bits)
    if circuit is not None:
        duty = circuit.mean_current(duty) / circuit.current_per_duty
    _, cosine, sine = np.linalg.lstsq(weight * terms, weight * duty, rcond=None)[0]
    return np.asarray((cosine - 1j * sine) / hold(frequency_hz, recording.carrier_hz))


def span_steps(board: Board) -> int:
    """Amplitude of a drive's gain of 1 on a board's pins, duty steps."""
    own = board.electronics
    if not own.is_bridge:
        return half_span_steps(own.pwm_bits)
    return full_span_steps(own.pwm_bits, board_lost_steps(board))


def full_duty(board: Board, recording: Recording) -> float:
    """Amplitude of a drive's gain of 1 on a board's pins, as a share of a duty of 1."""
    return span_steps(board) / float(1 << recording.pwm_bits)


def board_lost_steps(board: Board) -> int:
    """What a board's bridges lose of each pulse, duty steps; 0 with switches."""
    own = board.electronics
    return lost_steps(round(own.lost_ns)) if own.is_bridge else 0


def hold(frequency_hz: float, carrier_hz: float) -> complex:
    """Gain of holding each sample for four carrier periods, sampled once per period."""
    step = 2.0 * np.pi * frequency_hz / carrier_hz
    return complex(np.mean(np.exp(-1j * step * np.arange(SAMPLE_PERIODS))))


def drive_phasors(
    recording: Recording, play: Play, frequency_hz: float, *, level: float
) -> ComplexArray:
    """What switches really played, in units of the table's full scale, shape (channels,).

    Its common phase is that of the recording's clock; only phases between channels mean anything.
    """
    span = half_span_steps(recording.pwm_bits) / float(1 << recording.pwm_bits)
    return phasors(recording, play, frequency_hz) / (span * level)


def made_drive(
    recording: Recording, play: Play, section: Section, board: Board, *, level: float
) -> ComplexArray:
    """The drive that the pins made of a table's section, as the coils have it, (actuators,).

    In units of gain as the table's own drives; its common phase means nothing. It is made of the
    coils' currents, which at small duties a flyback diode keeps from following the pins.
    """
    return _made(recording, play, section.frequency_hz, section, board, level)


def made_harmonic(
    recording: Recording, play: Play, section: Section, board: Board, *, level: float
) -> ComplexArray:
    """The second harmonic of `made_drive`, (actuators,), in the same units."""
    return _made(recording, play, 2.0 * section.frequency_hz, section, board, level)


def _made(
    recording: Recording,
    play: Play,
    frequency_hz: float,
    section: Section,
    board: Board,
    level: float,
) -> ComplexArray:
    span = full_duty(board, recording)
    found = phasors(recording, play, frequency_hz, circuit_of(board)) / (span * level)
    # The device makes up for polarity and trim, which the coils themselves then undo.
    return np.asarray(section.full_scale_gain * found / np.array(coil_gains(board)))


def sfdr_db(
    recording: Recording, play: Play, frequency_hz: float, *, lost_steps: int = 0
) -> list[float | None]:
    """Spurious-free dynamic range of each channel's duty, 20–1000 Hz, dB below the carrier wave.

    `lost_steps`: what a bridge loses of each pulse, which its duties give back.

    None for a channel that is silent, or where the capture is shorter than 2^19 carrier periods
    (docs/metrics.md: settled, mean removed, seven-term Blackman–Harris, fundamental ± 8 bins out).
    """
    return [
        None if bins is None else float(20.0 * np.log10(bins.own.max() / bins.rest.max()))
        for bins in _band(recording, play, frequency_hz, lost_steps)
    ]


def edge_sfdr_db(
    recording: Recording, play: Play, frequency_hz: float, *, lost_steps: int = 0
) -> list[float | None]:
    """As `sfdr_db`, of the pulses themselves: each begins with its carrier period.

    Such pulses carry the duty less half the rate of its square, of a bridge its square with its
    sign: a second harmonic, or a third, that no shaping of the duties removes (hardware.md). Exact
    to (2πf/carrier)², 6e-3 at 1000 Hz.
    """
    return [
        None if bins is None else float(20.0 * np.log10(bins.own.max() / bins.rest.max()))
        for bins in _band(recording, play, frequency_hz, lost_steps, of_edges=True)
    ]


def sndr_db(recording: Recording, play: Play, frequency_hz: float) -> list[float | None]:
    """Ratio of the wave to all else in 20–1000 Hz, noise and distortion, dB; None as above."""
    return [
        None if bins is None else float(10.0 * np.log10((bins.own**2).sum() / (bins.rest**2).sum()))
        for bins in _band(recording, play, frequency_hz)
    ]


def _window(weights: Sequence[float], period: int) -> FloatArray:
    """Σ aₖ cos k(2πn/N − π) for n = 0 … N − 1, N the period: a sum of cosines, largest half-way.

    `scipy.signal.windows` has it, but takes a second to load with all of scipy.stats.
    """
    turn = np.linspace(-np.pi, np.pi, period, endpoint=False)
    terms = [weight * np.cos(k * turn) for k, weight in enumerate(weights)]
    return np.asarray(np.sum(terms, axis=0))


@dataclass(frozen=True)
class _Band:
    """Magnitudes of a duty's spectrum from 20 to 1000 Hz: the wave's bins, and the rest."""

    own: FloatArray
    rest: FloatArray


def _band(
    recording: Recording,
    play: Play,
    frequency_hz: float,
    lost_steps: int = 0,
    *,
    of_edges: bool = False,
) -> list[_Band | None]:
    channels = recording.duty_steps.shape[1]
    if play.stop - play.start < PURITY_PERIODS:
        return [None] * channels
    steps = recording.duty_steps[play.stop - PURITY_PERIODS : play.stop]
    duty = (steps - lost_steps * np.sign(steps)) / float(1 << recording.pwm_bits)
    window = _window(BLACKMAN_HARRIS_7, PURITY_PERIODS)
    bins_hz = np.arange(PURITY_PERIODS // 2 + 1) * recording.carrier_hz / PURITY_PERIODS
    fundamental = round(frequency_hz * PURITY_PERIODS / recording.carrier_hz)
    own = np.zeros(bins_hz.size, dtype=bool)
    own[max(fundamental - FUNDAMENTAL_BINS, 0) : fundamental + FUNDAMENTAL_BINS + 1] = True
    rest = (bins_hz >= BAND_HZ[0]) & (bins_hz <= BAND_HZ[1]) & ~own
    result: list[_Band | None] = []
    for channel in duty.T:
        if np.ptp(channel) == 0.0:
            result.append(None)
            continue
        spectrum = np.fft.rfft((channel - channel.mean()) * window)
        if of_edges:
            # ∫ of a pulse of width d: its spectrum is d − iωd²/2 + …, ω per carrier period.
            square = channel * np.abs(channel)
            turn = 2.0 * np.pi * bins_hz / recording.carrier_hz
            spectrum = spectrum - 0.5j * turn * np.fft.rfft((square - square.mean()) * window)
        size = np.abs(spectrum)
        result.append(_Band(size[own], size[rest]))
    return result


def first_change(recording: Recording, after_period: int) -> int | None:
    """First carrier period at or after one in which any duty differs from before it."""
    base = recording.duty_steps[max(after_period - 1, 0)]
    changed = np.flatnonzero((recording.duty_steps[after_period:] != base).any(axis=1))
    return int(changed[0]) + after_period if changed.size else None
