"""What a device reads of its own coils, without its firmware: the arithmetic of it.

A model of the whole way from the plate to numbers: coils and flux (`sim/fields/induced.py`), the
resistance that each coil really has, an amplifier and a 12-bit converter with noise and a bend,
sampled in step with the carrier, and a lock-in over whole periods.

It leaves out the settling of the multiplexer's input, which is over before a period is taken, and
what the converter has of the carrier (`but_carrier`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.device_readings import coil_impedance
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.sensing import (
    AMPLIFIER,
    BASE_SAMPLES,
    CONVERTER_BEND,
    CONVERTER_NOISE,
    CONVERTER_STEPS,
    CONVERTER_V,
    FEW_COILS,
    FLUX_ERROR,
    FLUX_MULTIPLE,
    GAIN_ERROR,
    LEVEL,
    MOST_SECONDS,
    MULTIPLES,
    UNIT_HZ,
    CoilReadings,
    ReadAt,
    hidden_voltages,
    turned_inductances,
)
from chladni.sim.board.board import Board

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

SETTLE = 5e-3
"""s from one coil or frequency to the next, before a reading begins."""
REACH_V, FULL_SCALE = 1.1, 0.95
"""About the amplifier's middle of 1.3 V, where an ESP32's converter is straight; and how much of
that a sine may take."""


def reading_frequencies() -> FloatArray:
    """At which coils are read, Hz."""
    return np.asarray(np.array(MULTIPLES) * UNIT_HZ)


def periods_of(board: Board) -> int:
    """How often 25 ms are read for every pair of coils and frequency, within the time allowed."""
    count = len(board.actuators)
    readings = count * (count - 1) * (len(MULTIPLES) + 1)
    most = MOST_SECONDS[count > FEW_COILS]
    each = most / max(readings, 1) - SETTLE
    return max(1, int(each * UNIT_HZ))


def meant_current(board: Board) -> float:
    """Peak of the sine that the playing coil is given, A."""
    electronics = board.electronics
    half = 1.0 if electronics.is_bridge else 2.0
    return LEVEL * electronics.supply_v / electronics.coil_ohm / half


def read_hidden(hidden: HiddenPlate, seed: int = 0) -> CoilReadings:
    """What a device reads of its coils on a plate that only it knows, without its firmware.

    `chladni/host/emulation/sensed_plate.py` has the same plate read by the firmware.
    """
    board = hidden.board
    rng = np.random.default_rng((hidden.seed, seed, 44))
    current, gain = meant_current(board), 1.0 + GAIN_ERROR * rng.standard_normal()
    # What flows is less where there is more resistance; coils pull and listen by their strength.
    flows = current / hidden.ohms
    periods = periods_of(board)
    unlike = 1.0 + FLUX_ERROR * rng.uniform(-1.0, 1.0)
    turned = turned_inductances(hidden)
    off = ~np.eye(len(turned), dtype=bool)

    def read_at(multiple: int, induced: ComplexArray, inductances: FloatArray) -> ReadAt:
        hz = multiple * UNIT_HZ
        both: ComplexArray = np.asarray(gain * (induced + 2j * np.pi * hz * inductances) * flows)
        share = fitting_share(both)
        read, spread = _lock_in(share * both, multiple, periods, rng)
        duties = np.full(len(off), LEVEL * share)
        volts, noise = off * read / (share * current), spread / (share * current)
        return ReadAt(hz, volts, noise, duties, np.zeros(len(off)))

    *low, high = hidden_voltages(hidden, (*MULTIPLES, FLUX_MULTIPLE))
    flux = read_at(FLUX_MULTIPLE, high, unlike * turned)
    moved = [read_at(own, induced, turned) for own, induced in zip(MULTIPLES, low, strict=True)]
    count = len(board.actuators)
    each = periods / UNIT_HZ + SETTLE
    return CoilReadings.of(moved, flux, count * (count - 1) * (len(MULTIPLES) + 1) * each)


def but_carrier(apart: ComplexArray, hidden: HiddenPlate) -> tuple[ComplexArray, FloatArray]:
    """What readings differ by, without what pairs have in common by their flux.

    Returns
    -------
    apart
        (frequencies, listening, playing).
    carrier
        What was taken off, as a share of the pulses that coils share, (frequencies,).
    """
    board, hz = hidden.board, reading_frequencies()
    flux = turned_inductances(hidden)
    shared = coil_impedance(board, hz) / board.known_coil.inductance
    numbers = np.tensordot(apart, flux, 2) / np.sum(flux**2)
    return apart - numbers[:, None, None] * flux, np.abs(numbers / shared)


def fitting_share(volts: ComplexArray) -> float:
    """Of the current, so that the loudest coil stays within the converter: 1, 1/2, 1/4 and so on.

    A device sees samples at the converter's ends in the first period, and plays again at half as
    much; that period is not counted.
    """
    share, loudest = 1.0, float(np.abs(volts).max(initial=0.0))
    while AMPLIFIER * share * loudest > FULL_SCALE * REACH_V:
        share /= 2.0
    return share


def _lock_in(
    volts: ComplexArray, multiple: int, periods: int, rng: np.random.Generator
) -> tuple[ComplexArray, FloatArray]:
    """Sines of these amplitudes as amplifier, converter and lock-in read them, and their spread."""
    samples = periods * BASE_SAMPLES
    turns = np.exp(2j * np.pi * multiple * np.arange(samples) / BASE_SAMPLES)
    step = CONVERTER_V / CONVERTER_STEPS
    seen = AMPLIFIER * np.real(volts[..., None] * turns) + CONVERTER_V / 2.0
    place = np.clip(seen / CONVERTER_V, 0.0, 1.0) - 0.5
    # A cubic that leaves both ends and the middle where they are.
    bend = CONVERTER_BEND * step * (4.0 * place**3 - place) / 0.19
    noisy = seen + bend + CONVERTER_NOISE * step * rng.standard_normal(seen.shape)
    taken = np.clip(np.rint(noisy / step), 0, CONVERTER_STEPS - 1) * step
    read = 2.0 * (taken @ turns.conj()) / samples / AMPLIFIER
    spread = CONVERTER_NOISE * step / AMPLIFIER * np.sqrt(2.0 / samples)
    return np.asarray(read), np.full(volts.shape, spread)
